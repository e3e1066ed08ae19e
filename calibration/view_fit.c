// SPDX-License-Identifier: Apache-2.0
#include "calibration/view_fit.h"

#include <math.h>
#include <stdlib.h>

#include "calibration/fit_ceres.h"

static const double CENTRE = 0.5, SAME_PLACE = 1e-3, SAME_DIRECTION = 1e-3;
static const double RADIANS = M_PI / 180;
static const double ANGLES_APART_DEG = 5, GAP_MOST_DEG = 120;
enum { DIRECTIONS_LEAST = 12, DIRECTIONS_MOST = 1024, ANGLES_LEAST = 3, ITERATIONS = 20 };

static bool at_centre(const struct view_spot *s)
{
    return fabs(s->x - CENTRE) < SAME_PLACE && fabs(s->y - CENTRE) < SAME_PLACE;
}

static bool on_normal(const struct view_spot *s)
{
    return hypot(s->u, s->v) < SAME_DIRECTION;
}

static struct xyz less(struct xyz a, struct xyz b)
{
    return (struct xyz){a.X - b.X, a.Y - b.Y, a.Z - b.Z};
}

// Primaries and black of a spot as a model whose counts are linear light.
static bool primaries_of(const struct view_spot *s, struct display_model *m, struct error *err)
{
    *m = (struct display_model){.name = "primaries"};
    for (int c = 0; c < 3; c++) {
        struct xyz light = less(s->xyz[c], s->xyz[VIEW_BLACK]);
        m->matrix[0][c] = light.X;
        m->matrix[1][c] = light.Y;
        m->matrix[2][c] = light.Z;
        for (int k = 0; k < DISPLAY_NODES; k++)
            m->curve[c][k] = (double)k / (DISPLAY_NODES - 1);
    }
    m->matrix[0][3] = s->xyz[VIEW_BLACK].X;
    m->matrix[1][3] = s->xyz[VIEW_BLACK].Y;
    m->matrix[2][3] = s->xyz[VIEW_BLACK].Z;
    return display_model_prepare(m, err) || while_doing(err, "primaries at the centre");
}

// Gains of a spot: each primary's own share of itself, black's luminance.
static bool gains_of(const struct display_model *m, const struct view_spot *s,
                     struct view_gains *out, struct error *err)
{
    static const char *const NAMES[] = {"red", "green", "blue", "black"};
    for (int c = 0; c < VIEW_CHANNELS; c++) {
        struct xyz light = less(s->xyz[c], s->xyz[VIEW_BLACK]);
        out->c[c] = c == VIEW_BLACK ? s->xyz[c].Y / m->matrix[1][3]
                                    : m->inverse[c][0] * light.X + m->inverse[c][1] * light.Y +
                                          m->inverse[c][2] * light.Z;
        if (!(out->c[c] > 0.05 && out->c[c] < 20))
            return fail(err, ERROR_DATA,
                        "%s is %g times that of the centre along the normal (u %.3f, v %.3f, x "
                        "%.3f, y %.3f); sound: 0.05..20",
                        NAMES[c], out->c[c], s->u, s->v, s->x, s->y);
    }
    return true;
}

// ---- directions ------------------------------------------------------------

struct directions {
    const struct display_model *model;
    int count;
    double terms[DIRECTIONS_MOST][VIEW_TERMS]; // of ln gain
    struct view_gains gains[DIRECTIONS_MOST];
    int channel;
    double sines[DIRECTIONS_MOST]; // of the angles
};

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Largest gap in the turn about the normal, degrees.
static double widest_gap(const struct directions *d)
{
    double turns[DIRECTIONS_MOST], widest = 0;
    int n = 0;
    for (int i = 0; i < d->count; i++)
        turns[n++] = atan2(d->terms[i][1], d->terms[i][0]) / RADIANS;
    qsort(turns, (size_t)n, sizeof *turns, ascending);
    for (int i = 0; i < n; i++)
        widest = fmax(widest, i + 1 < n ? turns[i + 1] - turns[i] : turns[0] + 360 - turns[i]);
    return widest;
}

