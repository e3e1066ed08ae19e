// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/display.h"

#include <math.h>

static const double CONDITION_MOST = 50;
static const double SLOPE_LEAST = 1e-6;
static const double BELOW_ZERO_MOST = 0.05; // part of a primary's Y: noise of the fit

#define real double
#define curve_handle const double *
#define curve_node(curve, index) ((curve)[index])
#include "colorimetry/display.glsl"

_Static_assert(DISPLAY_NODES == DISPLAY_LAST + 1,
               "display.glsl and display.h count the same nodes");

static const char *const channel_names[3] = {"red", "green", "blue"};

static bool curve_check(const double *curve, const char *name, struct error *err)
{
    if (curve[0] != 0 || curve[DISPLAY_LAST] != 1)
        return fail(err, ERROR_DATA, "%s curve runs from %g to %g, not from 0 to 1", name, curve[0],
                    curve[DISPLAY_LAST]);
    for (int k = 1; k < DISPLAY_NODES; k++)
        if (!(curve[k] > curve[k - 1])) // also when it is not a number
            return fail(err, ERROR_DATA, "%s curve does not rise at node %d: %g after %g", name, k,
                        curve[k], curve[k - 1]);
    return true;
}

static bool matrix_check(const struct display_model *model, struct mat3 *left, struct error *err)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            if (!isfinite(model->matrix[i][j]))
                return fail(err, ERROR_DATA, "matrix row %d column %d is not finite", i + 1, j + 1);
            if (j < 3)
                left->m[i][j] = model->matrix[i][j];
        }
    return true;
}

static bool primaries_check(const struct display_model *model, struct error *err)
{
    for (int c = 0; c < 3; c++) {
        double X = model->matrix[0][c], Y = model->matrix[1][c], Z = model->matrix[2][c];
        if (!(Y > 0 && fmin(X, Z) >= -BELOW_ZERO_MOST * Y))
            return fail(err, ERROR_DATA,
                        "matrix column %d: %s is %g %g %g cd/m2; allowed: Y above 0, X and Z not "
                        "below -5 %% of it",
                        c + 1, channel_names[c], X, Y, Z);
    }
    return true;
}

bool display_model_prepare(struct display_model *model, struct error *err)
{
    struct mat3 left, inverse;
    for (int c = 0; c < 3; c++)
        if (!curve_check(model->curve[c], channel_names[c], err))
            return false;
    if (!matrix_check(model, &left, err) || !primaries_check(model, err))
        return false;
    double condition = mat3_condition(left);
    if (!(condition <= CONDITION_MOST) || !mat3_invert(left, &inverse))
        return fail(err, ERROR_DATA,
                    "primaries too much alike to invert: condition number %.4g, at most %g",
                    condition, CONDITION_MOST);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            model->inverse[i][j] = inverse.m[i][j];
    model->condition = condition;
    return true;
}

struct pool {
    double sum;
    int count;
};

// Pool adjacent violators (Ayer et al. 1955) over values 1..DISPLAY_LAST - 1.
static int pool_violators(double *curve)
{
    struct pool pools[DISPLAY_NODES];
    int top = -1;
    int pooled = 0;
    for (int k = 1; k < DISPLAY_LAST; k++) {
        pools[++top] = (struct pool){display_clamped(curve[k]), 1};
        while (top > 0 &&
               pools[top - 1].sum * pools[top].count > pools[top].sum * pools[top - 1].count) {
            pools[top - 1].sum += pools[top].sum;
            pools[top - 1].count += pools[top].count;
            top--;
        }
    }
    for (int i = 0, k = 1; i <= top; i++) {
        pooled += pools[i].count > 1 ? pools[i].count : 0;
        for (int n = 0; n < pools[i].count; n++)
            curve[k++] = pools[i].sum / pools[i].count;
    }
    return pooled;
}

int display_curve_repair(double curve[DISPLAY_NODES])
{
    int pooled = pool_violators(curve);
    curve[0] = 0;
    curve[DISPLAY_LAST] = 1;
    for (int k = 1; k < DISPLAY_LAST; k++)
        curve[k] = fmax(curve[k], curve[k - 1] + SLOPE_LEAST);
    for (int k = DISPLAY_LAST - 1; k > 0; k--)
        curve[k] = fmin(curve[k], curve[k + 1] - SLOPE_LEAST);
    return pooled;
}

struct xyz display_forward(const struct display_model *model, struct counts counts)
{
    const double(*m)[4] = model->matrix;
    double r = display_light(model->curve[0], counts.r);
    double g = display_light(model->curve[1], counts.g);
    double b = display_light(model->curve[2], counts.b);
    return (struct xyz){
        display_row(m[0][0], m[0][1], m[0][2], m[0][3], r, g, b),
        display_row(m[1][0], m[1][1], m[1][2], m[1][3], r, g, b),
        display_row(m[2][0], m[2][1], m[2][2], m[2][3], r, g, b),
    };
}

struct display_inverse display_invert(const struct display_model *model, struct xyz target)
{
    const double(*m)[3] = model->inverse;
    double X = target.X - model->matrix[0][3];
    double Y = target.Y - model->matrix[1][3];
    double Z = target.Z - model->matrix[2][3];
    struct counts linear = {
        display_inverse_row(m[0][0], m[0][1], m[0][2], X, Y, Z),
        display_inverse_row(m[1][0], m[1][1], m[1][2], X, Y, Z),
        display_inverse_row(m[2][0], m[2][1], m[2][2], X, Y, Z),
    };
    return (struct display_inverse){
        .counts = {display_count(model->curve[0], linear.r),
                   display_count(model->curve[1], linear.g),
                   display_count(model->curve[2], linear.b)},
        .linear = linear,
        .in_gamut = !display_outside(linear.r, DISPLAY_GAMUT_TOLERANCE) &&
                    !display_outside(linear.g, DISPLAY_GAMUT_TOLERANCE) &&
                    !display_outside(linear.b, DISPLAY_GAMUT_TOLERANCE),
    };
}

struct xyz display_black(const struct display_model *model)
{
    return (struct xyz){model->matrix[0][3], model->matrix[1][3], model->matrix[2][3]};
}
