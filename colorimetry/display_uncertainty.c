// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/display_uncertainty.h"

#include <math.h>

#include "colorimetry/metric.h"

static const double SAME_COUNTS = 1e-6;

double uncertainty_neutral(struct lab at)
{
    return exp(-hypot(at.a, at.b) / 20);
}

// What a prediction's error takes from the model.
struct colour {
    struct xyz xyz;
    struct lab lab;
    struct mat3 scale; // one CIEDE2000 unit in CIELAB
    double mode[UNCERTAINTY_MODES][3];
};

static struct mat3 inverted(struct mat3 a)
{
    struct mat3 inverse = mat3_identity();
    mat3_invert(a, &inverse);
    return inverse;
}

// Trilinear weights of the eight places around counts.
static void places_of(struct counts counts, int place[8], double weight[8])
{
    const double v[3] = {counts.r, counts.g, counts.b};
    int first[3];
    double t[3];
    for (int c = 0; c < 3; c++) {
        double at = fmin(fmax(v[c], 0), 1) * (UNCERTAINTY_SIDE - 1);
        first[c] = at < UNCERTAINTY_SIDE - 2 ? (int)at : UNCERTAINTY_SIDE - 2;
        t[c] = at - first[c];
    }
    for (int k = 0; k < 8; k++) {
        const int up[3] = {k >> 2, k >> 1 & 1, k & 1};
        place[k] = ((first[0] + up[0]) * UNCERTAINTY_SIDE + first[1] + up[1]) * UNCERTAINTY_SIDE +
                   first[2] + up[2];
        weight[k] = 1;
        for (int c = 0; c < 3; c++)
            weight[k] *= up[c] ? t[c] : 1 - t[c];
    }
}

static struct colour look_at(const struct display_uncertainty *u, const struct display_model *model,
                             struct counts counts)
{
    struct colour c = {.xyz = display_forward(model, counts)};
    int place[8];
    double weight[8];
    lab_of(c.xyz, model->white, &c.lab, NULL); // prepare saw to white
    c.scale = inverted(de00_metric(c.lab));
    places_of(counts, place, weight);
    for (int m = 0; m < u->modes; m++)
        for (int k = 0; k < 8; k++)
            for (int n = 0; n < 3; n++)
                c.mode[m][n] += weight[k] * u->mode[m][place[k]][n];
    return c;
}

static bool same(struct counts a, struct counts b)
{
    return fmax(fabs(a.r - b.r), fmax(fabs(a.g - b.g), fabs(a.b - b.b))) < SAME_COUNTS;
}

// Covariance of two colours' errors in CIELAB.
static struct mat3 block(const struct display_uncertainty *u, const struct colour *a,
                         const struct colour *b, bool one)
{
    double shared = u->smooth_de00 * u->smooth_de00 *
                    (u->length_lab > 0 ? exp(-delta_e_ab(a->lab, b->lab) / u->length_lab) : one);
    if (one)
        shared += u->local_de00 * u->local_de00 +
                  u->neutral_de00 * u->neutral_de00 * uncertainty_neutral(a->lab);
    struct mat3 out = mat3_mul(a->scale, mat3_transpose(b->scale));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            out.m[i][j] *= shared;
            for (int m = 0; m < u->modes; m++)
                out.m[i][j] += a->mode[m][i] * b->mode[m][j];
        }
    return out;
}

static void fill(const struct display_uncertainty *u, const struct display_model *model,
                 const struct counts *counts, int n, bool as_xyz, double *covariance)
{
    for (int i = 0; i < n; i++) {
        struct colour a = look_at(u, model, counts[i]);
        for (int j = 0; j <= i; j++) {
            struct colour b = look_at(u, model, counts[j]);
            struct mat3 c = block(u, &a, &b, same(counts[i], counts[j]));
            if (as_xyz)
                c = mat3_mul(mat3_mul(inverted(lab_slopes(a.xyz, model->white)), c),
                             mat3_transpose(inverted(lab_slopes(b.xyz, model->white))));
            for (int k = 0; k < 9; k++) {
                int row = 3 * i + k / 3, column = 3 * j + k % 3;
                covariance[row * 3 * n + column] = covariance[column * 3 * n + row] =
                    c.m[k / 3][k % 3];
            }
        }
    }
}

void display_uncertainty_lab(const struct display_uncertainty *u, const struct display_model *model,
                             const struct counts *counts, int n, double *covariance)
{
    fill(u, model, counts, n, false, covariance);
}

void display_uncertainty_xyz(const struct display_uncertainty *u, const struct display_model *model,
                             const struct counts *counts, int n, double *covariance)
{
    fill(u, model, counts, n, true, covariance);
}

double display_uncertainty_de00(const struct display_uncertainty *u,
                                const struct display_model *model, struct counts counts)
{
    struct colour at = look_at(u, model, counts);
    struct mat3 metric = de00_metric(at.lab);
    struct mat3 c = mat3_mul(mat3_mul(metric, block(u, &at, &at, true)), mat3_transpose(metric));
    return sqrt(c.m[0][0] + c.m[1][1] + c.m[2][2]);
}
