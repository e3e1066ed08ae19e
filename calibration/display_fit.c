// SPDX-License-Identifier: Apache-2.0
#include "calibration/display_fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/fit_ceres.h"
#include "colorimetry/metric.h"

// Curves are g(count) ^ CURVE_POWER with g a monotone cubic B-spline: nearly
// straight for any panel, so that few coefficients bend it.
static const double CURVE_POWER = 2.2;
// dE00 per unit change of log slope; best on the held-out halves of real panels.
static const double SMOOTHNESS = 1.5;
static const double ROBUST_DE00 = 0.1; // beyond, patches count by their dE00, not its square
static const double CONDITION_WARN = 10;
static const double MISFIT_MEAN = 0.6;
static const double MISFIT_P95 = 2;
static const double DRIFT_WARN = 0.03;

enum { INTERVALS_MOST = 24, SLOPES_MOST = INTERVALS_MOST + 2, MATRIX = 12, PATCHES_LEAST = 20 };

// One patch as the residuals need it.
struct target {
    int first[3];        // first of four spline coefficients per channel
    double weight[3][4]; // their B-spline values at the patch's counts
    struct lab lab;
    struct mat3 metric; // |metric (lab - seen)| = dE00 near lab
};

struct fit {
    const struct measurements *m;
    int intervals, slopes, parameters;
    double start[SLOPES_MOST]; // increments of g = count
    struct target *targets;
};

// ---- B-splines -------------------------------------------------------------

static double knot(const struct fit *f, int k)
{
    double t = (k - 3) / (double)f->intervals;
    return t < 0 ? 0 : t > 1 ? 1 : t;
}

// Cox-de Boor: the four cubic B-splines that are not zero at x.
static int splines_at(const struct fit *f, double x, double b[4])
{
    int i = (int)(x * f->intervals);
    i = i > f->intervals - 1 ? f->intervals - 1 : i;
    b[0] = 1;
    for (int degree = 1; degree <= 3; degree++) {
        double saved = 0;
        for (int r = 0; r < degree; r++) {
            double right = knot(f, i + 3 + r + 1);
            double left = knot(f, i + 3 + 1 - degree + r);
            double part = b[r] / (right - left);
            b[r] = saved + (right - x) * part;
            saved = (x - left) * part;
        }
        b[degree] = saved;
    }
    return i;
}

static void start_slopes(struct fit *f)
{
    for (int j = 0; j < f->slopes; j++)
        f->start[j] = (knot(f, j + 4) - knot(f, j + 1)) / 3; // Greville abscissae: g(x) = x
}

// Coefficients rise by start * exp(q), then all is scaled to end at 1.
static double coefficients(const struct fit *f, const double *q, double *steps, double *p)
{
    double sum = 0;
    p[0] = 0;
    for (int j = 0; j < f->slopes; j++) {
        steps[j] = f->start[j] * exp(q[j]);
        sum += steps[j];
        p[j + 1] = sum;
    }
    for (int j = 0; j < f->slopes; j++) {
        steps[j] /= sum;
        p[j + 1] /= sum;
    }
    return sum;
}

// ---- residuals -------------------------------------------------------------

// Linear light of one channel and its slope by each q.
static double channel_light(const struct fit *f, const struct target *t, int c, const double *q,
                            double *by_q)
{
    double steps[SLOPES_MOST];
    double p[SLOPES_MOST + 1];
    coefficients(f, q, steps, p);
    double g = 0;
    for (int k = 0; k < 4; k++)
        g += t->weight[c][k] * p[t->first[c] + k];
    double rise = CURVE_POWER * pow(g, CURVE_POWER - 1);
    double above = 0; // sum of B-splines from coefficient j + 1 on
    for (int j = f->slopes - 1; by_q && j >= 0; j--) {
        int k = j + 1 - t->first[c];
        above += k >= 0 && k < 4 ? t->weight[c][k] : 0;
        by_q[j] = rise * steps[j] * (above - g);
    }
    return pow(g, CURVE_POWER);
}

// d residuals / d x, from d residuals / d XYZ.
static void patch_slopes(const struct fit *f, const double *x, struct mat3 by_xyz,
                         const double light[4], double by_q[3][SLOPES_MOST], double *jacobian)
{
    const double white[3] = {f->m->white.X, f->m->white.Y, f->m->white.Z};
    memset(jacobian, 0, 3 * (size_t)f->parameters * sizeof *jacobian);
    for (int r = 0; r < 3; r++) {
        double *row = jacobian + r * f->parameters;
        for (int i = 0; i < 3; i++) {
            double slope = by_xyz.m[r][i] * white[i];
            for (int n = 0; n < 4; n++)
                row[4 * i + n] = slope * light[n];
            for (int n = 0; n < 3; n++)
                for (int j = 0; j < f->slopes; j++)
                    row[MATRIX + n * f->slopes + j] += slope * x[4 * i + n] * by_q[n][j];
        }
    }
}

