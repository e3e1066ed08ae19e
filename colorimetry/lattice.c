// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/lattice.h"

enum { INTERVALS = LATTICE_SIDE - 3 };

static double part(struct vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static double spacing(const struct lattice *l, int axis)
{
    return (part(l->most, axis) - part(l->least, axis)) / INTERVALS;
}

// The four cubic B-splines of an interval at t in 0..1, and their slopes by t.
static void splines(double t, double weight[4], double slope[4])
{
    double s = 1 - t;
    weight[0] = s * s * s / 6;
    weight[1] = (t * t * (3 * t - 6) + 4) / 6;
    weight[2] = (s * s * (3 * s - 6) + 4) / 6;
    weight[3] = t * t * t / 6;
    slope[0] = -s * s / 2;
    slope[1] = t * (3 * t - 4) / 2;
    slope[2] = s * (4 - 3 * s) / 2;
    slope[3] = t * t / 2;
}

struct lattice_place lattice_find(const struct lattice *l, struct vec3 at)
{
    struct lattice_place place;
    for (int axis = 0; axis < 3; axis++) {
        double step = spacing(l, axis);
        double t = (part(at, axis) - part(l->least, axis)) / step;
        bool inside = t >= 0 && t <= INTERVALS;
        if (!inside)
            t = t > INTERVALS ? INTERVALS : 0;
        int first = t < INTERVALS ? (int)t : INTERVALS - 1;
        place.first[axis] = first;
        splines(t - first, place.weight[axis], place.slope[axis]);
        for (int i = 0; i < 4; i++)
            place.slope[axis][i] = inside ? place.slope[axis][i] / step : 0;
    }
    return place;
}

// Sum over the 64 coefficients with one weight table an axis.
static struct vec3 sum(const struct lattice *l, const int first[3], const double *x,
                       const double *y, const double *z)
{
    double v[3] = {0, 0, 0};
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            double xy = x[i] * y[j];
            const double(*line)[3] = l->node + lattice_node(first[0] + i, first[1] + j, first[2]);
            for (int k = 0; k < 4; k++)
                for (int n = 0; n < 3; n++)
                    v[n] += xy * z[k] * line[k][n];
        }
    return (struct vec3){v[0], v[1], v[2]};
}

struct vec3 lattice_at(const struct lattice *l, struct vec3 at, struct mat3 *slopes)
{
    struct lattice_place p = lattice_find(l, at);
    for (int axis = 0; slopes && axis < 3; axis++) {
        const double *w[3] = {p.weight[0], p.weight[1], p.weight[2]};
        w[axis] = p.slope[axis];
        struct vec3 s = sum(l, p.first, w[0], w[1], w[2]);
        slopes->m[0][axis] = s.x;
        slopes->m[1][axis] = s.y;
        slopes->m[2][axis] = s.z;
    }
    return sum(l, p.first, p.weight[0], p.weight[1], p.weight[2]);
}

double lattice_slope_most(const struct lattice *l)
{
    const int places = 4 * INTERVALS + 1;
    const struct vec3 size = vec3_sub(l->most, l->least);
    double most = 0;
    for (int k = 0; k < places * places * places; k++) {
        const double x = (double)(k / places / places) / (places - 1),
                     y = (double)(k / places % places) / (places - 1),
                     z = (double)(k % places) / (places - 1);
        struct vec3 at = {l->least.x + x * size.x, l->least.y + y * size.y,
                          l->least.z + z * size.z};
        struct mat3 by;
        lattice_at(l, at, &by);
        for (int n = 0; n < 3; n++) {
            double sum = fabs(by.m[n][0]) + fabs(by.m[n][1]) + fabs(by.m[n][2]);
            if (!isfinite(sum))
                return INFINITY;
            most = fmax(most, sum);
        }
    }
    return most;
}

double lattice_abscissa(const struct lattice *l, int axis, int i)
{
    return part(l->least, axis) + (i - 1) * spacing(l, axis);
}
