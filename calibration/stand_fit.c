// SPDX-License-Identifier: Apache-2.0
#include "calibration/stand_fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/fit_ceres.h"
#include "drivers/accelerometer.h"

enum { POSES_LEAST = 3, RESIDUALS = 3 + 3 * PLACE_COUNT };
enum { UNKNOWNS_MOST = STAND_PARAMETER_COUNT + STAND_POSES_MOST };

static const double APART_DEG = 5;                 // three tilts, at least
static const double WORST_M = 0.02, WORST_DEG = 1; // of an expanded uncertainty
static const double BLUNDER = 5;                   // uncertainties

const struct stand_instruments STAND_INSTRUMENTS = {0.1, 0.03, 0.0005, 0.001};

static const struct {
    const char *name;
    double x, y; // in widths and heights of the active area
} PLACES[] = {
#define X(name, text, x, y) {text, x, y},
    SCREEN_PLACES(X)
#undef X
};

const char *screen_place_name(enum screen_place place)
{
    return PLACES[place].name;
}

struct vec3 screen_place_at(const struct screen *screen, enum screen_place place)
{
    return (struct vec3){PLACES[place].x * screen->width_m, PLACES[place].y * screen->height_m, 0};
}

static const struct {
    const char *name, *unit;
} PARAMETERS[] = {
#define X(name, text, unit) {text, unit},
    STAND_PARAMETERS(X)
#undef X
};

const char *stand_parameter_name(enum stand_parameter parameter)
{
    return PARAMETERS[parameter].name;
}

const char *stand_parameter_unit(enum stand_parameter parameter)
{
    return PARAMETERS[parameter].unit;
}

struct stand_pose_read stand_pose_unread(void)
{
    struct stand_pose_read p = {NAN, NAN, NAN, {{0}}};
    for (int i = 0; i < PLACE_COUNT; i++)
        for (int k = 0; k < 3; k++)
            p.at[i][k] = NAN;
    return p;
}

// ---- the model --------------------------------------------------------------

struct setup {
    const struct stand_problem *problem;
    bool fitted[STAND_PARAMETER_COUNT];
    int free; // parameters fitted; the tilts of the poses follow them
    double start[STAND_POSES_MOST];
};

static void given_parameters(const struct stand_problem *p, double v[STAND_PARAMETER_COUNT])
{
    const double all[] = {
        p->stand.hinge_m[1],
        p->stand.hinge_m[2],
        p->stand.centre_from_hinge_m[0],
        p->stand.centre_from_hinge_m[1],
        p->stand.centre_from_hinge_m[2],
        p->turned_deg[0],
        p->turned_deg[1],
        p->turned_deg[2],
    };
    memcpy(v, all, sizeof all);
}

// The parameters in their places; those not fitted keep their values.
static void spread(const struct setup *s, const double *x, double v[STAND_PARAMETER_COUNT])
{
    given_parameters(s->problem, v);
    for (int i = 0, k = 0; i < STAND_PARAMETER_COUNT; i++)
        if (s->fitted[i])
            v[i] = x[k++];
}

static struct stand stand_of(const struct stand_problem *p, const double v[STAND_PARAMETER_COUNT])
{
    return (struct stand){
        {p->stand.hinge_m[0], v[STAND_HINGE_Y], v[STAND_HINGE_Z]},
        {v[STAND_CENTRE_X], v[STAND_CENTRE_Y], v[STAND_CENTRE_Z]},
    };
}

// What would be read at that tilt without any error.
static struct stand_pose_read predict(const struct stand_problem *p,
                                      const double v[STAND_PARAMETER_COUNT], double tilt_deg)
{
    struct stand stand = stand_of(p, v);
    struct rigid pose = stand_pose(&stand, tilt_deg);
    struct vec3 gravity = tilt_gravity_turned(tilt_deg, &v[STAND_TURN_X]);
    struct stand_pose_read out = {tilt_deg, tilt_of_gravity(gravity), gravity.x, {{0}}};
    for (int i = 0; i < PLACE_COUNT; i++) {
        struct vec3 at = rigid_apply(pose, screen_place_at(&p->screen, i));
        memcpy(out.at[i], (double[]){at.x, at.y, at.z}, sizeof out.at[i]);
    }
    return out;
}

