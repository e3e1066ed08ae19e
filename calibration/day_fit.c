// SPDX-License-Identifier: Apache-2.0
#include "calibration/day_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/fit_ceres.h"
#include "colorimetry/metric.h"

// Curves are g(count) ^ CURVE_POWER with g a monotone cubic B-spline: nearly
// straight for any panel, so that few coefficients bend it.
static const double CURVE_POWER = 2.2;
// dE00 per unit change of log slope; best on the held-out halves of real panels.
static const double SMOOTHNESS = 1.5;
// dE00 per interaction of the size of white: keeps apart what patches cannot.
static const double RIDGE = 3;
static const double ROBUST_DE00 = 0.1; // beyond, patches count by their dE00, not its square

enum { PATCHES_LEAST = 20, LEVELS_LEAST = 4, ITERATIONS_MOST = 500 };

// The curves' splines.
struct splines {
    int intervals, slopes;
    double start[DAY_SLOPES_MOST]; // increments of g = count
};

// A place in counts as the residuals need it.
struct place {
    int first[3];        // first of four spline coefficients per channel
    double weight[3][4]; // their B-spline values
};

struct target {
    struct place place;
    struct lab lab;
    struct mat3 metric; // |metric (lab - seen)| = dE00 near lab
};

struct fit {
    const struct measurements *m;
    enum display_kind kind;
    struct splines splines;
    int parameters, interaction; // interaction: where its parameters begin
    struct target *targets;
};

// ---- B-splines -------------------------------------------------------------

static double knot(const struct splines *s, int k)
{
    double t = (k - 3) / (double)s->intervals;
    return t < 0 ? 0 : t > 1 ? 1 : t;
}

// Cox-de Boor: the four cubic B-splines that are not zero at x.
static int splines_at(const struct splines *s, double x, double b[4])
{
    int i = (int)(x * s->intervals);
    i = i > s->intervals - 1 ? s->intervals - 1 : i;
    b[0] = 1;
    for (int degree = 1; degree <= 3; degree++) {
        double saved = 0;
        for (int r = 0; r < degree; r++) {
            double right = knot(s, i + 3 + r + 1);
            double left = knot(s, i + 3 + 1 - degree + r);
            double part = b[r] / (right - left);
            b[r] = saved + (right - x) * part;
            saved = (x - left) * part;
        }
        b[degree] = saved;
    }
    return i;
}

static struct splines splines_of(int intervals)
{
    struct splines s = {.intervals = intervals, .slopes = intervals + 2};
    for (int j = 0; j < s.slopes; j++)
        s.start[j] = (knot(&s, j + 4) - knot(&s, j + 1)) / 3; // Greville abscissae: g(x) = x
    return s;
}

static struct place place_of(const struct splines *s, struct counts counts)
{
    const double v[3] = {counts.r, counts.g, counts.b};
    struct place p;
    for (int c = 0; c < 3; c++)
        p.first[c] = splines_at(s, v[c], p.weight[c]);
    return p;
}

// Coefficients rise by start * exp(q), then all is scaled to end at 1.
static void coefficients(const struct splines *s, const double *q, double *steps, double *p)
{
    double sum = 0;
    p[0] = 0;
    for (int j = 0; j < s->slopes; j++) {
        steps[j] = s->start[j] * exp(q[j]);
        sum += steps[j];
        p[j + 1] = sum;
    }
    for (int j = 0; j < s->slopes; j++) {
        steps[j] /= sum;
        p[j + 1] /= sum;
    }
}

// Linear light of one channel and its slope by each q.
static double channel_light(const struct splines *s, const struct place *at, int c, const double *q,
                            double *by_q)
{
    double steps[DAY_SLOPES_MOST];
    double p[DAY_SLOPES_MOST + 1];
    coefficients(s, q, steps, p);
    double g = 0;
    for (int k = 0; k < 4; k++)
        g += at->weight[c][k] * p[at->first[c] + k];
    double rise = CURVE_POWER * pow(g, CURVE_POWER - 1);
    double above = 0; // sum of B-splines from coefficient j + 1 on
    for (int j = s->slopes - 1; by_q && j >= 0; j--) {
        int k = j + 1 - at->first[c];
        above += k >= 0 && k < 4 ? at->weight[c][k] : 0;
        by_q[j] = rise * steps[j] * (above - g);
    }
    return pow(g, CURVE_POWER);
}

