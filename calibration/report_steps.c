// SPDX-License-Identifier: Apache-2.0
#include "calibration/report_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/cholesky.h"
#include "calibration/proof.h"
#include "colorimetry/display_view.h"

static const double NEGLIGIBLE = 1e-6;                  // of a variance over the largest
static const double FIRST_STEP = 0.1, LAST_STEP = 1e-4; // of the search for the closest colour

const char *report_step_name(enum report_step step)
{
    static const char *const names[] = {
#define X(name, text) text,
        REPORT_STEPS(X)
#undef X
    };
    return names[step];
}

// What everything here is computed with.
struct way {
    const struct lamp_report *from;
    const struct display_model *model;
    struct view_gains gains;
    struct xyz reflection, white; // cd/m2; of the perfect diffuser
    bool published;
    double white_patch_Y;
};

static struct xyz add(struct xyz a, struct xyz b)
{
    return (struct xyz){a.X + b.X, a.Y + b.Y, a.Z + b.Z};
}

static struct xyz less(struct xyz a, struct xyz b)
{
    return (struct xyz){a.X - b.X, a.Y - b.Y, a.Z - b.Z};
}

static struct xyz scaled(struct xyz c, double k)
{
    return (struct xyz){k * c.X, k * c.Y, k * c.Z};
}

static struct xyz leaves(const struct way *w, struct counts counts)
{
    return add(display_view_leaves(w->model, w->gains, display_forward(w->model, counts)),
               w->reflection);
}

static double apart(const struct way *w, struct xyz a, struct xyz b)
{
    struct lab la, lb;
    double de = NAN;
    if (w->published) {
        double k = 1 / (PROOF_WHITE_PATCH * w->white_patch_Y);
        proof_published_difference(scaled(a, k), scaled(b, k), scaled(w->white, 1 / w->white.Y),
                                   &de, NULL);
    } else if (lab_of(a, w->white, &la, NULL) && lab_of(b, w->white, &lb, NULL)) {
        de = delta_e_2000(la, lb);
    }
    return de;
}

// Pattern search (Hooke, Jeeves 1961) over the counts, from the clamped ones.
static double closest(const struct way *w, struct xyz aim, struct counts from)
{
    double at[3] = {from.r, from.g, from.b};
    double best = apart(w, aim, leaves(w, from));
    for (double step = FIRST_STEP; step > LAST_STEP;) {
        double before = best;
        for (int c = 0; c < 3; c++)
            for (int side = -1; side <= 1; side += 2) {
                double was = at[c];
                at[c] = fmin(fmax(was + side * step, 0), 1);
                double here = apart(w, aim, leaves(w, (struct counts){at[0], at[1], at[2]}));
                if (here < best)
                    best = here;
                else
                    at[c] = was;
            }
        step *= best < before ? 1 : 0.5;
    }
    return best;
}

static struct way way_of(const struct session_facts *f, const struct lamp_report *from,
                         const struct display_model *model)
{
    struct way w = {.from = from, .model = model};
    struct xyz white = scaled(from->white_taught, 1 / from->white_taught.Y);
    w.white = scaled(white, from->proof_lux / M_PI);
    w.reflection = scaled(w.white, f->place.reflectance);
    w.white_patch_Y = from->patches[from->white_patch].expected.Y;
    for (int c = 0; c < VIEW_CHANNELS; c++)
        w.gains.c[c] = from->gains[c];
    return w;
}

// A colour's share of the radiometer's own causes, k = 1, as a distance.
static double instrument(const struct budget_difference *d)
{
    const struct budget_figure *figures[] = {&d->L, &d->C, &d->H};
    double squares = 0;
    for (int i = 0; i < 3; i++) {
        double share = figures[i]->share[CAUSE_RADIOMETER_REPEATABILITY] +
                       figures[i]->share[CAUSE_RADIOMETER_WAVELENGTH] +
                       figures[i]->share[CAUSE_RADIOMETER_BANDWIDTH] +
                       figures[i]->share[CAUSE_RADIOMETER_CALIBRATION];
        squares += share * figures[i]->u * figures[i]->u;
    }
    return sqrt(squares);
}

static void patch_steps(const struct way *w, const struct patch_report *p, struct xyz flare,
                        double own, struct report_patch *out)
{
    struct xyz reached = leaves(w, p->counts), truly = add(p->predicted, flare);
    double rest = apart(w, truly, p->measured);
    out->steps[STEP_SPECTRAL] = apart(w, p->expected, p->aimed);
    out->steps[STEP_GAMUT] = p->in_gamut ? 0 : apart(w, p->aimed, reached);
    out->steps[STEP_QUANTISATION] = apart(w, reached, p->predicted);
    out->steps[STEP_FLARE] = apart(w, p->predicted, truly);
    out->steps[STEP_INSTRUMENT] = own;
    out->steps[STEP_MODEL] = isnan(own) ? rest : sqrt(fmax(rest * rest - own * own, 0));
}