// How many angles to the normal lie apart; sorts them.
static int angles_apart(struct directions *d)
{
    int angles = 1;
    qsort(d->sines, (size_t)d->count, sizeof *d->sines, ascending);
    double last = asin(d->sines[0]);
    for (int i = 1; i < d->count; i++)
        if (asin(d->sines[i]) - last >= ANGLES_APART_DEG * RADIANS) {
            last = asin(d->sines[i]);
            angles++;
        }
    return angles;
}

static bool decide(struct directions *d, struct error *err)
{
    if (d->count < DIRECTIONS_LEAST)
        return fail(err, ERROR_DATA, "%d directions off the normal; at least %d are needed",
                    d->count, DIRECTIONS_LEAST);
    int angles = angles_apart(d);
    if (angles < ANGLES_LEAST)
        return fail(
            err, ERROR_DATA,
            "directions at %d angles to the normal, %.1f to %.1f degrees; %d angles at least "
            "%g degrees apart are needed",
            angles, asin(d->sines[0]) / RADIANS, asin(d->sines[d->count - 1]) / RADIANS,
            ANGLES_LEAST, ANGLES_APART_DEG);
    double gap = widest_gap(d);
    return gap <= GAP_MOST_DEG || fail(err, ERROR_DATA,
                                       "no direction over %.0f degrees of the turn about the "
                                       "normal; at most %g are allowed",
                                       gap, GAP_MOST_DEG);
}

static bool gather(const struct view_spot *spots, int count, struct directions *d,
                   struct error *err)
{
    for (int i = 1; i < count; i++) {
        const struct view_spot *s = &spots[i];
        double u = s->u, v = s->v, s2 = u * u + v * v;
        if (!at_centre(s) || on_normal(s))
            continue;
        if (d->count == DIRECTIONS_MOST)
            return fail(err, ERROR_DATA, "more than %d directions", DIRECTIONS_MOST);
        const double terms[VIEW_TERMS] = {u, v, u * u, u * v, v * v, s2 * s2, s2 * s2 * s2};
        for (int t = 0; t < VIEW_TERMS; t++)
            d->terms[d->count][t] = terms[t];
        d->sines[d->count] = sqrt(s2);
        if (!gains_of(d->model, s, &d->gains[d->count++], err))
            return false;
    }
    return decide(d, err);
}

static bool log_gain(void *context, int group, const double *x, double *residuals, double *jacobian)
{
    const struct directions *d = context;
    double sum = 0;
    for (int t = 0; t < VIEW_TERMS; t++) {
        sum += x[t] * d->terms[group][t];
        if (jacobian)
            jacobian[t] = d->terms[group][t];
    }
    residuals[0] = sum - log(d->gains[group].c[d->channel]);
    return true;
}

static bool fit_angles(struct directions *d, struct display_view *view, struct error *err)
{
    struct least_squares problem = {.parameters = VIEW_TERMS,
                                    .groups = d->count,
                                    .group_size = 1,
                                    .evaluate = log_gain,
                                    .context = d,
                                    .iterations = ITERATIONS};
    struct least_squares_result result;
    view->sine_most = d->sines[d->count - 1];
    for (d->channel = 0; d->channel < VIEW_CHANNELS; d->channel++)
        if (!least_squares_solve(&problem, view->angle[d->channel], &result, err))
            return while_doing(err, "fitting the gain by angle");
    return true;
}

// ---- places ----------------------------------------------------------------

static int place_index(double t)
{
    for (int i = 0; i < VIEW_GRID; i++)
        if (fabs(t - VIEW_PLACES[i]) < SAME_PLACE)
            return i;
    return -1;
}

