// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/bands_fit.h"

#include <math.h>
#include <string.h>

#include "colorimetry/illuminant.h"
#include "colorimetry/metric.h"
#include "colorimetry/tables/bands.h"

enum { UNKNOWNS_MOST = 3 * BANDS_MOST };

// Part of the mean diagonal that is added to it: decides what the training
// leaves open, far below what it says.
static const double RIDGE = 1e-7;

// Standard deviation of a coefficient: half floats near 1 round by 1.4e-4, a
// camera or an instrument does worse.
static const double COEFFICIENT_NOISE = 5e-4;

struct normal {
    int n;
    double a[UNKNOWNS_MOST][UNKNOWNS_MOST], b[UNKNOWNS_MOST];
};

void band_training_shipped(struct band_training *out)
{
    double nm[BASIS_SAMPLES];
    for (int i = 0; i < BASIS_SAMPLES; i++)
        nm[i] = BASIS_FIRST_NM + i * BASIS_STEP_NM;
    for (int v = 0; v < BASIS_VECTORS; v++)
        spectrum_from_samples(nm, REFLECTANCE_BASIS[v], BASIS_SAMPLES, true, &out->basis[v], NULL);
    memcpy(out->coefficients, REFLECTANCE_ROWS, sizeof out->coefficients);
    memcpy(out->weights, REFLECTANCE_WEIGHTS, sizeof out->weights);
}

// Upper triangular U with U'U = g.
static struct mat3 root(struct mat3 g)
{
    struct mat3 u = {{{0}}};
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            double rest = g.m[i][j];
            for (int k = 0; k < i; k++)
                rest -= u.m[k][i] * u.m[k][j];
            u.m[i][j] = i == j ? sqrt(fmax(rest, 0)) : u.m[i][i] > 0 ? rest / u.m[i][i] : 0;
        }
    return u;
}

static struct mat3 noise_of(const struct band_aim *aim)
{
    struct mat3 g = {{{0}}};
    for (int i = 0; i < TRAINING_ROWS; i++) {
        struct mat3 own = mat3_mul(mat3_transpose(aim->slopes[i]), aim->slopes[i]);
        for (int k = 0; k < 9; k++)
            g.m[k / 3][k % 3] += own.m[k / 3][k % 3];
    }
    g = root(g);
    for (int k = 0; k < 9; k++)
        g.m[k / 3][k % 3] *= COEFFICIENT_NOISE;
    return g;
}

bool band_aim_at(const struct band_training *training, const struct spectrum *lamp,
                 enum observer observer, struct band_aim *out, struct error *err)
{
    struct xyz basis[BASIS_VECTORS];
    struct xyz white = xyz_relative(lamp, NULL, observer);
    if (!(white.X > 0 && white.Y > 0 && white.Z > 0))
        return fail(err, ERROR_DATA, "the lamp is dark: X %g, Y %g, Z %g", white.X, white.Y,
                    white.Z);
    out->white = white;
    for (int v = 0; v < BASIS_VECTORS; v++)
        basis[v] = xyz_relative(lamp, &training->basis[v], observer);
    for (int i = 0; i < TRAINING_ROWS; i++) {
        struct xyz c = {0, 0, 0};
        struct lab lab;
        for (int v = 0; v < BASIS_VECTORS; v++) {
            double k = training->coefficients[i][v];
            c = (struct xyz){c.X + k * basis[v].X, c.Y + k * basis[v].Y, c.Z + k * basis[v].Z};
        }
        if (!lab_of(c, white, &lab, err))
            return false;
        out->xyz[i] = c;
        out->slopes[i] = mat3_mul(de00_metric(lab), lab_slopes(c, white));
        for (int k = 0; k < 9; k++)
            out->slopes[i].m[k / 3][k % 3] *= training->weights[i];
    }
    out->noise = noise_of(out);
    return true;
}

