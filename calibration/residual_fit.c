// SPDX-License-Identifier: Apache-2.0
#include "calibration/residual_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/cholesky.h"
#include "calibration/fit_ceres.h"
#include "calibration/statistics.h"
#include "colorimetry/metric.h"

static const double LENGTH = 160;         // CIELAB units over which the residual stays alike
static const double MARGIN = 10;          // CIELAB units of the box around the gamut
static const double PENALTY_LEAST = 1e-6; // and up by the half decade
static const double HUBER = 1.5;          // times the median difference: counts by less beyond
// TERMS: of the prior; a hundred hold all but a few millionths of its variance.
enum { PENALTIES = 19, ROUNDS = 2, SIDE = 9, TERMS = 100 };

struct fit {
    const struct measurements *m;
    struct display_model *model;
    const struct residual_spread *spread; // or NULL
    struct lattice box;                   // its corners
    double *prior;                        // LATTICE_NODES x TERMS: factor of the prior covariance
    double *design;                       // patches x TERMS, on the prior's factor
    double (*apart)[3];                   // measured less predicted, CIELAB
    struct lab *measured;                 // CIELAB
    struct lab *predicted;                // CIELAB
    double *weight;
    double (*left_out)[3];
    double *de00;
};

static void drop(struct fit *f)
{
    free(f->prior);
    free(f->design);
    free(f->apart);
    free(f->measured);
    free(f->predicted);
    free(f->weight);
    free(f->left_out);
    free(f->de00);
}

static bool take_room(struct fit *f, struct error *err)
{
    size_t n = (size_t)f->m->count;
    f->prior = malloc(sizeof(double) * LATTICE_NODES * TERMS);
    f->design = malloc(n * TERMS * sizeof *f->design);
    f->apart = malloc(n * sizeof *f->apart);
    f->measured = malloc(n * sizeof *f->measured);
    f->predicted = malloc(n * sizeof *f->predicted);
    f->weight = malloc(n * sizeof *f->weight);
    f->left_out = malloc(n * sizeof *f->left_out);
    f->de00 = malloc(n * sizeof *f->de00);
    return (f->prior && f->design && f->apart && f->measured && f->predicted && f->weight &&
            f->left_out && f->de00) ||
           fail(err, ERROR_SYSTEM, "out of memory for %d patches", f->m->count);
}

static struct lab lab_in(const struct fit *f, struct xyz c)
{
    struct lab lab = {0, 0, 0};
    lab_of(c, f->model->white, &lab, NULL); // prepare saw to white
    return lab;
}

// The box is that of the plain model's gamut and a margin, so that the residual
// stays smooth at the gamut's surface.
static void find_box(struct fit *f)
{
    struct vec3 *least = &f->box.least, *most = &f->box.most;
    *least = (struct vec3){INFINITY, INFINITY, INFINITY};
    *most = vec3_scale(*least, -1);
    for (int k = 0; k < SIDE * SIDE * SIDE; k++) {
        const double step = 1.0 / (SIDE - 1);
        struct counts c = {k / SIDE / SIDE * step, k / SIDE % SIDE * step, k % SIDE * step};
        struct lab lab = lab_in(f, display_forward(f->model, c));
        *least = (struct vec3){fmin(least->x, lab.L), fmin(least->y, lab.a), fmin(least->z, lab.b)};
        *most = (struct vec3){fmax(most->x, lab.L), fmax(most->y, lab.a), fmax(most->z, lab.b)};
    }
    const struct vec3 margin = {MARGIN, MARGIN, MARGIN};
    *least = vec3_sub(*least, margin);
    *most = vec3_add(*most, margin);
}

static double matern(double distance)
{
    double s = sqrt(5) * distance / LENGTH;
    return (1 + s + s * s / 3) * exp(-s);
}

static struct vec3 node_place(const struct lattice *box, int node)
{
    return (struct vec3){lattice_abscissa(box, 0, node / LATTICE_SIDE / LATTICE_SIDE),
                         lattice_abscissa(box, 1, node / LATTICE_SIDE % LATTICE_SIDE),
                         lattice_abscissa(box, 2, node % LATTICE_SIDE)};
}

