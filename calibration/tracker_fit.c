// SPDX-License-Identifier: Apache-2.0
#include "calibration/tracker_fit.h"

#include <stdio.h>
#include <string.h>

#include "calibration/fit_ceres.h"
#include "config/booth.h"

enum { POINTS_LEAST = 3, N = TRACKER_PARAMETER_COUNT };

static const double APART_M = 0.15, OFF_LINE_M = 0.05; // of the points held, at least
static const double WORST_M = 0.02;                    // of where it places an eye
static const double BLUNDER = 5;                       // uncertainties
static const double STRETCH = 0.05; // a field of view that is wrong by so much is worth a word

static const struct {
    const char *name, *unit;
} PARAMETERS[] = {
#define X(name, text, unit) {text, unit},
    TRACKER_PARAMETERS(X)
#undef X
};

const char *tracker_parameter_name(enum tracker_parameter parameter)
{
    return PARAMETERS[parameter].name;
}

const char *tracker_parameter_unit(enum tracker_parameter parameter)
{
    return PARAMETERS[parameter].unit;
}

// ---- the model --------------------------------------------------------------

static struct rigid transform(const double *x)
{
    struct booth_settings booth;
    memcpy(booth.tracker.place_m, x, sizeof booth.tracker.place_m);
    booth.tracker.pitch_deg = x[TRACKER_PITCH];
    booth.tracker.yaw_deg = x[TRACKER_YAW];
    booth.tracker.roll_deg = x[TRACKER_ROLL];
    return booth_from_tracker(&booth);
}

static bool point_residuals(void *context, int point, const double *x, double *residuals,
                            double *jacobian)
{
    const struct tracker_problem *p = context;
    struct vec3 found = rigid_apply(transform(x), p->points[point].seen);
    struct vec3 off = vec3_scale(vec3_sub(p->points[point].held, found), 1 / p->point_m);
    (void)jacobian;
    memcpy(residuals, (double[]){off.x, off.y, off.z}, 3 * sizeof *residuals);
    return true;
}

static void means(const struct tracker_problem *p, struct vec3 *held, struct vec3 *seen)
{
    *held = *seen = (struct vec3){0, 0, 0};
    for (int i = 0; i < p->count; i++) {
        *held = vec3_add(*held, vec3_scale(p->points[i].held, 1.0 / p->count));
        *seen = vec3_add(*seen, vec3_scale(p->points[i].seen, 1.0 / p->count));
    }
}

// ---- what the points can decide ------------------------------------------------

static double farthest_apart(const struct tracker_problem *p, struct vec3 *a, struct vec3 *b)
{
    double most = 0;
    for (int i = 0; i < p->count; i++)
        for (int k = 0; k < i; k++) {
            double d = vec3_length(vec3_sub(p->points[i].held, p->points[k].held));
            if (d >= most) {
                most = d;
                *a = p->points[i].held;
                *b = p->points[k].held;
            }
        }
    return most;
}

static bool check_places(const struct tracker_problem *p, struct error *err)
{
    struct vec3 a = {0, 0, 0}, b = a;
    double off = 0;
    if (p->count < POINTS_LEAST)
        return fail(err, ERROR_DATA, "%d point(s): at least %d are needed", p->count, POINTS_LEAST);
    double apart = farthest_apart(p, &a, &b);
    if (apart < APART_M)
        return fail(err, ERROR_DATA,
                    "the places are too close together: all within %.0f mm; %.0f mm are needed",
                    1000 * apart, 1000 * APART_M);
    struct vec3 along = vec3_unit(vec3_sub(b, a));
    for (int i = 0; i < p->count; i++)
        off = fmax(off, vec3_length(vec3_cross(along, vec3_sub(p->points[i].held, a))));
    return off >= OFF_LINE_M ||
           fail(err, ERROR_DATA,
                "the places are collinear: all within %.0f mm of one line; one must be %.0f mm off "
                "it, else the tracker may turn about it",
                1000 * off, 1000 * OFF_LINE_M);
}

// ---- what was found -------------------------------------------------------------

static double stretch_of(const struct tracker_problem *p)
{
    struct vec3 held, seen;
    double as_held = 0, as_seen = 0;
    means(p, &held, &seen);
    for (int i = 0; i < p->count; i++) {
        struct vec3 h = vec3_sub(p->points[i].held, held), s = vec3_sub(p->points[i].seen, seen);
        as_held += vec3_dot(h, h);
        as_seen += vec3_dot(s, s);
    }
    return sqrt(as_seen / as_held);
}

static bool agree(const struct tracker_problem *p, const struct tracker_fit *f, struct error *err)
{
    int worst = 0, freedom = 3 * p->count - N;
    double most = 0, squares = 0;
    for (int i = 0; i < p->count; i++) {
        double off = vec3_length(f->residuals[i]);
        squares += off * off;
        if (off > most) {
            most = off;
            worst = i;
        }
    }
    double others = freedom > 3 ? sqrt((squares - most * most) / (freedom - 3)) : 0;
    if (most > BLUNDER * fmax(others, p->point_m))
        return fail(err, ERROR_DATA, "point %d is off what the others say by %.0f mm", worst + 1,
                    1000 * most);
    return f->rms_m <= BLUNDER * p->point_m ||
           fail(err, ERROR_DATA,
                "the points are off any place of the tracker by %.0f mm; distances as it sees them "
                "are %.2f times those as held",
                1000 * f->rms_m, f->stretch);
}