void report_steps(const struct session_facts *facts, const struct lamp_report *from,
                  const struct display_model *model, struct report_lamp *lamp)
{
    struct way w = way_of(facts, from, model), published = w;
    struct xyz black = leaves(&w, (struct counts){0, 0, 0});
    struct xyz flare = less(from->black_shown, black);
    double squares[STEPS] = {0};
    published.published = true;
    lamp->split = true;
    lamp->black_expected = black.Y;
    lamp->black_shown = from->black_shown.Y;
    for (int i = 0; i < from->patch_count; i++) {
        const struct patch_report *p = &from->patches[i];
        struct report_patch *out = &lamp->patches[i];
        double own = lamp->budgeted ? instrument(&lamp->measured.absolute[i]) : NAN;
        patch_steps(&w, p, flare, own, out);
        out->floor_absolute = p->in_gamut ? 0 : closest(&w, p->expected, p->counts);
        out->floor_published = p->in_gamut ? 0 : closest(&published, p->expected, p->counts);
        for (int k = 0; k < STEPS; k++)
            squares[k] += out->steps[k] * out->steps[k] / from->patch_count;
    }
    for (int k = 0; k < STEPS; k++)
        lamp->steps[k] = sqrt(squares[k]);
}

// ---- the model's own uncertainty -----------------------------------------------------

static struct xyz towards_eye(const struct lamp_report *from, const struct display_model *model,
                              struct xyz at, struct xyz shift)
{
    struct view_gains gains;
    memcpy(gains.c, from->gains, sizeof gains.c);
    return less(display_view_leaves(model, gains, add(at, shift)),
                display_view_leaves(model, gains, at));
}

static int factor(const struct lamp_report *from, const struct display_model *model,
                  const struct display_uncertainty *uncertainty, double *covariance, double *out,
                  int rank)
{
    struct counts counts[FACTS_PATCHES] = {{0}};
    int n = from->patch_count;
    double largest = 0;
    for (int i = 0; i < n; i++)
        counts[i] = from->patches[i].counts;
    display_uncertainty_xyz(uncertainty, model, counts, n, covariance);
    for (int i = 0; i < 3 * n; i++)
        largest = fmax(largest, covariance[(size_t)i * 3 * n + i]);
    return cholesky_pivoted(covariance, 3 * n, rank, NEGLIGIBLE * largest, out);
}

bool report_display_modes(const struct lamp_report *from, const struct display_model *model,
                          const struct display_uncertainty *u, int *modes, struct xyz **out,
                          struct error *err)
{
    int n = from->patch_count, rank = 3 * n;
    *modes = 0;
    *out = NULL;
    if (!u->modes && !(u->smooth_de00 > 0) && !(u->local_de00 > 0))
        return true;
    double *room = calloc(2 * (size_t)rank * rank, sizeof *room);
    double *columns = room ? room + (size_t)rank * rank : NULL;
    *out = calloc((size_t)rank * n, sizeof **out);
    if (room && *out)
        *modes = factor(from, model, u, room, columns, rank);
    for (int i = 0; room && *out && i < n; i++) {
        struct xyz at = display_forward(model, from->patches[i].counts);
        for (int k = 0; k < *modes; k++) {
            const double *c = columns + (size_t)3 * i * rank + k;
            (*out)[(size_t)k * n + i] =
                towards_eye(from, model, at, (struct xyz){c[0], c[rank], c[2 * rank]});
        }
    }
    bool fine = room && *out;
    free(room);
    return fine || fail(err, ERROR_SYSTEM, "out of memory for the display model's uncertainty");
}

struct xyz report_reached(const struct session_facts *facts, const struct lamp_report *from,
                          const struct display_model *model, struct counts counts)
{
    struct way w = way_of(facts, from, model);
    return leaves(&w, counts);
}

struct mat3 report_by_code(const struct lamp_report *from, const struct display_model *model,
                           struct counts counts, int bits)
{
    struct mat3 out = {{{0}}};
    struct view_gains gains;
    double code = 1.0 / ((1 << bits) - 1), at[3] = {counts.r, counts.g, counts.b};
    memcpy(gains.c, from->gains, sizeof gains.c);
    for (int c = 0; c < 3; c++) {
        double low[3] = {at[0], at[1], at[2]}, high[3] = {at[0], at[1], at[2]};
        low[c] = fmax(at[c] - code / 2, 0);
        high[c] = fmin(at[c] + code / 2, 1);
        struct xyz a = display_view_leaves(
            model, gains, display_forward(model, (struct counts){low[0], low[1], low[2]}));
        struct xyz b = display_view_leaves(
            model, gains, display_forward(model, (struct counts){high[0], high[1], high[2]}));
        out.m[0][c] = b.X - a.X;
        out.m[1][c] = b.Y - a.Y;
        out.m[2][c] = b.Z - a.Z;
    }
    return out;
}
