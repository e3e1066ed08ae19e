// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/display.h"

#include <math.h>

static const double CONDITION_MOST = 50;
static const double SLOPE_LEAST = 1e-6;
static const double BELOW_ZERO_MOST = 0.05; // part of a primary's Y: noise of the fit
static const double SETTLED = 1e-13;        // of an inversion, per unit of what is inverted
enum { STEPS_MOST = 300 }; // DISPLAY_FOLD_MOST ^ 300 < SETTLED, should Newton never help

#define real double
#define curve_handle const double *
#define curve_node(curve, index) ((curve)[index])
#include "colorimetry/display.glsl"

_Static_assert(DISPLAY_NODES == DISPLAY_LAST + 1,
               "display.glsl and display.h count the same nodes");

static const char *const channel_names[3] = {"red", "green", "blue"};

const char *const display_kind_names[] = {
#define X(name, text) text,
    DISPLAY_KINDS(X)
#undef X
        NULL,
};

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

void display_terms(struct counts linear, double terms[DISPLAY_TERMS],
                   double slopes[DISPLAY_TERMS][3])
{
    const double raw[3] = {linear.r, linear.g, linear.b};
    const double l[3] = {display_clamped(linear.r), display_clamped(linear.g),
                         display_clamped(linear.b)};
    for (int c = 0; c < 3; c++) {
        int next = (c + 1) % 3, other = 3 - c - next;
        terms[c] = display_share(l[c], l[next]);
        terms[3 + c] = display_bend(l[c]);
        if (!slopes)
            continue;
        slopes[c][c] = display_inside(raw[c], display_share_slope(l[c], l[next]));
        slopes[c][next] = display_inside(raw[next], display_share_slope(l[next], l[c]));
        slopes[3 + c][c] = display_inside(raw[c], 1 - 2 * l[c]);
        slopes[c][other] = slopes[3 + c][next] = slopes[3 + c][other] = 0;
    }
}

// The slopes of a shared term sum to at most 2, those of r (1 - r) to 1.
static double crosstalk_most(const struct display_model *model)
{
    double most = 0;
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int t = 0; t < DISPLAY_TERMS; t++)
            sum += (t < 3 ? 2 : 1) * fabs(model->crosstalk[c][t]);
        if (!isfinite(sum))
            return INFINITY;
        most = fmax(most, sum);
    }
    return most;
}

double display_fold(const struct display_model *model)
{
    switch (model->kind) {
    case DISPLAY_DAY:
        break;
    case DISPLAY_INTERACTION:
        return crosstalk_most(model);
    case DISPLAY_RESIDUAL:
        return lattice_slope_most(&model->residual);
    }
    return 0;
}

static bool residual_check(const struct display_model *model, struct error *err)
{
    const struct lattice *r = &model->residual;
    for (int k = 0; k < LATTICE_NODES; k++)
        if (!isfinite(r->node[k][0] + r->node[k][1] + r->node[k][2]))
            return fail(err, ERROR_DATA, "residual: coefficient %d is not finite", k);
    struct vec3 size = vec3_sub(r->most, r->least);
    return (size.x > 0 && size.y > 0 && size.z > 0 && isfinite(size.x + size.y + size.z)) ||
           fail(err, ERROR_DATA, "residual: its box has no volume: %g x %g x %g", size.x, size.y,
                size.z);
}

// Checks what the kind adds and fills what belongs to it.
static bool addition_prepare(struct display_model *model, struct error *err)
{
    for (int i = 0; i < 3; i++)
        for (int t = 0; t < DISPLAY_TERMS; t++) {
            model->crosstalk[i][t] = 0;
            for (int j = 0; j < 3; j++)
                model->crosstalk[i][t] += model->inverse[i][j] * model->interaction[j][t];
        }
    const double(*m)[4] = model->matrix;
    model->white = (struct xyz){
        display_row(m[0][0], m[0][1], m[0][2], m[0][3], 1, 1, 1),
        display_row(m[1][0], m[1][1], m[1][2], m[1][3], 1, 1, 1),
        display_row(m[2][0], m[2][1], m[2][2], m[2][3], 1, 1, 1),
    };
    if (model->kind == DISPLAY_RESIDUAL && !residual_check(model, err))
        return false;
    if (!(fmin(model->white.X, fmin(model->white.Y, model->white.Z)) > 0))
        return fail(err, ERROR_DATA, "matrix: white is %g %g %g cd/m2; allowed: above 0",
                    model->white.X, model->white.Y, model->white.Z);
    double fold = display_fold(model);
    return fold < DISPLAY_FOLD_MOST ||
           fail(err, ERROR_DATA,
                "%s: two inputs may give one colour: what it adds changes by up to %.3g of what it "
                "is added to, at most %g",
                display_kind_names[model->kind], fold, DISPLAY_FOLD_MOST);
}

bool display_model_prepare(struct display_model *model, struct error *err)
{
    struct mat3 left, inverse;
    if (!((unsigned)model->kind <= DISPLAY_RESIDUAL))
        return fail(err, ERROR_DATA, "no kind of display model has number %d", (int)model->kind);
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
    return addition_prepare(model, err);
}

void display_model_scale(struct display_model *model, double k)
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++)
            model->matrix[i][j] *= k;
        for (int j = 0; j < 3; j++)
            model->inverse[i][j] /= k;
        for (int t = 0; t < DISPLAY_TERMS; t++)
            model->interaction[i][t] *= k;
    }
    model->white = (struct xyz){k * model->white.X, k * model->white.Y, k * model->white.Z};
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

// ---- what a model adds to plain Day, as x + addition(x) ---------------------

