// SPDX-License-Identifier: Apache-2.0
#include "calibration/budget.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/random.h"
#include "calibration/budget_modes.h"
#include "calibration/proof.h"
#include "colorimetry/metric.h"

enum { CHUNKS = 64, FIGURES_OF_PATCH = 4, PATCHES_MOST = 1024 };
static const int ALONE_PART = 10; // of the draws, each cause drawn anew

const char *budget_cause_name(enum budget_cause cause)
{
    static const char *const names[] = {
#define X(name, text) text,
        BUDGET_CAUSES(X)
#undef X
    };
    return names[cause];
}

void budget_fini(struct budget *b)
{
    free(b->absolute);
    free(b->published);
    *b = (struct budget){0};
}

struct vec3 budget_residual(const struct xyz *predicted, const struct xyz *measured, int count,
                            struct xyz white)
{
    struct vec3 squares = {0};
    for (int i = 0; i < count; i++) {
        struct lab p = {0}, m = {0};
        lab_of(predicted[i], white, &p, NULL);
        lab_of(measured[i], white, &m, NULL);
        struct vec3 off =
            mat3_apply(de00_metric(p), (struct vec3){m.L - p.L, m.a - p.a, m.b - p.b});
        squares = vec3_add(squares, (struct vec3){off.x * off.x, off.y * off.y, off.z * off.z});
    }
    double n = count > 0 ? count : 1;
    return (struct vec3){sqrt(squares.x / n), sqrt(squares.y / n), sqrt(squares.z / n)};
}

enum verdict verdict_of(double value, double expanded, double tolerance)
{
    if (value + expanded <= tolerance)
        return VERDICT_PASS;
    return value - expanded > tolerance ? VERDICT_FAIL : VERDICT_UNDECIDED;
}

const char *verdict_name(enum verdict verdict)
{
    static const char *const names[] = {"pass", "fail", "undecided"};
    return names[verdict];
}

// ---- one draw --------------------------------------------------------------------

// Where differences are taken: absolute, or as published.
struct frame {
    bool published;
    struct mat3 adapt;
    struct xyz white;
};

struct work {
    const struct budget_input *in;
    const struct budget_modes *modes;
    struct frame frames[2];
    struct mat3 *model[2]; // [count]: Lab of one unit of noise in dE00, display model
};

// Colours of one draw, cd/m2.
struct colours {
    struct xyz *reference, *screen; // [count]
    struct vec3 *model;             // [count]: noise of the display model, in dE00
};

// A stream for each cause, so that one can be drawn anew while the others stay.
struct streams {
    struct random of[CAUSES];
};

static struct streams streams_of(uint64_t seed, uint64_t draw)
{
    struct streams s;
    struct random r = random_stream(seed, draw);
    for (int c = 0; c < CAUSES; c++)
        s.of[c].state = random_bits(&r);
    return s;
}

// reference: [count + 1], screen: [count], both as plain numbers.
static void add_modes(const struct budget_modes *m, struct streams *streams, double *reference,
                      double *screen, double *log_lux, double *log_screen)
{
    for (int k = 0; k < m->count; k++) {
        const struct budget_mode *mode = &m->modes[k];
        double z = random_normal(&streams->of[mode->cause]);
        const double *r = (const double *)mode->reference, *s = (const double *)mode->screen;
        *log_lux += z * mode->log_lux;
        *log_screen += z * mode->log_screen;
        for (int i = 0; r && i < 3 * (m->patches + 1); i++)
            reference[i] += z * r[i];
        for (int i = 0; s && i < 3 * m->patches; i++)
            screen[i] += z * s[i];
    }
}

static struct vec3 normals(struct random *random)
{
    double x = random_normal(random), y = random_normal(random);
    return (struct vec3){x, y, random_normal(random)};
}

static void add_reading(const struct uncertainties *u, struct random *random, struct xyz *s)
{
    double all = u->radiometer_repeat * random_normal(random);
    struct vec3 each = vec3_scale(normals(random), u->radiometer_colour);
    *s = (struct xyz){s->X * (1 + all + each.x), s->Y * (1 + all + each.y),
                      s->Z * (1 + all + each.z)};
}

static void add_rounding(struct mat3 by_code, struct random *random, struct xyz *s)
{
    double r = random_uniform(random) - 0.5, g = random_uniform(random) - 0.5;
    struct vec3 by = mat3_apply(by_code, (struct vec3){r, g, random_uniform(random) - 0.5});
    *s = (struct xyz){s->X + by.x, s->Y + by.y, s->Z + by.z};
}