// x: matrix rows over white (X r g b black, Y ..., Z ...), then three times q.
static bool patch_residuals(const struct fit *f, int index, const double *x, double *residuals,
                            double *jacobian)
{
    const struct target *t = &f->targets[index];
    const double white[3] = {f->m->white.X, f->m->white.Y, f->m->white.Z};
    double light[4] = {0, 0, 0, 1};
    double by_q[3][SLOPES_MOST];
    double c[3] = {0, 0, 0};
    for (int n = 0; n < 3; n++)
        light[n] = channel_light(f, t, n, x + MATRIX + n * f->slopes, jacobian ? by_q[n] : NULL);
    for (int i = 0; i < 3; i++)
        for (int n = 0; n < 4; n++)
            c[i] += x[4 * i + n] * light[n] * white[i];
    struct xyz seen = {c[0], c[1], c[2]};
    struct lab lab;
    if (!lab_of(seen, f->m->white, &lab, NULL))
        return false;
    struct vec3 apart = {lab.L - t->lab.L, lab.a - t->lab.a, lab.b - t->lab.b};
    struct vec3 r = mat3_apply(t->metric, apart);
    residuals[0] = r.x;
    residuals[1] = r.y;
    residuals[2] = r.z;
    if (jacobian)
        patch_slopes(f, x, mat3_mul(t->metric, lab_slopes(seen, f->m->white)), light, by_q,
                     jacobian);
    return true;
}

// Groups beyond the patches: one change of log slope of each channel; the last
// one fixes the mean of q, which scaling leaves free.
static bool smooth_residuals(const struct fit *f, int j, const double *x, double *residuals,
                             double *jacobian)
{
    if (jacobian)
        memset(jacobian, 0, 3 * (size_t)f->parameters * sizeof *jacobian);
    for (int c = 0; c < 3; c++) {
        int at = MATRIX + c * f->slopes + j;
        bool last = j == f->slopes - 1;
        residuals[c] = SMOOTHNESS * (x[at] - (last ? 0 : x[at + 1]));
        if (jacobian) {
            jacobian[c * f->parameters + at] = SMOOTHNESS;
            if (!last)
                jacobian[c * f->parameters + at + 1] = -SMOOTHNESS;
        }
    }
    return true;
}

static bool residuals_of(void *context, int group, const double *x, double *residuals,
                         double *jacobian)
{
    const struct fit *f = context;
    return group < f->m->count ? patch_residuals(f, group, x, residuals, jacobian)
                               : smooth_residuals(f, group - f->m->count, x, residuals, jacobian);
}

// ---- targets ---------------------------------------------------------------

static bool aim(struct fit *f, struct error *err)
{
    for (int n = 0; n < f->m->count; n++) {
        const struct measured_patch *p = &f->m->patches[n];
        struct target *t = &f->targets[n];
        const double counts[3] = {p->counts.r, p->counts.g, p->counts.b};
        for (int c = 0; c < 3; c++)
            t->first[c] = splines_at(f, counts[c], t->weight[c]);
        if (!lab_of(p->xyz, f->m->white, &t->lab, err))
            return while_doing(err, "%s", f->m->path);
        t->metric = de00_metric(t->lab);
    }
    return true;
}

// ---- from parameters to a model --------------------------------------------

static void start_at(const struct fit *f, double *x)
{
    // Rec. 709 primaries over their white: close enough to any display.
    const double rec709[3][4] = {{0.4339, 0.3762, 0.1899, 0.001},
                                 {0.2126, 0.7152, 0.0722, 0.001},
                                 {0.0177, 0.1095, 0.8728, 0.001}};
    memset(x, 0, (size_t)f->parameters * sizeof *x);
    memcpy(x, rec709, sizeof rec709);
}

static int build(const struct fit *f, const double *x, struct display_model *model)
{
    const double white[3] = {f->m->white.X, f->m->white.Y, f->m->white.Z};
    int pooled = 0;
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 4; c++)
            model->matrix[i][c] = x[4 * i + c] * white[i];
    for (int c = 0; c < 3; c++) {
        double steps[SLOPES_MOST];
        double p[SLOPES_MOST + 1];
        coefficients(f, x + MATRIX + c * f->slopes, steps, p);
        for (int k = 0; k < DISPLAY_NODES; k++) {
            double b[4];
            double g = 0;
            int first = splines_at(f, k / (double)(DISPLAY_NODES - 1), b);
            for (int n = 0; n < 4; n++)
                g += b[n] * p[first + n];
            model->curve[c][k] = pow(g, CURVE_POWER);
        }
        pooled += display_curve_repair(model->curve[c]);
    }
    return pooled;
}

