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

// A value and its slopes by x, y, z, each for all three.
struct sums {
    double value[3], by_x[3], by_y[3], by_z[3];
};

// Adds what a line of four coefficients along z makes.
static void add_line(const double (*line)[3], const struct lattice_place *p, int i, int j,
                     struct sums *s)
{
    const double xy = p->weight[0][i] * p->weight[1][j], dx = p->slope[0][i] * p->weight[1][j],
                 dy = p->weight[0][i] * p->slope[1][j];
    for (int n = 0; n < 3; n++) {
        double along = 0, across = 0;
        for (int k = 0; k < 4; k++) {
            along += p->weight[2][k] * line[k][n];
            across += p->slope[2][k] * line[k][n];
        }
        s->value[n] += xy * along;
        s->by_x[n] += dx * along;
        s->by_y[n] += dy * along;
        s->by_z[n] += xy * across;
    }
}

struct vec3 lattice_at(const struct lattice *l, struct vec3 at, struct mat3 *slopes)
{
    struct lattice_place p = lattice_find(l, at);
    struct sums s = {.value = {0}};
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            add_line(l->node + lattice_node(p.first[0] + i, p.first[1] + j, p.first[2]), &p, i, j,
                     &s);
    for (int n = 0; slopes && n < 3; n++) {
        slopes->m[n][0] = s.by_x[n];
        slopes->m[n][1] = s.by_y[n];
        slopes->m[n][2] = s.by_z[n];
    }
    return (struct vec3){s.value[0], s.value[1], s.value[2]};
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