static struct vec3 residual_of(const struct budget_input *in, struct random *random)
{
    struct vec3 z = normals(random);
    return (struct vec3){z.x * in->display_rms.x, z.y * in->display_rms.y, z.z * in->display_rms.z};
}

// What strikes each reading or each patch by itself.
static void add_own(const struct work *w, struct streams *streams, struct colours *c)
{
    const struct budget_input *in = w->in;
    for (int i = 0; i < in->count; i++) {
        switch (in->scope) {
        case SCOPE_MEASURED:
            add_reading(&in->u, &streams->of[CAUSE_RADIOMETER_REPEATABILITY], &c->screen[i]);
            break;
        case SCOPE_SHOWN:
            add_rounding(in->patches[i].by_code, &streams->of[CAUSE_QUANTISATION], &c->screen[i]);
            if (!in->display_modes)
                c->model[i] = residual_of(in, &streams->of[CAUSE_DISPLAY_MODEL]);
            break;
        }
    }
}

// Draws from streams; NULL: the estimate itself.
static void draw(const struct work *w, struct streams *streams, struct colours *c)
{
    const struct budget_input *in = w->in;
    double log_lux = 0, log_screen = 0;
    memcpy(c->reference, w->modes->reference, ((size_t)in->count + 1) * sizeof *c->reference);
    for (int i = 0; i < in->count; i++) {
        c->screen[i] = in->patches[i].screen;
        c->model[i] = (struct vec3){0};
    }
    if (streams)
        add_modes(w->modes, streams, (double *)c->reference, (double *)c->screen, &log_lux,
                  &log_screen);
    double k = in->lux * exp(log_lux) / M_PI / c->reference[in->count].Y, g = exp(log_screen);
    for (int i = 0; i < in->count; i++) {
        struct xyz *r = &c->reference[i], *s = &c->screen[i];
        *r = (struct xyz){k * r->X, k * r->Y, k * r->Z};
        *s = (struct xyz){g * s->X, g * s->Y, g * s->Z};
    }
    if (streams)
        add_own(w, streams, c);
}

static struct lab lab_in(const struct frame *f, struct xyz c, double white_patch_y)
{
    struct lab lab = {0};
    if (f->published) {
        double k = 1 / (PROOF_WHITE_PATCH * white_patch_y);
        c = xyz_apply(f->adapt, (struct xyz){k * c.X, k * c.Y, k * c.Z});
    }
    lab_of(c, f->white, &lab, NULL);
    return lab;
}

static struct lab moved(struct lab lab, struct mat3 by, struct vec3 noise)
{
    struct vec3 d = mat3_apply(by, noise);
    return (struct lab){lab.L + d.x, lab.a + d.y, lab.b + d.z};
}

// L, C, H, E of every patch.
static void differences(const struct work *w, int frame, const struct colours *c, double *out)
{
    const struct frame *f = &w->frames[frame];
    double reference_white = c->reference[w->in->white].Y, screen_white = c->screen[w->in->white].Y;
    for (int i = 0; i < w->in->count; i++) {
        struct lab a = lab_in(f, c->reference[i], reference_white);
        struct lab b = lab_in(f, c->screen[i], screen_white);
        b = moved(b, w->model[frame][i], c->model[i]);
        struct delta_lch d = delta_lch_2000(a, b);
        double *at = out + FIGURES_OF_PATCH * i;
        at[0] = d.L;
        at[1] = d.C;
        at[2] = d.H;
        at[3] = delta_e_2000(a, b);
    }
}

static void overall(const struct budget_input *in, const double *figures, double *mean, double *max)
{
    int n = 0;
    *mean = *max = 0;
    for (int i = 0; i < in->count; i++)
        if (in->patches[i].counts) {
            double e = figures[FIGURES_OF_PATCH * i + 3];
            *mean += e;
            *max = fmax(*max, e);
            n++;
        }
    *mean /= n > 0 ? n : 1;
}

// ---- many draws ------------------------------------------------------------------

static int figure_count(const struct budget_input *in)
{
    return 2 * (FIGURES_OF_PATCH * in->count + 2);
}

// Both frames one after the other; of each, four figures a patch, then mean and
// maximum.
static void figures_of(const struct work *w, const struct colours *c, double *out)
{
    int n = figure_count(w->in) / 2;
    for (int f = 0; f < 2; f++) {
        differences(w, f, c, out + f * n);
        overall(w->in, out + f * n, out + f * n + n - 2, out + f * n + n - 1);
    }
}