static struct stand_pose_read difference(const struct stand_pose_read *read,
                                         const struct stand_pose_read *found)
{
    struct stand_pose_read d;
    d.protractor_deg = tilt_wrap(read->protractor_deg - found->protractor_deg);
    d.inclinometer_deg = tilt_wrap(read->inclinometer_deg - found->inclinometer_deg);
    d.lateral = read->lateral - found->lateral;
    for (int i = 0; i < PLACE_COUNT; i++)
        for (int k = 0; k < 3; k++)
            d.at[i][k] = read->at[i][k] - found->at[i][k];
    return d;
}

// Differences over their uncertainties; what was not read weighs nothing.
static void weigh(const struct stand_instruments *u, const struct stand_pose_read *d,
                  double r[RESIDUALS])
{
    int n = 0;
    r[n++] = d->protractor_deg / u->protractor_deg;
    r[n++] = d->inclinometer_deg / u->inclinometer_deg;
    r[n++] = d->lateral / u->lateral;
    for (int i = 0; i < PLACE_COUNT; i++)
        for (int k = 0; k < 3; k++)
            r[n++] = d->at[i][k] / u->tape_m;
    for (int i = 0; i < n; i++)
        r[i] = isfinite(r[i]) ? r[i] : 0;
}

static bool pose_residuals(void *context, int pose, const double *x, double *residuals,
                           double *jacobian)
{
    const struct setup *s = context;
    double v[STAND_PARAMETER_COUNT];
    (void)jacobian;
    spread(s, x, v);
    struct stand_pose_read found = predict(s->problem, v, x[s->free + pose]);
    struct stand_pose_read d = difference(&s->problem->poses[pose], &found);
    weigh(&s->problem->instruments, &d, residuals);
    return true;
}

// ---- what the readings can decide --------------------------------------------

// The tilt that two places at different heights of the screen tell; NAN without.
static double tilt_of_places(const struct stand_problem *p, const struct stand_pose_read *read)
{
    for (int i = 0; i < PLACE_COUNT; i++)
        for (int k = 0; k < PLACE_COUNT; k++) {
            double height = screen_place_at(&p->screen, k).y - screen_place_at(&p->screen, i).y;
            double up = read->at[k][1] - read->at[i][1], out = read->at[k][2] - read->at[i][2];
            if (height <= 0 || !isfinite(up))
                continue;
            return (isfinite(out) ? atan2(up, -out) : asin(fmin(fmax(up / height, -1), 1))) * 180 /
                   M_PI;
        }
    return NAN;
}

static bool knows_angle(const struct stand_problem *p, const struct stand_pose_read *read)
{
    return isfinite(read->protractor_deg) || isfinite(tilt_of_places(p, read));
}

