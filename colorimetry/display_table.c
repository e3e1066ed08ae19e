// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/display_table.h"

#include <math.h>
#include <stdlib.h>

#define real double
#define curve_handle const double *
#define curve_node(curve, index) ((curve)[index])
#include "colorimetry/display.glsl"

static const double MARGIN = 0.01; // of the cube root of linear light, around the gamut

enum { SIDE = DISPLAY_TABLE_SIDE, PROBES = 17 };

static double light_of(double root)
{
    return root * root * root;
}

// What plain Day needs for what the model emits, at the surface of its gamut and
// inside.
static void find_box(const struct display_model *model, struct display_table *t)
{
    double most[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int c = 0; c < 3; c++)
        t->least[c] = INFINITY;
    for (int k = 0; k < PROBES * PROBES * PROBES; k++) {
        const double step = 1.0 / (PROBES - 1);
        struct counts at = {k / PROBES / PROBES * step, k / PROBES % PROBES * step,
                            k % PROBES * step};
        struct counts day = display_day_invert(model, display_forward(model, at));
        const double root[3] = {cbrt(day.r), cbrt(day.g), cbrt(day.b)};
        for (int c = 0; c < 3; c++) {
            t->least[c] = fmin(t->least[c], root[c] - MARGIN);
            most[c] = fmax(most[c], root[c] + MARGIN);
        }
    }
    for (int c = 0; c < 3; c++)
        t->scale[c] = (SIDE - 1) / (most[c] - t->least[c]);
}

static double axis_light(const struct display_table *t, int axis, int node)
{
    return light_of(t->least[axis] + node / t->scale[axis]);
}

// Plain Day's colour of unclamped linear light.
static struct xyz emitted(const struct display_model *model, struct counts l)
{
    const double(*m)[4] = model->matrix;
    return (struct xyz){
        display_row(m[0][0], m[0][1], m[0][2], m[0][3], l.r, l.g, l.b),
        display_row(m[1][0], m[1][1], m[1][2], m[1][3], l.r, l.g, l.b),
        display_row(m[2][0], m[2][1], m[2][2], m[2][3], l.r, l.g, l.b),
    };
}

// One line of nodes along blue.
static void fill_line(const struct display_model *model, struct display_table *t, int i, int j)
{
    const struct counts day0 = {axis_light(t, 0, i), axis_light(t, 1, j), 0};
    for (int k = 0; k < SIDE; k++) {
        struct counts day = {day0.r, day0.g, axis_light(t, 2, k)};
        struct counts needed = display_invert(model, emitted(model, day)).linear;
        float *value = t->node[(i * SIDE + j) * SIDE + k][0];
        value[0] = (float)(needed.r - day.r);
        value[1] = (float)(needed.g - day.g);
        value[2] = (float)(needed.b - day.b);
    }
}

// Differences of second order, one-sided at the ends.
static void fill_slopes(struct display_table *t, int node, int axis)
{
    static const int stride[3] = {SIDE * SIDE, SIDE, 1};
    const int at = node / stride[axis] % SIDE, step = stride[axis];
    const int turn = at == 0 ? step : -step; // inwards from an end
    for (int c = 0; c < 3; c++) {
        double slope;
        if (at > 0 && at < SIDE - 1)
            slope = ((double)t->node[node + step][0][c] - t->node[node - step][0][c]) / 2;
        else
            slope = (-3.0 * t->node[node][0][c] + 4.0 * t->node[node + turn][0][c] -
                     t->node[node + 2 * turn][0][c]) /
                    (at == 0 ? 2 : -2);
        t->node[node][1 + axis][c] = (float)slope;
    }
}

struct display_table *display_table_create(const struct display_model *model, struct error *err)
{
    struct display_table *t = malloc(sizeof *t);
    if (!t) {
        fail(err, ERROR_SYSTEM, "no memory for a display table");
        return NULL;
    }
    find_box(model, t);
#pragma omp parallel for schedule(static)
    for (int line = 0; line < SIDE * SIDE; line++)
        fill_line(model, t, line / SIDE, line % SIDE);
    for (int node = 0; node < DISPLAY_TABLE_NODES; node++)
        for (int axis = 0; axis < 3; axis++)
            fill_slopes(t, node, axis);
    return t;
}

struct counts display_table_linear(const struct display_table *t, struct counts day)
{
    struct display_corners at =
        display_find(display_axis(day.r, t->least[0], t->scale[0], SIDE),
                     display_axis(day.g, t->least[1], t->scale[1], SIDE),
                     display_axis(day.b, t->least[2], t->scale[2], SIDE), SIDE);
    double sum[3] = {day.r, day.g, day.b};
    for (int n = 0; n < 4; n++) {
        const float(*v)[3] = t->node[at.node[n]];
        for (int c = 0; c < 3; c++)
            sum[c] += at.value[n] * v[0][c] + at.by_red[n] * v[1][c] + at.by_green[n] * v[2][c] +
                      at.by_blue[n] * v[3][c];
    }
    return (struct counts){sum[0], sum[1], sum[2]};
}