static bool colours_make(int count, struct colours *c)
{
    size_t n = (size_t)count + 1;
    *c = (struct colours){calloc(n, sizeof *c->reference), calloc(n, sizeof *c->screen),
                          calloc(n, sizeof *c->model)};
    return c->reference && c->screen && c->model;
}

static void colours_fini(struct colours *c)
{
    free(c->reference);
    free(c->screen);
    free(c->model);
}

// What one thread works with.
struct bench_of_draws {
    struct colours c;
    double *figures, *again;
};

static bool bench_make(const struct work *w, struct bench_of_draws *b)
{
    size_t n = (size_t)figure_count(w->in);
    b->figures = calloc(n, sizeof *b->figures);
    b->again = calloc(n, sizeof *b->again);
    return colours_make(w->in->count, &b->c) && b->figures && b->again;
}

static void bench_fini(struct bench_of_draws *b)
{
    colours_fini(&b->c);
    free(b->figures);
    free(b->again);
}

// Sums of the squares of what each figure is off its estimate by.
static void one_draw(const struct work *w, struct bench_of_draws *b, uint64_t seed, int number,
                     const double *estimate, double *squares)
{
    struct streams streams = streams_of(seed, (uint64_t)number);
    draw(w, &streams, &b->c);
    figures_of(w, &b->c, b->figures);
    for (int i = 0; i < figure_count(w->in); i++) {
        double off = b->figures[i] - estimate[i];
        squares[i] += off * off;
    }
}

// Half the squares of what drawing each cause anew changes: its total share.
// Source: Jansen 1999 (Comput. Phys. Commun. 117, 35).
static void one_draw_of_each(const struct work *w, struct bench_of_draws *b, uint64_t seed,
                             int number, double *squares)
{
    int n = figure_count(w->in);
    struct streams streams = streams_of(seed, (uint64_t)number), used = streams;
    struct streams others = streams_of(~seed, (uint64_t)number);
    draw(w, &used, &b->c);
    figures_of(w, &b->c, b->figures);
    for (int c = 0; c < CAUSES; c++) {
        used = streams;
        used.of[c] = others.of[c];
        draw(w, &used, &b->c);
        figures_of(w, &b->c, b->again);
        for (int i = 0; i < n; i++) {
            double off = b->again[i] - b->figures[i];
            squares[(size_t)c * n + i] += off * off / 2;
        }
    }
}

struct sums {
    double *room; // CHUNKS times, and once more for all
    size_t size;  // squares of all causes, then of each drawn anew
};

static int from_chunk(int draws, int chunk)
{
    return (int)((int64_t)draws * chunk / CHUNKS);
}

static bool chunk(const struct work *w, int k, int draws, uint64_t seed, const double *estimate,
                  double *room)
{
    struct bench_of_draws b = {0};
    int n = figure_count(w->in), parts = w->in->shares ? draws / ALONE_PART : 0;
    bool fine = bench_make(w, &b);
    for (int d = from_chunk(draws, k); fine && d < from_chunk(draws, k + 1); d++)
        one_draw(w, &b, seed, d, estimate, room);
    for (int d = from_chunk(parts, k); fine && d < from_chunk(parts, k + 1); d++)
        one_draw_of_each(w, &b, seed, d, room + n);
    bench_fini(&b);
    return fine;
}

// Chunks are summed in their order, whoever worked on them. The sums of all
// stand first.
static bool all_draws(const struct work *w, int draws, uint64_t seed, const double *estimate,
                      struct sums *sums)
{
    bool fine = true;
#pragma omp parallel for schedule(dynamic) reduction(&& : fine)
    for (int k = 0; k < CHUNKS; k++)
        fine =
            chunk(w, k, draws, seed, estimate, sums->room + ((size_t)k + 1) * sums->size) && fine;
    for (size_t k = 1; k <= CHUNKS; k++)
        for (size_t i = 0; i < sums->size; i++)
            sums->room[i] += sums->room[k * sums->size + i];
    return fine;
}

// ---- the budget ------------------------------------------------------------------

static struct budget_figure *figure(struct budget *b, int frame, int index)
{
    struct budget_difference *d = &(frame ? b->published : b->absolute)[index / FIGURES_OF_PATCH];
    struct budget_figure *const of[] = {&d->L, &d->C, &d->H, &d->E};
    return of[index % FIGURES_OF_PATCH];
}