// ---- from parameters to a colour -------------------------------------------

// Linear lights of a place, what they make of XYZ over white, and the slopes of
// both.
struct seen {
    double light[4];                 // and 1
    double terms[DISPLAY_TERMS];     // of the interaction
    double by_q[3][DAY_SLOPES_MOST]; // light by its spline
    double by_light[3][3];           // XYZ over white by light
    double xyz[3];                   // over white
};

static void see(const struct fit *f, const struct place *at, const double *x, bool slopes,
                struct seen *s)
{
    double term_slopes[DISPLAY_TERMS][3];
    const double *between = f->kind == DISPLAY_INTERACTION ? x + f->interaction : NULL;
    for (int c = 0; c < 3; c++)
        s->light[c] = channel_light(&f->splines, at, c, x + DAY_MATRIX + c * f->splines.slopes,
                                    slopes ? s->by_q[c] : NULL);
    s->light[3] = 1;
    display_terms((struct counts){s->light[0], s->light[1], s->light[2]}, s->terms, term_slopes);
    for (int i = 0; i < 3; i++) {
        s->xyz[i] = 0;
        for (int n = 0; n < 4; n++)
            s->xyz[i] += x[4 * i + n] * s->light[n];
        for (int n = 0; n < 3; n++)
            s->by_light[i][n] = x[4 * i + n];
        for (int t = 0; between && t < DISPLAY_TERMS; t++) {
            double k = between[DISPLAY_TERMS * i + t];
            s->xyz[i] += k * s->terms[t];
            for (int n = 0; n < 3; n++)
                s->by_light[i][n] += k * term_slopes[t][n];
        }
    }
}

// d out / d x from d out / d XYZ (by_xyz, already times white), row-major.
static void chain(const struct fit *f, const struct seen *s, const double by_xyz[3][3],
                  double *jacobian)
{
    memset(jacobian, 0, 3 * (size_t)f->parameters * sizeof *jacobian);
    for (int r = 0; r < 3; r++) {
        double *row = jacobian + r * f->parameters;
        for (int i = 0; i < 3; i++) {
            for (int n = 0; n < 4; n++)
                row[4 * i + n] = by_xyz[r][i] * s->light[n];
            for (int n = 0; n < 3; n++)
                for (int j = 0; j < f->splines.slopes; j++)
                    row[DAY_MATRIX + n * f->splines.slopes + j] +=
                        by_xyz[r][i] * s->by_light[i][n] * s->by_q[n][j];
            for (int t = 0; f->kind == DISPLAY_INTERACTION && t < DISPLAY_TERMS; t++)
                row[f->interaction + DISPLAY_TERMS * i + t] = by_xyz[r][i] * s->terms[t];
        }
    }
}

static struct xyz times(const double relative[3], struct xyz white)
{
    return (struct xyz){relative[0] * white.X, relative[1] * white.Y, relative[2] * white.Z};
}

static void by_relative(struct mat3 by_xyz, struct xyz white, double out[3][3])
{
    for (int r = 0; r < 3; r++) {
        out[r][0] = by_xyz.m[r][0] * white.X;
        out[r][1] = by_xyz.m[r][1] * white.Y;
        out[r][2] = by_xyz.m[r][2] * white.Z;
    }
}

// ---- residuals -------------------------------------------------------------