// Variance along each axis of where a point lies, from the covariance of x.
static struct vec3 variance_at(const double *x, const double *covariance, struct vec3 seen)
{
    static const double STEP = 1e-4;
    double slope[3][N], sum[3] = {0};
    for (int i = 0; i < N; i++) {
        double at[N];
        memcpy(at, x, sizeof at);
        at[i] += STEP;
        struct vec3 high = rigid_apply(transform(at), seen);
        at[i] -= 2 * STEP;
        struct vec3 d = vec3_scale(vec3_sub(high, rigid_apply(transform(at), seen)), 0.5 / STEP);
        slope[0][i] = d.x;
        slope[1][i] = d.y;
        slope[2][i] = d.z;
    }
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < N; i++)
            for (int k = 0; k < N; k++)
                sum[axis] += slope[axis][i] * covariance[i * N + k] * slope[axis][k];
    return (struct vec3){sum[0], sum[1], sum[2]};
}

static bool take_uncertainties(const struct tracker_problem *p, const double *covariance,
                               struct tracker_fit *f, struct error *err)
{
    double k = 2 * fmax(f->rms_m / p->point_m, 1);
    for (int i = 0; i < N; i++)
        f->uncertainty[i] = k * sqrt(covariance[i * N + i]);
    for (int i = 0; i < p->count; i++) {
        struct vec3 v = variance_at(f->value, covariance, p->points[i].seen);
        f->eye_m = fmax(f->eye_m, k * sqrt(fmax(v.x, fmax(v.y, v.z))));
    }
    return f->eye_m <= WORST_M ||
           fail(err, ERROR_DATA,
                "the points do not decide where the tracker is: an eye among them would be placed "
                "to %.0f mm only; points farther apart, or more of them, are needed",
                1000 * f->eye_m);
}

// The same rotation with its pitch in -90..90 and all angles in -180..180.
static void tidy_angles(double *x)
{
    double *pitch = &x[TRACKER_PITCH], *yaw = &x[TRACKER_YAW], *roll = &x[TRACKER_ROLL];
    *pitch = remainder(*pitch, 360);
    if (fabs(*pitch) > 90) {
        *pitch = copysign(180, *pitch) - *pitch;
        *yaw += 180;
        *roll += 180;
    }
    *yaw = remainder(*yaw, 360);
    *roll = remainder(*roll, 360);
}

// From every quarter that a camera may look to, since a bad start ends at a bad place.
static bool search(const struct least_squares *problem, const struct tracker_problem *p, double *x,
                   struct error *err)
{
    struct vec3 held, seen;
    double least = INFINITY;
    means(p, &held, &seen);
    for (int quarter = 0; quarter < 16; quarter++) {
        struct least_squares_result result;
        double at[N] = {0, 0, 0, 0, quarter % 4 * 90 - 90, quarter / 4 * 90 - 90};
        struct vec3 place = vec3_sub(held, rigid_apply(transform(at), seen));
        memcpy(at, (double[]){place.x, place.y, place.z}, 3 * sizeof *at);
        if (!least_squares_solve(problem, at, &result, err) || result.cost_after >= least)
            continue;
        least = result.cost_after;
        memcpy(x, at, sizeof at);
    }
    return isfinite(least);
}

static void take_values(const struct tracker_problem *p, const double *x, struct tracker_fit *f)
{
    double squares = 0;
    int freedom = 3 * p->count - N;
    memcpy(f->value, x, sizeof f->value);
    f->booth_from_tracker = transform(x);
    f->points = p->count;
    f->stretch = stretch_of(p);
    for (int i = 0; i < p->count; i++) {
        struct vec3 found = rigid_apply(f->booth_from_tracker, p->points[i].seen);
        f->residuals[i] = vec3_sub(p->points[i].held, found);
        squares += vec3_dot(f->residuals[i], f->residuals[i]);
    }
    f->rms_m = sqrt(squares / freedom);
    if (fabs(f->stretch - 1) > STRETCH)
        snprintf(f->warning, sizeof f->warning,
                 "distances as the tracker sees them are %.2f times those as held: is its field of "
                 "view, or the size of its marker, right?",
                 f->stretch);
}

bool tracker_fit(const struct tracker_problem *problem, struct tracker_fit *out, struct error *err)
{
    struct tracker_fit f = {.points = 0};
    double x[N] = {0}, covariance[N * N];
    struct least_squares squares = {.parameters = N,
                                    .groups = problem->count,
                                    .group_size = 3,
                                    .evaluate = point_residuals,
                                    .context = (void *)problem,
                                    .numeric = true,
                                    .iterations = 200};
    if (!check_places(problem, err) || !search(&squares, problem, x, err))
        return false;
    tidy_angles(x);
    take_values(problem, x, &f);
    if (!agree(problem, &f, err) || !least_squares_covariance(&squares, x, covariance, err))
        return false;
    if (!take_uncertainties(problem, covariance, &f, err))
        return false;
    *out = f;
    return true;
}