// About the stated value, not about the mean of the draws: chroma and total
// differences near zero are folded, and their mean is not the best estimate.
static void take_values(struct budget *b, const double *estimate, const double *squares)
{
    int n = FIGURES_OF_PATCH * b->count + 2;
    for (int f = 0; f < 2; f++) {
        double u[2];
        for (int i = 0; i < n; i++) {
            double value = estimate[f * n + i];
            double own = sqrt(squares[f * n + i] / b->draws);
            if (i < n - 2)
                *figure(b, f, i) = (struct budget_figure){.value = value, .u = own};
            else
                u[i - n + 2] = own;
        }
        *(f ? &b->published_all : &b->absolute_all) =
            (struct budget_overall){estimate[f * n + n - 2], u[0], estimate[f * n + n - 1], u[1]};
    }
}

// Scaled to a sum of 1.
static void take_shares(struct budget *b, const double *squares)
{
    int n = FIGURES_OF_PATCH * b->count + 2;
    for (int f = 0; f < 2; f++)
        for (int i = 0; i < n - 2; i++) {
            double sum = 0;
            for (int c = 0; c < CAUSES; c++)
                sum += squares[(size_t)c * 2 * n + f * n + i];
            for (int c = 0; c < CAUSES && sum > 0; c++)
                figure(b, f, i)->share[c] = squares[(size_t)c * 2 * n + f * n + i] / sum;
        }
}

static bool run(const struct work *w, int draws, uint64_t seed, struct budget *b)
{
    size_t n = (size_t)figure_count(w->in);
    struct sums sums = {.size = n * (CAUSES + 1)};
    struct bench_of_draws first = {0};
    double *estimate = calloc(n, sizeof *estimate);
    sums.room = calloc(sums.size * (CHUNKS + 1), sizeof *sums.room);
    bool fine = bench_make(w, &first) && estimate && sums.room;
    if (fine) {
        draw(w, NULL, &first.c);
        figures_of(w, &first.c, estimate);
        fine = all_draws(w, draws, seed, estimate, &sums);
    }
    if (fine) {
        take_values(b, estimate, sums.room);
        take_shares(b, sums.room + n);
    }
    bench_fini(&first);
    free(estimate);
    free(sums.room);
    return fine;
}

// Lab of noise in the display model, at the colours of the estimate.
static bool aim_model(struct work *w)
{
    struct colours c;
    bool fine = colours_make(w->in->count, &c);
    for (int f = 0; f < 2; f++)
        fine = (w->model[f] = calloc((size_t)w->in->count, sizeof *w->model[f])) && fine;
    if (fine)
        draw(w, NULL, &c);
    for (int f = 0; fine && f < 2; f++)
        for (int i = 0; i < w->in->count; i++) {
            struct lab lab = lab_in(&w->frames[f], c.screen[i], c.screen[w->in->white].Y);
            mat3_invert(de00_metric(lab), &w->model[f][i]);
        }
    colours_fini(&c);
    return fine;
}

static void aim_frames(struct work *w)
{
    struct xyz white = w->modes->reference[w->in->count];
    double k = w->in->lux / M_PI / white.Y;
    w->frames[0] = (struct frame){.white = {k * white.X, k * white.Y, k * white.Z}};
    w->frames[1] = (struct frame){
        .published = true,
        .adapt = proof_adaptation((struct xyz){white.X / white.Y, 1, white.Z / white.Y}),
        .white = proof_white};
}

static bool check(const struct budget_input *in, int draws, struct error *err)
{
    if (in->count < 1 || in->count > PATCHES_MOST || in->white < 0 || in->white >= in->count)
        return fail(err, ERROR_RANGE, "budget: %d patches, white %d", in->count, in->white);
    if (draws < 100 || draws > 10000000)
        return fail(err, ERROR_RANGE, "budget: %d draws are outside 100..10000000", draws);
    if (!(in->lux > 0 && in->patches[in->white].screen.Y > 0))
        return fail(err, ERROR_RANGE, "budget: no light");
    return true;
}

bool budget_make(const struct budget_input *in, int draws, uint64_t seed, struct budget *out,
                 struct error *err)
{
    struct budget_modes modes;
    struct budget b = {.count = in->count, .draws = draws};
    if (!check(in, draws, err) || !budget_modes_make(in, &modes, err))
        return false;
    struct work w = {.in = in, .modes = &modes};
    aim_frames(&w);
    b.absolute = calloc((size_t)in->count, sizeof *b.absolute);
    b.published = calloc((size_t)in->count, sizeof *b.published);
    bool fine = b.absolute && b.published && aim_model(&w) && run(&w, draws, seed, &b);
    free(w.model[0]);
    free(w.model[1]);
    budget_modes_fini(&modes);
    if (fine)
        *out = b;
    else
        budget_fini(&b);
    return fine || fail(err, ERROR_SYSTEM, "out of memory for the budget");
}