static bool solve(struct fit *f, struct display_model *model, struct display_fit *found,
                  struct error *err)
{
    double x[MATRIX + 3 * SLOPES_MOST];
    struct least_squares_result result;
    const struct least_squares problem = {
        .parameters = f->parameters,
        .groups = f->m->count + f->slopes,
        .group_size = 3,
        .evaluate = residuals_of,
        .context = f,
        .robust = ROBUST_DE00,
        .iterations = 500,
    };
    start_at(f, x);
    if (!aim(f, err))
        return while_doing(err, "%s", f->m->path);
    bool solved = least_squares_solve(&problem, x, &result, err);
    if (solved) {
        found->iterations = result.iterations;
        found->pooled = build(f, x, model);
    }
    return (solved && display_model_prepare(model, err)) ||
           while_doing(err, "%s: RGB and XYZ of the patches belong to no display", f->m->path);
}

// ---- what to say about it --------------------------------------------------

bool display_differences(const struct measurements *m, const struct display_model *model,
                         double *de00, struct error *err)
{
    for (int i = 0; i < m->count; i++) {
        struct lab measured, modelled;
        if (!lab_of(m->patches[i].xyz, m->white, &measured, err) ||
            !lab_of(display_forward(model, m->patches[i].counts), m->white, &modelled, err))
            return while_doing(err, "%s", m->path);
        de00[i] = delta_e_2000(measured, modelled);
    }
    return true;
}

// Mean luminance of the patches of a given colour; false when there is none.
static bool luminance_of(const struct measurements *m, double r, double g, double b, double *Y)
{
    int n = 0;
    *Y = 0;
    for (int i = 0; i < m->count; i++) {
        struct counts c = m->patches[i].counts;
        if (fmax(fmax(fabs(c.r - r), fabs(c.g - g)), fabs(c.b - b)) < 1e-6) {
            *Y += m->patches[i].xyz.Y;
            n++;
        }
    }
    *Y /= n ? n : 1;
    return n;
}

static void look_at_primaries(const struct measurements *m, struct display_fit *found)
{
    double r, g, b, white, black;
    found->primaries = luminance_of(m, 1, 0, 0, &r) && luminance_of(m, 0, 1, 0, &g) &&
                       luminance_of(m, 0, 0, 1, &b) && luminance_of(m, 1, 1, 1, &white) &&
                       luminance_of(m, 0, 0, 0, &black);
    found->additivity = found->primaries ? (r + g + b - 2 * black) / white - 1 : 0;
}

// Of any additive display red is the reddest primary, green the brightest, and
// blue has most of Z.
static bool disordered(const struct display_model *model)
{
    struct xyz p[3];
    struct xy xy[3];
    for (int c = 0; c < 3; c++) {
        p[c] = (struct xyz){model->matrix[0][c], model->matrix[1][c], model->matrix[2][c]};
        xy[c] = xy_of(p[c]);
    }
    return xy[0].x < fmax(xy[1].x, xy[2].x) || p[1].Y < fmax(p[0].Y, p[2].Y) ||
           p[2].Z < fmax(p[0].Z, p[1].Z);
}

static bool judge(const struct measurements *m, const struct display_model *model,
                  struct display_fit *found, struct error *err)
{
    double *de00 = malloc((size_t)m->count * sizeof *de00);
    if (!de00)
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    bool compared = display_differences(m, model, de00, err);
    if (compared)
        found->de00 = summarise(de00, m->count);
    free(de00);
    look_at_primaries(m, found);
    found->ill_conditioned = model->condition > CONDITION_WARN;
    found->misfit = found->de00.mean > MISFIT_MEAN || found->de00.p95 > MISFIT_P95;
    found->disordered = disordered(model);
    found->drifted = m->white_drift > DRIFT_WARN;
    return compared;
}

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

static bool plan(struct fit *f, struct error *err)
{
    double *room = malloc((size_t)f->m->count * sizeof *room);
    f->targets = calloc((size_t)f->m->count, sizeof *f->targets);
    if (!room || !f->targets) {
        free(room);
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", f->m->count);
    }
    int seen = levels(f->m, room);
    free(room);
    if (f->m->count < PATCHES_LEAST || seen < 4)
        return fail(err, ERROR_DATA,
                    "%s: %d patches with %d levels of a channel cannot decide a display model; at "
                    "least %d patches and 4 levels",
                    f->m->path, f->m->count, seen, PATCHES_LEAST);
    f->intervals = seen / 2 < 2 ? 2 : seen / 2 > INTERVALS_MOST ? INTERVALS_MOST : seen / 2;
    f->slopes = f->intervals + 2;
    f->parameters = MATRIX + 3 * f->slopes;
    start_slopes(f);
    return true;
}

bool display_fit(const struct measurements *m, struct display_model *model,
                 struct display_fit *found, struct error *err)
{
    struct fit f = {.m = m};
    struct display_model fitted = {0};
    struct display_fit facts = {.patches = m->count};
    snprintf(fitted.name, sizeof fitted.name, "%s", m->display);
    bool ok = plan(&f, err) && solve(&f, &fitted, &facts, err) && judge(m, &fitted, &facts, err);
    free(f.targets);
    if (ok) {
        *model = fitted;
        *found = facts;
    }
    return ok;
}