static bool start_tilts(struct setup *s, struct error *err)
{
    const struct stand_problem *p = s->problem;
    for (int i = 0; i < p->count; i++) {
        const struct stand_pose_read *read = &p->poses[i];
        double places = tilt_of_places(p, read);
        s->start[i] = isfinite(read->protractor_deg) ? read->protractor_deg
                      : isfinite(places)             ? places
                                         : tilt_of_turned(read->inclinometer_deg, p->turned_deg);
        if (!isfinite(s->start[i]))
            return fail(err, ERROR_DATA,
                        "pose %d has no angle: neither by protractor, nor by inclinometer, nor by "
                        "two places at different heights of the screen",
                        i + 1);
    }
    return true;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static bool check_angles(const struct setup *s, struct error *err)
{
    double sorted[STAND_POSES_MOST];
    int count = s->problem->count, apart = 1;
    if (count < POSES_LEAST)
        return fail(err, ERROR_DATA, "%d pose(s): at least %d are needed", count, POSES_LEAST);
    memcpy(sorted, s->start, (size_t)count * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, ascending);
    double last = sorted[0];
    for (int i = 1; i < count; i++)
        if (sorted[i] - last >= APART_DEG) {
            apart++;
            last = sorted[i];
        }
    return apart >= POSES_LEAST ||
           fail(err, ERROR_DATA,
                "the tilts, from %.1f to %.1f degrees, are too close together: at least %d of them "
                "must be %g degrees apart",
                sorted[0], sorted[count - 1], POSES_LEAST, APART_DEG);
}

struct counts_read {
    int inclinometer, lateral, angles, x, y, z, all;
};

static struct counts_read count_read(const struct stand_problem *p)
{
    struct counts_read c = {0};
    for (int i = 0; i < p->count; i++) {
        const struct stand_pose_read *read = &p->poses[i];
        c.inclinometer += isfinite(read->inclinometer_deg);
        c.lateral += isfinite(read->lateral);
        c.angles += knows_angle(p, read);
        c.all += isfinite(read->protractor_deg);
        for (int k = 0; k < PLACE_COUNT; k++) {
            c.x += isfinite(read->at[k][0]);
            c.y += isfinite(read->at[k][1]);
            c.z += isfinite(read->at[k][2]);
        }
    }
    c.all += c.inclinometer + c.lateral + c.x + c.y + c.z;
    return c;
}

static void choose(struct setup *s, const struct counts_read *c, char *warning, size_t size)
{
    bool *fitted = s->fitted;
    fitted[STAND_HINGE_Y] = c->y;
    fitted[STAND_HINGE_Z] = c->z;
    fitted[STAND_CENTRE_X] = c->x;
    fitted[STAND_CENTRE_Y] = fitted[STAND_CENTRE_Z] = c->y || c->z;
    fitted[STAND_TURN_X] = c->inclinometer && c->angles;
    fitted[STAND_TURN_Y] = fitted[STAND_TURN_Z] = c->lateral >= 2;
    for (int i = 0; i < STAND_PARAMETER_COUNT; i++)
        s->free += fitted[i];
    if (c->inclinometer && !c->angles)
        snprintf(warning, size,
                 "the inclinometer's zero is taken for right: no pose has an angle by protractor, "
                 "or two places at different heights of the screen");
}

// ---- what was found -----------------------------------------------------------

static bool know_well(const struct stand_fit *f, const double *sorted_tilts, struct error *err)
{
    for (int i = 0; i < STAND_PARAMETER_COUNT; i++) {
        double worst = strcmp(PARAMETERS[i].unit, "m") ? WORST_DEG : WORST_M;
        if (f->uncertainty[i] > worst)
            return fail(
                err, ERROR_DATA,
                "the poses do not decide %s: it would be known to %.2g %s only; poses farther "
                "apart (now %.0f..%.0f degrees) or more places are needed",
                PARAMETERS[i].name, f->uncertainty[i], PARAMETERS[i].unit, sorted_tilts[0],
                sorted_tilts[1]);
    }
    return true;
}

static void name_residual(int index, char *name, size_t size)
{
    static const char *const ANGLES[] = {"the protractor", "the inclinometer", "lateral gravity"};
    if (index < 3)
        snprintf(name, size, "%s", ANGLES[index]);
    else
        snprintf(name, size, "%s %c", PLACES[(index - 3) / 3].name, "xyz"[(index - 3) % 3]);
}

struct worst {
    double most; // over its uncertainty
    int pose, index;
};

static struct worst worst_residual(const struct stand_problem *p, const struct stand_fit *f)
{
    struct worst w = {0, 0, 0};
    for (int i = 0; i < p->count; i++) {
        double r[RESIDUALS];
        weigh(&p->instruments, &f->residuals[i], r);
        for (int k = 0; k < RESIDUALS; k++)
            if (fabs(r[k]) > w.most)
                w = (struct worst){fabs(r[k]), i, k};
    }
    return w;
}

static bool blame(const struct stand_problem *p, const struct stand_fit *f, const struct worst *w,
                  struct error *err)
{
    const struct stand_instruments *u = &p->instruments;
    const double units[] = {u->protractor_deg, u->inclinometer_deg, u->lateral};
    char name[64];
    name_residual(w->index, name, sizeof name);
    return fail(err, ERROR_DATA,
                "pose %d (%.1f degrees): %s is off what the others say by %.3g%s, %.0f times its "
                "uncertainty",
                w->pose + 1, f->tilt_deg[w->pose], name,
                w->most * (w->index < 3 ? units[w->index] : 1000 * u->tape_m),
                w->index < 2   ? " degrees"
                : w->index > 2 ? " mm"
                               : "",
                w->most);
}

// One that stands out far from what is left without it is a blunder.
static bool agree(const struct stand_problem *p, const struct stand_fit *f, struct error *err)
{
    int freedom = f->readings - f->unknowns;
    struct worst w = worst_residual(p, f);
    double others = freedom > 1
                        ? sqrt(fmax(f->rms * f->rms * freedom - w.most * w.most, 0) / (freedom - 1))
                        : 0;
    if (w.most > BLUNDER * fmax(others, 1))
        return blame(p, f, &w, err);
    return f->rms <= BLUNDER ||
           fail(err, ERROR_DATA,
                "the readings are off any stand by %.0f times their uncertainties: are all places "
                "measured from the booth's origin, in metres?",
                f->rms);
}

static bool take_uncertainties(const struct setup *s, const struct least_squares *problem,
                               const double *x, struct stand_fit *f, struct error *err)
{
    size_t n = (size_t)problem->parameters;
    double *covariance = malloc(n * n * sizeof *covariance);
    bool fine = covariance ? least_squares_covariance(problem, x, covariance, err)
                           : fail(err, ERROR_SYSTEM, "out of memory");
    double scale = fmax(f->rms, 1);
    for (size_t i = 0, k = 0; fine && i < STAND_PARAMETER_COUNT; i++)
        if (s->fitted[i]) {
            f->uncertainty[i] = 2 * scale * sqrt(covariance[k * n + k]);
            k++;
        }
    free(covariance);
    return fine;
}

static void take_values(const struct setup *s, const double *x, double cost, struct stand_fit *f)
{
    const struct stand_problem *p = s->problem;
    int freedom = f->readings - f->unknowns;
    spread(s, x, f->value);
    memcpy(f->fitted, s->fitted, sizeof f->fitted);
    f->stand = stand_of(p, f->value);
    memcpy(f->turned_deg, &f->value[STAND_TURN_X], sizeof f->turned_deg);
    f->poses = p->count;
    f->rms = freedom > 0 ? sqrt(2 * cost / freedom) : 0;
    for (int i = 0; i < p->count; i++) {
        f->tilt_deg[i] = x[s->free + i];
        struct stand_pose_read found = predict(p, f->value, f->tilt_deg[i]);
        f->residuals[i] = difference(&p->poses[i], &found);
    }
}

static bool solve(struct setup *s, struct stand_fit *f, struct error *err)
{
    const struct stand_problem *p = s->problem;
    double x[UNKNOWNS_MOST], v[STAND_PARAMETER_COUNT], ends[2] = {INFINITY, -INFINITY};
    struct least_squares_result result;
    struct least_squares problem = {.parameters = s->free + p->count,
                                    .groups = p->count,
                                    .group_size = RESIDUALS,
                                    .evaluate = pose_residuals,
                                    .context = s,
                                    .numeric = true,
                                    .iterations = 200};
    given_parameters(p, v);
    for (int i = 0, k = 0; i < STAND_PARAMETER_COUNT; i++)
        if (s->fitted[i])
            x[k++] = v[i];
    for (int i = 0; i < p->count; i++) {
        x[s->free + i] = s->start[i];
        ends[0] = fmin(ends[0], s->start[i]);
        ends[1] = fmax(ends[1], s->start[i]);
    }
    f->unknowns = problem.parameters;
    if (!least_squares_solve(&problem, x, &result, err))
        return false;
    take_values(s, x, result.cost_after, f);
    return agree(p, f, err) && take_uncertainties(s, &problem, x, f, err) &&
           know_well(f, ends, err);
}

bool stand_fit(const struct stand_problem *problem, struct stand_fit *out, struct error *err)
{
    struct setup s = {.problem = problem};
    struct stand_fit f = {0};
    struct counts_read read = count_read(problem);
    if (!start_tilts(&s, err) || !check_angles(&s, err))
        return false;
    choose(&s, &read, f.warning, sizeof f.warning);
    f.readings = read.all;
    if (!s.free)
        return fail(err, ERROR_DATA, "nothing was read that stand or inclinometer follow from");
    if (f.readings < s.free + problem->count)
        return fail(err, ERROR_DATA,
                    "%d readings cannot decide %d unknowns: more places or angles "
                    "are needed",
                    f.readings, s.free + problem->count);
    if (!solve(&s, &f, err))
        return false;
    *out = f;
    return true;
}