void band_rows(const struct band_training *training, const struct band_set *set,
               struct bands rows[TRAINING_ROWS])
{
    struct bands basis[BASIS_VECTORS];
    for (int v = 0; v < BASIS_VECTORS; v++)
        basis[v] = bands_of(set, &training->basis[v]);
    for (int i = 0; i < TRAINING_ROWS; i++)
        for (int j = 0; j < BANDS_MOST; j++) {
            rows[i].v[j] = 0;
            for (int v = 0; v < BASIS_VECTORS; v++)
                rows[i].v[j] += training->coefficients[i][v] * basis[v].v[j];
        }
}

// Adds one row: |slopes (M c - target)|^2 with M the 3 x k unknowns.
static void add_row(struct normal *eq, const struct mat3 *slopes, const double *c, int k,
                    struct xyz target)
{
    struct mat3 g = mat3_mul(mat3_transpose(*slopes), *slopes);
    struct vec3 t = mat3_apply(g, (struct vec3){target.X, target.Y, target.Z});
    const double pull[3] = {t.x, t.y, t.z};
    for (int p = 0; p < 3; p++)
        for (int a = 0; a < k; a++) {
            eq->b[p * k + a] += pull[p] * c[a];
            for (int q = 0; q < 3; q++)
                for (int b = 0; b < k; b++)
                    eq->a[p * k + a][q * k + b] += g.m[p][q] * c[a] * c[b];
        }
}

static bool cholesky(struct normal *eq)
{
    for (int j = 0; j < eq->n; j++) {
        for (int k = 0; k < j; k++)
            for (int i = j; i < eq->n; i++)
                eq->a[i][j] -= eq->a[i][k] * eq->a[j][k];
        if (!(eq->a[j][j] > 0))
            return false;
        double root = sqrt(eq->a[j][j]);
        for (int i = j; i < eq->n; i++)
            eq->a[i][j] /= root;
    }
    return true;
}

static bool solve(struct normal *eq, struct error *err)
{
    double trace = 0;
    for (int i = 0; i < eq->n; i++)
        trace += eq->a[i][i];
    for (int i = 0; i < eq->n; i++)
        eq->a[i][i] += RIDGE * trace / eq->n;
    if (!cholesky(eq))
        return fail(err, ERROR_DATA, "the training reflectances do not decide the band matrix");
    for (int i = 0; i < eq->n; i++) {
        for (int k = 0; k < i; k++)
            eq->b[i] -= eq->a[i][k] * eq->b[k];
        eq->b[i] /= eq->a[i][i];
    }
    for (int i = eq->n - 1; i >= 0; i--) {
        for (int k = i + 1; k < eq->n; k++)
            eq->b[i] -= eq->a[k][i] * eq->b[k];
        eq->b[i] /= eq->a[i][i];
    }
    return true;
}

static void add_noise(struct normal *eq, const struct band_aim *aim, int k)
{
    struct xyz white = aim->white;
    double c[BANDS_MOST];
    for (int noisy = 0; noisy < k; noisy++) {
        for (int j = 0; j < k; j++)
            c[j] = j == noisy;
        add_row(eq, &aim->noise, c, k, (struct xyz){0, 0, 0});
    }
    for (int j = 0; j < k; j++)
        c[j] = -1; // the last column is white less the others
    add_row(eq, &aim->noise, c, k, (struct xyz){-white.X, -white.Y, -white.Z});
}

bool band_matrix_solve(const struct band_aim *aim, const struct bands *rows, int count,
                       struct band_matrix *out, struct error *err)
{
    const int k = count - 1; // the last column makes the rows sum to white
    struct normal eq = {.n = 3 * k};
    for (int i = 0; i < TRAINING_ROWS; i++) {
        double c[BANDS_MOST];
        double last = rows[i].v[k];
        for (int j = 0; j < k; j++)
            c[j] = rows[i].v[j] - last;
        struct xyz t = aim->xyz[i];
        add_row(&eq, &aim->slopes[i], c, k,
                (struct xyz){t.X - last * aim->white.X, t.Y - last * aim->white.Y,
                             t.Z - last * aim->white.Z});
    }
    add_noise(&eq, aim, k);
    if (!solve(&eq, err))
        return false;
    const double white[3] = {aim->white.X, aim->white.Y, aim->white.Z};
    *out = (struct band_matrix){.count = count};
    for (int p = 0; p < 3; p++) {
        out->m[p][k] = white[p];
        for (int j = 0; j < k; j++) {
            out->m[p][j] = eq.b[p * k + j];
            out->m[p][k] -= out->m[p][j];
        }
    }
    return true;
}