static bool find_prior(struct fit *f, struct error *err)
{
    const double tolerance = 1e-9; // of the variance
    double *covariance = malloc(sizeof(double) * LATTICE_NODES * LATTICE_NODES);
    if (!covariance)
        return fail(err, ERROR_SYSTEM, "out of memory for a residual");
    for (int i = 0; i < LATTICE_NODES; i++)
        for (int j = 0; j < LATTICE_NODES; j++)
            covariance[i * LATTICE_NODES + j] =
                matern(vec3_length(vec3_sub(node_place(&f->box, i), node_place(&f->box, j))));
    cholesky_pivoted(covariance, LATTICE_NODES, TERMS, tolerance, f->prior);
    free(covariance);
    return true;
}

static void design_row(const struct fit *f, struct lab at, double *row)
{
    struct lattice_place p = lattice_find(&f->box, (struct vec3){at.L, at.a, at.b});
    memset(row, 0, TERMS * sizeof *row);
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < 4; k++) {
                int node = lattice_node(p.first[0] + i, p.first[1] + j, p.first[2] + k);
                double w = p.weight[0][i] * p.weight[1][j] * p.weight[2][k];
                for (int n = 0; n < TERMS; n++)
                    row[n] += w * f->prior[node * TERMS + n];
            }
}

// The side of a cube of CIELAB as large as one unit of CIEDE2000, inverted.
static double scale_of(struct lab at)
{
    struct mat3 u = de00_metric(at); // triangular
    return cbrt(u.m[0][0] * u.m[1][1] * u.m[2][2]);
}

static void find_rows(struct fit *f)
{
    for (int i = 0; i < f->m->count; i++) {
        struct lab is = lab_in(f, f->m->patches[i].xyz);
        struct lab was = lab_in(f, display_forward(f->model, f->m->patches[i].counts));
        double scale = scale_of(is);
        f->measured[i] = is;
        f->predicted[i] = was;
        f->apart[i][0] = is.L - was.L;
        f->apart[i][1] = is.a - was.a;
        f->apart[i][2] = is.b - was.b;
        f->weight[i] = scale * scale;
        design_row(f, was, f->design + (long)i * TERMS);
    }
}

// Mean CIEDE2000 of the patches, each predicted from all the others.
static double left_out_mean(const struct fit *f, const struct ridge *ridge, double penalty)
{
    double sum = 0;
    ridge_left_out(ridge, penalty, f->left_out[0]);
    for (int i = 0; i < f->m->count; i++) {
        const double *d = f->left_out[i];
        struct lab p = f->predicted[i];
        f->de00[i] = delta_e_2000(f->measured[i], (struct lab){p.L + d[0], p.a + d[1], p.b + d[2]});
        sum += f->de00[i];
    }
    return sum / f->m->count;
}

static double penalty_of(int k)
{
    return PENALTY_LEAST * pow(10, 0.5 * k);
}

static int best_penalty(const struct fit *f, const struct ridge *ridge)
{
    int best = 0;
    double least = INFINITY;
    for (int k = 0; k < PENALTIES; k++) {
        double mean = left_out_mean(f, ridge, penalty_of(k));
        if (mean < least) {
            least = mean;
            best = k;
        }
    }
    left_out_mean(f, ridge, penalty_of(best));
    return best;
}

// Huber's weights from the differences that the last penalty left.
static void reweight(struct fit *f)
{
    double most = HUBER * summarise(f->de00, f->m->count).median;
    for (int i = 0; i < f->m->count; i++) {
        double scale = scale_of(f->measured[i]);
        f->weight[i] = scale * scale * (f->de00[i] > most ? most / f->de00[i] : 1);
    }
}

static struct ridge *decompose(const struct fit *f, struct error *err)
{
    const struct ridge_problem problem = {.rows = f->m->count,
                                          .unknowns = TERMS,
                                          .values = 3,
                                          .design = f->design,
                                          .value = f->apart[0],
                                          .weight = f->weight};
    return ridge_create(&problem, err);
}