static bool patch_residuals(const struct fit *f, int index, const double *x, double *residuals,
                            double *jacobian)
{
    const struct target *t = &f->targets[index];
    struct seen s;
    struct lab lab;
    see(f, &t->place, x, jacobian, &s);
    struct xyz c = times(s.xyz, f->m->white);
    if (!lab_of(c, f->m->white, &lab, NULL))
        return false;
    struct vec3 apart = {lab.L - t->lab.L, lab.a - t->lab.a, lab.b - t->lab.b};
    struct vec3 r = mat3_apply(t->metric, apart);
    residuals[0] = r.x;
    residuals[1] = r.y;
    residuals[2] = r.z;
    if (jacobian) {
        double by[3][3];
        by_relative(mat3_mul(t->metric, lab_slopes(c, f->m->white)), f->m->white, by);
        chain(f, &s, by, jacobian);
    }
    return true;
}

// Three residuals, each one parameter times a factor, less another where
// `other` is not -1.
static bool tied(const struct fit *f, const int at[3], const int other[3], double factor,
                 const double *x, double *residuals, double *jacobian)
{
    if (jacobian)
        memset(jacobian, 0, 3 * (size_t)f->parameters * sizeof *jacobian);
    for (int c = 0; c < 3; c++) {
        residuals[c] = factor * (x[at[c]] - (other[c] < 0 ? 0 : x[other[c]]));
        if (!jacobian)
            continue;
        jacobian[c * f->parameters + at[c]] = factor;
        if (other[c] >= 0)
            jacobian[c * f->parameters + other[c]] = -factor;
    }
    return true;
}

// One change of log slope of each channel; the last one fixes the mean of q,
// which scaling leaves free.
static bool smooth_residuals(const struct fit *f, int j, const double *x, double *residuals,
                             double *jacobian)
{
    int at[3], next[3];
    for (int c = 0; c < 3; c++) {
        at[c] = DAY_MATRIX + c * f->splines.slopes + j;
        next[c] = j == f->splines.slopes - 1 ? -1 : at[c] + 1;
    }
    return tied(f, at, next, SMOOTHNESS, x, residuals, jacobian);
}

static bool small_residuals(const struct fit *f, int term, const double *x, double *residuals,
                            double *jacobian)
{
    const int none[3] = {-1, -1, -1};
    int at[3];
    for (int i = 0; i < 3; i++)
        at[i] = f->interaction + DISPLAY_TERMS * i + term;
    return tied(f, at, none, RIDGE, x, residuals, jacobian);
}

// Groups: the patches, the splines' changes, the interaction's terms.
static bool residuals_of(void *context, int group, const double *x, double *residuals,
                         double *jacobian)
{
    const struct fit *f = context;
    int beyond = group - f->m->count;
    if (beyond < 0)
        return patch_residuals(f, group, x, residuals, jacobian);
    if (beyond < f->splines.slopes)
        return smooth_residuals(f, beyond, x, residuals, jacobian);
    return small_residuals(f, beyond - f->splines.slopes, x, residuals, jacobian);
}

// ---- set-up ----------------------------------------------------------------

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a;
    double y = *(const double *)b;
    return (x > y) - (x < y);
}

// Different counts of the channel with the fewest.
static int levels(const struct measurements *m, double *room)
{
    int least = m->count;
    for (int c = 0; c < 3; c++) {
        int different = 1;
        for (int i = 0; i < m->count; i++) {
            const double counts[3] = {m->patches[i].counts.r, m->patches[i].counts.g,
                                      m->patches[i].counts.b};
            room[i] = counts[c];
        }
        qsort(room, (size_t)m->count, sizeof *room, by_value);
        for (int i = 1; i < m->count; i++)
            different += room[i] - room[i - 1] > 1e-3;
        least = different < least ? different : least;
    }
    return least;
}

bool day_fit_intervals(const struct measurements *m, int *intervals, struct error *err)
{
    double *room = malloc(((size_t)m->count + 1) * sizeof *room);
    if (!room)
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    int seen = levels(m, room);
    free(room);
    if (m->count < PATCHES_LEAST || seen < LEVELS_LEAST)
        return fail(err, ERROR_DATA,
                    "%s: %d patches with %d levels of a channel cannot decide a display model; at "
                    "least %d patches and %d levels",
                    m->path, m->count, seen, PATCHES_LEAST, LEVELS_LEAST);
    int half = seen / 2;
    *intervals = half > DAY_INTERVALS_MOST ? DAY_INTERVALS_MOST : half;
    return true;
}