static bool take_places(const struct view_spot *spots, int count, const struct display_model *model,
                        struct display_view *view, int *places, struct error *err)
{
    bool there[VIEW_GRID][VIEW_GRID] = {{false}};
    for (int i = 1; i < count; i++) {
        struct view_gains g;
        int row = place_index(spots[i].y), column = place_index(spots[i].x);
        if (!on_normal(&spots[i]) || row < 0 || column < 0)
            continue;
        if (!gains_of(model, &spots[i], &g, err))
            return false;
        *places += !there[row][column];
        there[row][column] = true;
        for (int c = 0; c < VIEW_CHANNELS; c++)
            view->place[c][row][column] = g.c[c];
    }
    if (*places && *places < VIEW_GRID * VIEW_GRID)
        return fail(err, ERROR_DATA, "%d of %d places were measured; all or none are needed",
                    *places, VIEW_GRID * VIEW_GRID);
    for (int c = 0; *places && c < VIEW_CHANNELS; c++) {
        double centre = view->place[c][VIEW_GRID / 2][VIEW_GRID / 2];
        for (int i = 0; i < VIEW_GRID * VIEW_GRID; i++)
            view->place[c][i / VIEW_GRID][i % VIEW_GRID] /= centre;
    }
    return true;
}

// ---- how well --------------------------------------------------------------

static bool difference(struct xyz a, struct xyz b, struct xyz white, double *de, struct error *err)
{
    struct lab x, y;
    if (!lab_of(a, white, &x, err) || !lab_of(b, white, &y, err))
        return false;
    *de = delta_e_2000(x, y);
    return true;
}

static void keep_larger(double *kept, double value)
{
    if (fabs(value) > fabs(*kept))
        *kept = value;
}

static bool judge(const struct view_spot *spots, int count, const struct display_model *model,
                  const struct display_view *view, struct view_fit *f, struct error *err)
{
    struct xyz white = spots[0].xyz[VIEW_WHITE];
    for (int i = 1; i < count; i++) {
        const struct view_spot *s = &spots[i];
        struct xyz seen = s->xyz[VIEW_WHITE];
        double before, after;
        struct view_gains g = display_view_gains(view, s->u, s->v, s->x, s->y);
        struct xyz told = display_view_leaves(model, g, white);
        if (!difference(seen, white, white, &before, err) ||
            !difference(seen, told, white, &after, err))
            return while_doing(err, "white");
        bool direction = !on_normal(s);
        keep_larger(direction ? &f->before_de00 : &f->place_de00, before);
        keep_larger(direction ? &f->before_percent : &f->place_percent,
                    100 * (seen.Y / white.Y - 1));
        if (direction) {
            keep_larger(&f->after_de00, after);
            keep_larger(&f->after_percent, 100 * (seen.Y / told.Y - 1));
        }
    }
    return true;
}

static bool fit(const struct view_spot *spots, int count, struct directions *d,
                struct display_view *view, struct view_fit *found, struct error *err)
{
    struct display_model *model = malloc(sizeof *model);
    d->model = model;
    bool fine = model || fail(err, ERROR_SYSTEM, "out of memory");
    fine = fine && primaries_of(&spots[0], model, err) && gather(spots, count, d, err) &&
           fit_angles(d, view, err) &&
           take_places(spots, count, model, view, &found->places, err) &&
           display_view_prepare(view, err) && judge(spots, count, model, view, found, err);
    found->directions = d->count;
    free(model);
    return fine;
}

bool view_fit(const struct view_spot *spots, int count, struct display_view *view,
              struct view_fit *found, struct error *err)
{
    struct display_view made;
    struct view_fit facts = {0};
    if (count < 1 || !at_centre(&spots[0]) || !on_normal(&spots[0]))
        return fail(err, ERROR_DATA, "the first reading is not of the centre along the normal");
    display_view_none(&made);
    struct directions *d = calloc(1, sizeof *d);
    bool fine = d || fail(err, ERROR_SYSTEM, "out of memory");
    fine = fine && fit(spots, count, d, &made, &facts, err);
    free(d);
    if (!fine)
        return false;
    *view = made;
    *found = facts;
    return true;
}