static void put(double *residuals, int at, struct mat3 slopes, struct xyz off)
{
    struct xyz r = xyz_apply(slopes, off);
    residuals[3 * at] = r.X;
    residuals[3 * at + 1] = r.Y;
    residuals[3 * at + 2] = r.Z;
}

void band_residuals(const struct band_aim *aim, const struct bands *rows,
                    const struct band_matrix *matrix, double residuals[BAND_RESIDUALS])
{
    const double(*m)[BANDS_MOST] = matrix->m;
    for (int i = 0; i < TRAINING_ROWS; i++) {
        struct xyz c = band_xyz(matrix, &rows[i]);
        struct xyz off = {c.X - aim->xyz[i].X, c.Y - aim->xyz[i].Y, c.Z - aim->xyz[i].Z};
        put(residuals, i, aim->slopes[i], off);
    }
    for (int j = 0; j < BANDS_MOST; j++)
        put(residuals, TRAINING_ROWS + j, aim->noise, (struct xyz){m[0][j], m[1][j], m[2][j]});
}

bool band_matrix_adapted(const struct band_set *set, const struct spectrum *lamp,
                         enum observer observer, struct band_matrix *out, struct error *err)
{
    struct band_training training;
    struct band_aim aim;
    struct bands rows[TRAINING_ROWS];
    band_training_shipped(&training);
    if (!band_aim_at(&training, lamp, observer, &aim, err))
        return false;
    band_rows(&training, set, rows);
    return band_matrix_solve(&aim, rows, set->count, out, err);
}

// Channels of the lamp itself, over its luminance.
static struct bands lamp_channels(const struct band_set *set, const struct spectrum *lamp,
                                  enum observer observer)
{
    struct bands s = bands_of(set, lamp);
    double luminance = xyz_absolute(lamp, observer).Y;
    for (int j = 0; j < set->count; j++)
        s.v[j] /= luminance;
    return s;
}

static bool add_lamp(struct normal *eq, const struct band_training *training,
                     const struct band_set *set, const char *name, enum observer observer,
                     struct error *err)
{
    struct spectrum lamp;
    struct band_aim aim;
    struct bands rows[TRAINING_ROWS];
    if (!illuminant(name, &lamp, err) || !band_aim_at(training, &lamp, observer, &aim, err))
        return false;
    struct bands s = lamp_channels(set, &lamp, observer);
    band_rows(training, set, rows);
    for (int i = 0; i < TRAINING_ROWS; i++) {
        for (int j = 0; j < set->count; j++)
            rows[i].v[j] *= s.v[j];
        add_row(eq, &aim.slopes[i], rows[i].v, set->count, aim.xyz[i]);
    }
    return true;
}

bool band_matrix_product(const struct band_set *set, const struct spectrum *lamp,
                         enum observer observer, struct band_matrix *out, struct error *err)
{
    static const char *const lamps[] = {"A", "D50", "D65", "FL2", "FL8", "FL11"};
    struct band_training training;
    struct normal eq = {.n = 3 * set->count};
    struct xyz white = xyz_relative(lamp, NULL, observer);
    if (!(white.Y > 0))
        return fail(err, ERROR_DATA, "the lamp is dark: Y %g", white.Y);
    band_training_shipped(&training);
    for (size_t n = 0; n < sizeof lamps / sizeof *lamps; n++)
        if (!add_lamp(&eq, &training, set, lamps[n], observer, err))
            return false;
    if (!solve(&eq, err))
        return false;
    struct bands s = lamp_channels(set, lamp, observer);
    double Y = 0;
    for (int j = 0; j < set->count; j++)
        Y += eq.b[set->count + j] * s.v[j];
    *out = (struct band_matrix){.count = set->count};
    for (int p = 0; p < 3; p++)
        for (int j = 0; j < set->count; j++)
            out->m[p][j] = eq.b[p * set->count + j] * s.v[j] * 100 / Y;
    return true;
}