struct day_fit day_fit_start(int intervals)
{
    // Rec. 709 primaries over their white: close enough to any display.
    static const double rec709[DAY_MATRIX] = {0.4339, 0.3762, 0.1899, 0.001,  0.2126, 0.7152,
                                              0.0722, 0.001,  0.0177, 0.1095, 0.8728, 0.001};
    struct day_fit start = {.intervals = intervals};
    memcpy(start.x, rec709, sizeof rec709);
    return start;
}

int day_fit_parameters(enum display_kind kind, int intervals)
{
    return DAY_MATRIX + 3 * (intervals + 2) + (kind == DISPLAY_INTERACTION ? DAY_INTERACTION : 0);
}

static struct fit fit_of(const struct measurements *m, enum display_kind kind, int intervals)
{
    return (struct fit){.m = m,
                        .kind = kind,
                        .splines = splines_of(intervals),
                        .parameters = day_fit_parameters(kind, intervals),
                        .interaction = day_fit_parameters(DISPLAY_DAY, intervals)};
}

static bool aim(struct fit *f, struct error *err)
{
    f->targets = calloc((size_t)f->m->count, sizeof *f->targets);
    if (!f->targets)
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", f->m->count);
    for (int n = 0; n < f->m->count; n++) {
        struct target *t = &f->targets[n];
        t->place = place_of(&f->splines, f->m->patches[n].counts);
        if (!lab_of(f->m->patches[n].xyz, f->m->white, &t->lab, err))
            return while_doing(err, "%s", f->m->path);
        t->metric = de00_metric(t->lab);
    }
    return true;
}

// ---- solving ---------------------------------------------------------------

static void build_curve(const struct splines *s, const double *q, double *curve)
{
    double steps[DAY_SLOPES_MOST];
    double p[DAY_SLOPES_MOST + 1];
    coefficients(s, q, steps, p);
    for (int k = 0; k < DISPLAY_NODES; k++) {
        double b[4];
        double g = 0;
        int first = splines_at(s, k / (double)(DISPLAY_NODES - 1), b);
        for (int n = 0; n < 4; n++)
            g += b[n] * p[first + n];
        curve[k] = pow(g, CURVE_POWER);
    }
}

static int build(const struct fit *f, const double *x, struct display_model *model)
{
    const double white[3] = {f->m->white.X, f->m->white.Y, f->m->white.Z};
    int pooled = 0;
    model->kind = f->kind;
    memset(model->interaction, 0, sizeof model->interaction);
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < 4; c++)
            model->matrix[i][c] = x[4 * i + c] * white[i];
        for (int t = 0; f->kind == DISPLAY_INTERACTION && t < DISPLAY_TERMS; t++)
            model->interaction[i][t] = x[f->interaction + DISPLAY_TERMS * i + t] * white[i];
    }
    for (int c = 0; c < 3; c++) {
        build_curve(&f->splines, x + DAY_MATRIX + c * f->splines.slopes, model->curve[c]);
        pooled += display_curve_repair(model->curve[c]);
    }
    return pooled;
}

static struct least_squares problem_of(struct fit *f)
{
    return (struct least_squares){
        .parameters = f->parameters,
        .groups =
            f->m->count + f->splines.slopes + (f->kind == DISPLAY_INTERACTION ? DISPLAY_TERMS : 0),
        .group_size = 3,
        .evaluate = residuals_of,
        .context = f,
        .robust = ROBUST_DE00,
        .tolerance = 1e-7,
        .iterations = ITERATIONS_MOST,
    };
}