static void lay(const struct fit *f, const struct ridge *ridge, double penalty,
                struct display_model *model)
{
    double c[TERMS][3];
    ridge_solve(ridge, penalty, c[0]);
    model->kind = DISPLAY_RESIDUAL;
    model->residual = f->box;
    for (int k = 0; k < LATTICE_NODES; k++)
        for (int j = 0; j < TERMS; j++)
            for (int n = 0; n < 3; n++)
                model->residual.node[k][n] += f->prior[k * TERMS + j] * c[j][n];
}

// Variance of a reading in CIEDE2000 units, from what the fit left.
static double noise_variance(const struct fit *f, const struct display_model *model, double freedom)
{
    double sum = 0;
    for (int i = 0; i < f->m->count; i++) {
        struct lab now = lab_in(f, display_forward(model, f->m->patches[i].counts));
        double apart = delta_e_ab(f->measured[i], now);
        sum += f->weight[i] * apart * apart / 3;
    }
    return sum / fmax(f->m->count - freedom, 1);
}

// The shifts of L*, a* and b* are alike uncertain and independent.
static bool find_spread(const struct fit *f, const struct ridge *ridge, double penalty,
                        double variance, struct error *err)
{
    const int n = f->spread->n;
    double *inner = malloc(sizeof(double) * TERMS * TERMS);
    double *rows = malloc(sizeof(double) * TERMS * (size_t)n);
    bool ok = (inner && rows) || fail(err, ERROR_SYSTEM, "out of memory for a covariance");
    for (int i = 0; ok && i < n; i++)
        design_row(f, lab_in(f, display_forward(f->model, f->spread->counts[i])), rows + i * TERMS);
    if (ok)
        ridge_covariance(ridge, penalty, inner);
    memset(f->spread->covariance, 0, sizeof(double) * 9 * (size_t)n * (size_t)n);
    for (int i = 0; ok && i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < TERMS; k++)
                for (int l = 0; l < TERMS; l++)
                    sum += rows[i * TERMS + k] * inner[k * TERMS + l] * rows[j * TERMS + l];
            for (int c = 0; c < 3; c++)
                f->spread->covariance[(3 * i + c) * 3 * n + 3 * j + c] = variance * sum;
        }
    free(inner);
    free(rows);
    return ok;
}

static bool settle(const struct fit *f, const struct ridge *ridge, int from,
                   struct residual_fit *found, struct error *err)
{
    struct display_model model = *f->model;
    for (int k = from; k < PENALTIES; k++) {
        const double penalty = penalty_of(k), freedom = ridge_freedom(ridge, penalty);
        lay(f, ridge, penalty, &model);
        if (!display_model_prepare(&model, err))
            continue;
        if (f->spread && !find_spread(f, ridge, penalty, noise_variance(f, &model, freedom), err))
            return false;
        *found = (struct residual_fit){penalty, freedom};
        *f->model = model;
        return true;
    }
    return while_doing(err, "no residual that the patches allow");
}

static bool solve(struct fit *f, struct residual_fit *found, struct error *err)
{
    for (int round = 0;; round++) {
        struct ridge *ridge = decompose(f, err);
        if (!ridge)
            return false;
        int best = best_penalty(f, ridge);
        bool last = round == ROUNDS - 1;
        bool settled = last && settle(f, ridge, best, found, err);
        ridge_destroy(ridge);
        if (last)
            return settled;
        reweight(f);
    }
}

bool residual_fit(const struct measurements *m, struct display_model *model,
                  struct residual_fit *found, const struct residual_spread *spread,
                  struct error *err)
{
    struct fit f = {.m = m, .model = model, .spread = spread};
    bool ok = take_room(&f, err);
    if (ok) {
        find_box(&f);
        ok = find_prior(&f, err);
    }
    if (ok) {
        find_rows(&f);
        ok = solve(&f, found, err);
    }
    drop(&f);
    return ok || while_doing(err, "%s", m->path);
}