// Interaction: linear light to linear light.
static struct vec3 crosstalk_at(const struct display_model *model, struct vec3 l,
                                struct mat3 *slopes)
{
    double terms[DISPLAY_TERMS], by[DISPLAY_TERMS][3];
    double sum[3] = {0, 0, 0};
    *slopes = (struct mat3){{{0}}};
    display_terms((struct counts){l.x, l.y, l.z}, terms, by);
    for (int i = 0; i < 3; i++)
        for (int t = 0; t < DISPLAY_TERMS; t++) {
            sum[i] += model->crosstalk[i][t] * terms[t];
            for (int c = 0; c < 3; c++)
                slopes->m[i][c] += model->crosstalk[i][t] * by[t][c];
        }
    return (struct vec3){sum[0], sum[1], sum[2]};
}

// Residual: CIELAB to CIELAB.
static struct vec3 shift_at(const struct display_model *model, struct vec3 lab, struct mat3 *slopes)
{
    return lattice_at(&model->residual, lab, slopes);
}

typedef struct vec3 addition(const struct display_model *model, struct vec3 x, struct mat3 *slopes);

static double largest(struct vec3 v)
{
    return fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
}

// The x with x + addition(x) = wanted. A step of Newton's is kept when it comes
// nearer; else the plain step x = wanted - addition(x), which always does.
static struct vec3 take_off(const struct display_model *model, addition *add, struct vec3 wanted)
{
    struct mat3 slopes, next_slopes, inverse;
    struct vec3 x = wanted;
    struct vec3 off = vec3_scale(add(model, x, &slopes), -1); // wanted - x - addition(x)
    double enough = SETTLED * (1 + largest(wanted));
    for (int step = 0; step < STEPS_MOST && largest(off) > enough; step++) {
        struct mat3 whole = slopes;
        for (int i = 0; i < 3; i++)
            whole.m[i][i] += 1;
        struct vec3 newton = mat3_invert(whole, &inverse) ? mat3_apply(inverse, off) : off;
        struct vec3 next = vec3_add(x, newton);
        struct vec3 left = vec3_sub(vec3_sub(wanted, next), add(model, next, &next_slopes));
        if (!(largest(left) < largest(off) / 2)) {
            next = vec3_add(x, off);
            left = vec3_sub(vec3_sub(wanted, next), add(model, next, &next_slopes));
        }
        x = next;
        off = left;
        slopes = next_slopes;
    }
    return x;
}

// ---- both ways -------------------------------------------------------------

static struct vec3 lab_vector(struct xyz c, struct xyz white)
{
    struct lab lab = {0, 0, 0};
    lab_of(c, white, &lab, NULL); // prepare saw to white
    return (struct vec3){lab.L, lab.a, lab.b};
}

static struct xyz vector_xyz(struct vec3 lab, struct xyz white)
{
    return xyz_of_lab((struct lab){lab.x, lab.y, lab.z}, white);
}

static struct xyz day_forward(const struct display_model *model, struct counts l)
{
    const double(*m)[4] = model->matrix;
    return (struct xyz){
        display_row(m[0][0], m[0][1], m[0][2], m[0][3], l.r, l.g, l.b),
        display_row(m[1][0], m[1][1], m[1][2], m[1][3], l.r, l.g, l.b),
        display_row(m[2][0], m[2][1], m[2][2], m[2][3], l.r, l.g, l.b),
    };
}

static struct xyz add_interaction(const struct display_model *model, struct counts l,
                                  struct xyz day)
{
    double terms[DISPLAY_TERMS];
    display_terms(l, terms, NULL);
    for (int t = 0; t < DISPLAY_TERMS; t++) {
        day.X += model->interaction[0][t] * terms[t];
        day.Y += model->interaction[1][t] * terms[t];
        day.Z += model->interaction[2][t] * terms[t];
    }
    return day;
}

struct xyz display_forward(const struct display_model *model, struct counts counts)
{
    struct counts l = {display_light(model->curve[0], counts.r),
                       display_light(model->curve[1], counts.g),
                       display_light(model->curve[2], counts.b)};
    struct xyz day = day_forward(model, l);
    switch (model->kind) {
    case DISPLAY_DAY:
        break;
    case DISPLAY_INTERACTION:
        return add_interaction(model, l, day);
    case DISPLAY_RESIDUAL: {
        struct vec3 lab = lab_vector(day, model->white);
        return vector_xyz(vec3_add(lab, lattice_at(&model->residual, lab, NULL)), model->white);
    }
    }
    return day;
}

struct counts display_day_invert(const struct display_model *model, struct xyz target)
{
    const double(*m)[3] = model->inverse;
    double X = target.X - model->matrix[0][3];
    double Y = target.Y - model->matrix[1][3];
    double Z = target.Z - model->matrix[2][3];
    return (struct counts){
        display_inverse_row(m[0][0], m[0][1], m[0][2], X, Y, Z),
        display_inverse_row(m[1][0], m[1][1], m[1][2], X, Y, Z),
        display_inverse_row(m[2][0], m[2][1], m[2][2], X, Y, Z),
    };
}

static struct counts linear_of(const struct display_model *model, struct xyz target)
{
    switch (model->kind) {
    case DISPLAY_DAY:
        break;
    case DISPLAY_INTERACTION: {
        struct counts l = display_day_invert(model, target);
        struct vec3 v = take_off(model, crosstalk_at, (struct vec3){l.r, l.g, l.b});
        return (struct counts){v.x, v.y, v.z};
    }
    case DISPLAY_RESIDUAL: {
        struct vec3 lab = take_off(model, shift_at, lab_vector(target, model->white));
        return display_day_invert(model, vector_xyz(lab, model->white));
    }
    }
    return display_day_invert(model, target);
}

struct display_inverse display_invert(const struct display_model *model, struct xyz target)
{
    struct counts linear = linear_of(model, target);
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
    return display_forward(model, (struct counts){0, 0, 0});
}