bool day_fit(const struct measurements *m, enum display_kind kind, struct day_fit *at,
             struct display_model *model, struct error *err)
{
    struct fit f = fit_of(m, kind, at->intervals);
    struct least_squares_result result;
    struct day_fit found = *at;
    struct display_model built = *model;
    const struct least_squares problem = problem_of(&f);
    if (!aim(&f, err)) {
        free(f.targets);
        return while_doing(err, "%s", m->path);
    }
    bool solved = least_squares_solve(&problem, found.x, &result, err);
    if (solved) {
        found.iterations = result.iterations;
        found.pooled = build(&f, found.x, &built);
    }
    free(f.targets);
    if (!solved || !display_model_prepare(&built, err))
        return while_doing(err, "%s: %s", m->path,
                           kind == DISPLAY_DAY ? "RGB and XYZ of the patches belong to no display"
                                               : "no channel interaction describes the patches");
    *at = found;
    *model = built;
    return true;
}

// ---- what the solution leaves open -----------------------------------------

static double residual_variance(const struct fit *f, const double *x)
{
    double sum = 0, r[3] = {0, 0, 0};
    for (int i = 0; i < f->m->count; i++) {
        patch_residuals(f, i, x, r, NULL);
        sum += r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    }
    int freedom = 3 * f->m->count - f->parameters;
    return sum / (freedom > 1 ? freedom : 1);
}

// variance * slopes inner slopes', n rows of p slopes.
static void sandwich(const double *slopes, const double *inner, double variance, int n, int p,
                     double *room, double *out)
{
    for (int i = 0; i < n; i++) {
        const double *row = slopes + (long)i * p;
        for (int k = 0; k < p; k++) {
            room[k] = 0;
            for (int j = 0; j < p; j++)
                room[k] += row[j] * inner[(long)j * p + k];
        }
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < p; k++)
                sum += room[k] * slopes[(long)j * p + k];
            out[(long)i * n + j] = variance * sum;
        }
    }
}

bool day_fit_covariance(const struct measurements *m, enum display_kind kind,
                        const struct day_fit *at, const struct counts *counts, int n,
                        double *covariance, struct error *err)
{
    struct fit f = fit_of(m, kind, at->intervals);
    const size_t p = (size_t)f.parameters;
    const struct least_squares problem = problem_of(&f);
    double *inner = malloc(p * p * sizeof *inner);
    double *slopes = malloc(((size_t)3 * (size_t)n + 1) * p * sizeof *slopes);
    bool ok = (inner && slopes) || fail(err, ERROR_SYSTEM, "out of memory for a covariance");
    ok = ok && aim(&f, err) && least_squares_covariance(&problem, at->x, inner, err);
    if (ok) {
        for (int i = 0; i < n; i++)
            day_fit_slopes(at, kind, counts[i], m->white, slopes + 3 * p * (size_t)i);
        sandwich(slopes, inner, residual_variance(&f, at->x), 3 * n, f.parameters,
                 slopes + 3 * p * (size_t)n, covariance);
    }
    free(inner);
    free(slopes);
    free(f.targets);
    return ok;
}

struct lab day_fit_lab(const struct day_fit *at, enum display_kind kind, struct counts counts,
                       struct xyz white)
{
    struct measurements m = {.white = white};
    struct fit f = fit_of(&m, kind, at->intervals);
    struct place place = place_of(&f.splines, counts);
    struct seen s;
    struct lab lab = {0, 0, 0};
    see(&f, &place, at->x, false, &s);
    lab_of(times(s.xyz, white), white, &lab, NULL);
    return lab;
}

void day_fit_slopes(const struct day_fit *at, enum display_kind kind, struct counts counts,
                    struct xyz white, double *slopes)
{
    struct measurements m = {.white = white};
    struct fit f = fit_of(&m, kind, at->intervals);
    struct place place = place_of(&f.splines, counts);
    struct seen s;
    double by[3][3];
    see(&f, &place, at->x, true, &s);
    by_relative(lab_slopes(times(s.xyz, white), white), white, by);
    chain(&f, &s, by, slopes);
}
