// SPDX-License-Identifier: Apache-2.0
#include "calibration/bands_optimise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/fit_ceres.h"
#include "colorimetry/illuminant.h"

// Booths hold tungsten and daylight simulators; tri-band tubes and LEDs pull
// the bands towards their lines and count less.
static const struct training_lamp {
    const char *name;
    double weight;
} LAMPS[] = {
    {"A", 1},     {"D50", 1},    {"D65", 1.5},  {"FL8", 1},      {"FL3.15", 1},
    {"FL2", 0.3}, {"FL10", 0.3}, {"FL11", 0.3}, {"LED-B3", 0.3},
};

enum { LAMP_COUNT = sizeof LAMPS / sizeof *LAMPS, STARTS = 4, SWEEPS_MOST = 60 };

static const double CENTRE_LEAST_NM = 395, CENTRE_SPAN_NM = 305;
static const double WIDTH_LEAST_NM = 8, WIDTH_SPAN_NM = 72;

// ---- the basis -------------------------------------------------------------

typedef double square[BASIS_SAMPLES][BASIS_SAMPLES];

static void rotate(square a, square v, int p, int q)
{
    double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
    double c = 1 / sqrt(t * t + 1);
    double s = t * c;
    for (int k = 0; k < BASIS_SAMPLES; k++) {
        double kp = a[k][p], kq = a[k][q];
        a[k][p] = c * kp - s * kq;
        a[k][q] = s * kp + c * kq;
    }
    for (int k = 0; k < BASIS_SAMPLES; k++) {
        double pk = a[p][k], qk = a[q][k];
        a[p][k] = c * pk - s * qk;
        a[q][k] = s * pk + c * qk;
    }
    for (int k = 0; k < BASIS_SAMPLES; k++) {
        double kp = v[k][p], kq = v[k][q];
        v[k][p] = c * kp - s * kq;
        v[k][q] = s * kp + c * kq;
    }
}

// Cyclic Jacobi: a becomes diagonal, the columns of v its eigenvectors.
static void eigenvectors(square a, square v)
{
    for (int i = 0; i < BASIS_SAMPLES; i++)
        for (int j = 0; j < BASIS_SAMPLES; j++)
            v[i][j] = i == j;
    for (int sweep = 0; sweep < SWEEPS_MOST; sweep++) {
        double off = 0;
        double on = 0;
        for (int p = 0; p < BASIS_SAMPLES; p++) {
            on += a[p][p] * a[p][p];
            for (int q = p + 1; q < BASIS_SAMPLES; q++) {
                off += a[p][q] * a[p][q];
                if (a[p][q] != 0)
                    rotate(a, v, p, q);
            }
        }
        if (off <= 1e-28 * on)
            return;
    }
}

static double sample_of(const struct spectrum *s, int i)
{
    return s->v[BASIS_FIRST_NM - SPECTRUM_FIRST_NM + i * BASIS_STEP_NM];
}

static void leading_vectors(const struct reflectances *r, double samples[][BASIS_SAMPLES])
{
    static const double ROUND = 1e7; // as the tables are written
    square gram = {{0}}, v;
    for (int n = 0; n < r->count; n++)
        for (int i = 0; i < BASIS_SAMPLES; i++)
            for (int j = 0; j < BASIS_SAMPLES; j++)
                gram[i][j] += r->weights[n] * r->weights[n] * sample_of(&r->spectra[n], i) *
                              sample_of(&r->spectra[n], j);
    eigenvectors(gram, v);
    for (int k = 0; k < BASIS_VECTORS; k++) {
        int best = 0;
        for (int i = 1; i < BASIS_SAMPLES; i++)
            best = gram[i][i] > gram[best][best] ? i : best;
        gram[best][best] = -1;
        double sum = 0;
        for (int i = 0; i < BASIS_SAMPLES; i++)
            sum += v[i][best];
        for (int i = 0; i < BASIS_SAMPLES; i++)
            samples[k][i] = rint((sum < 0 ? -v[i][best] : v[i][best]) * ROUND) / ROUND;
    }
}

// ---- the rows --------------------------------------------------------------

struct projected {
    double c[BASIS_VECTORS];
    double apart; // squared distance to the nearest chosen one
};

static double squared_distance(const struct projected *a, const struct projected *b)
{
    double sum = 0;
    for (int v = 0; v < BASIS_VECTORS; v++)
        sum += (a->c[v] - b->c[v]) * (a->c[v] - b->c[v]);
    return sum;
}

static void project(const struct reflectances *r, double samples[][BASIS_SAMPLES],
                    struct projected *all)
{
    for (int n = 0; n < r->count; n++)
        for (int v = 0; v < BASIS_VECTORS; v++)
            for (int i = 0; i < BASIS_SAMPLES; i++)
                all[n].c[v] += samples[v][i] * sample_of(&r->spectra[n], i);
}

// The one nearest the mean first, then always the farthest from those chosen.
static void choose(const struct reflectances *r, struct projected *all, struct band_training *out)
{
    static const double ROUND = 1e6;
    struct projected mean = {{0}, 0};
    int next = 0;
    for (int n = 0; n < r->count; n++)
        for (int v = 0; v < BASIS_VECTORS; v++)
            mean.c[v] += all[n].c[v] / r->count;
    for (int n = 0; n < r->count; n++) {
        all[n].apart = INFINITY;
        if (squared_distance(&all[n], &mean) < squared_distance(&all[next], &mean))
            next = n;
    }
    for (int row = 0; row < TRAINING_ROWS; row++) {
        for (int v = 0; v < BASIS_VECTORS; v++)
            out->coefficients[row][v] = rint(all[next].c[v] * ROUND) / ROUND;
        out->weights[row] = r->weights[next];
        const struct projected chosen = all[next];
        for (int n = 0; n < r->count; n++) {
            all[n].apart = fmin(all[n].apart, squared_distance(&all[n], &chosen));
            next = all[n].apart > all[next].apart ? n : next;
        }
    }
}

bool band_training_derive(const struct reflectances *r, struct band_training *out,
                          double samples[BASIS_VECTORS][BASIS_SAMPLES], struct error *err)
{
    double nm[BASIS_SAMPLES];
    if (r->count < TRAINING_ROWS)
        return fail(err, ERROR_DATA, "%d reflectances; at least %d are needed", r->count,
                    TRAINING_ROWS);
    struct projected *all = calloc((size_t)r->count, sizeof *all);
    if (!all)
        return fail(err, ERROR_SYSTEM, "out of memory for %d reflectances", r->count);
    leading_vectors(r, samples);
    project(r, samples, all);
    choose(r, all, out);
    free(all);
    for (int i = 0; i < BASIS_SAMPLES; i++)
        nm[i] = BASIS_FIRST_NM + i * BASIS_STEP_NM;
    for (int v = 0; v < BASIS_VECTORS; v++)
        if (!spectrum_from_samples(nm, samples[v], BASIS_SAMPLES, true, &out->basis[v], err))
            return false;
    return true;
}

// ---- the shapes ------------------------------------------------------------

struct search {
    const struct band_training *training;
    int count;
    struct band_aim aims[LAMP_COUNT];
};

static double within(double q, double least, double span)
{
    return least + span / (1 + exp(-q));
}

static double as_free(double x, double least, double span)
{
    double part = fmin(fmax((x - least) / span, 0.01), 0.99);
    return log(part / (1 - part));
}

static bool set_of(int count, const double *x, struct band_set *set, struct error *err)
{
    double centre[BANDS_MOST], width[BANDS_MOST];
    for (int j = 0; j < count; j++) {
        centre[j] = within(x[j], CENTRE_LEAST_NM, CENTRE_SPAN_NM);
        width[j] = within(x[count + j], WIDTH_LEAST_NM, WIDTH_SPAN_NM);
    }
    return band_set_make(count, centre, width, set, err);
}

static bool shape_residuals(void *context, int group, const double *x, double *residuals,
                            double *jacobian)
{
    const struct search *s = context;
    struct band_set set;
    struct bands rows[TRAINING_ROWS];
    (void)group;
    (void)jacobian;
    if (!set_of(s->count, x, &set, NULL))
        return false;
    band_rows(s->training, &set, rows);
    for (int n = 0; n < LAMP_COUNT; n++) {
        struct band_matrix m;
        double *own = residuals + (size_t)n * BAND_RESIDUALS;
        if (!band_matrix_solve(&s->aims[n], rows, s->count, &m, NULL))
            return false;
        band_residuals(&s->aims[n], rows, &m, own);
        for (int i = 0; i < BAND_RESIDUALS; i++)
            own[i] *= LAMPS[n].weight;
    }
    return true;
}

static void start_at(int start, int count, double *x)
{
    const double first = start % 2 ? 440 : 420;
    const double last = start % 2 ? 620 : 640;
    const double width = (start / 2 ? 1.0 : 0.6) * 220 / count;
    for (int j = 0; j < count; j++) {
        x[j] = as_free(first + (last - first) * j / (count - 1), CENTRE_LEAST_NM, CENTRE_SPAN_NM);
        x[count + j] = as_free(width, WIDTH_LEAST_NM, WIDTH_SPAN_NM);
    }
}

static bool search_best(struct search *s, double *best, double *cost, struct error *err)
{
    const struct least_squares problem = {
        .parameters = 2 * s->count,
        .groups = 1,
        .group_size = LAMP_COUNT * BAND_RESIDUALS,
        .evaluate = shape_residuals,
        .context = s,
        .numeric = true,
        .tolerance = 1e-4,
        .iterations = 150,
    };
    *cost = INFINITY;
    for (int start = 0; start < STARTS; start++) {
        double x[2 * BANDS_MOST];
        struct least_squares_result result;
        start_at(start, s->count, x);
        if (least_squares_solve(&problem, x, &result, err) && result.cost_after < *cost) {
            *cost = result.cost_after;
            memcpy(best, x, sizeof x);
        }
    }
    return isfinite(*cost);
}

// Sorted by centre, to a hundredth of a nanometre: as the table has it.
static bool sorted_set(int count, const double *x, struct band_set *out, struct error *err)
{
    struct band_set set;
    double centre[BANDS_MOST], width[BANDS_MOST];
    if (!set_of(count, x, &set, err))
        return false;
    for (int j = 0; j < count; j++) {
        int at = j;
        for (; at > 0 && centre[at - 1] > set.centre_nm[j]; at--) {
            centre[at] = centre[at - 1];
            width[at] = width[at - 1];
        }
        centre[at] = rint(set.centre_nm[j] * 100) / 100;
        width[at] = rint(set.width_nm[j] * 100) / 100;
    }
    return band_set_make(count, centre, width, out, err);
}

bool band_set_optimise(const struct band_training *training, int count, struct band_set *out,
                       double *rms, struct error *err)
{
    if (count < BANDS_LEAST || count > BANDS_MOST)
        return fail(err, ERROR_RANGE, "%d bands; allowed: %d..%d", count, BANDS_LEAST, BANDS_MOST);
    struct search *s = calloc(1, sizeof *s);
    bool ok = s || fail(err, ERROR_SYSTEM, "out of memory");
    double x[2 * BANDS_MOST];
    double cost = 0;
    for (int n = 0; ok && n < LAMP_COUNT; n++) {
        struct spectrum lamp;
        ok = illuminant(LAMPS[n].name, &lamp, err) &&
             band_aim_at(training, &lamp, OBSERVER_1931_2, &s->aims[n], err);
    }
    if (ok) {
        s->training = training;
        s->count = count;
        ok = search_best(s, x, &cost, err) && sorted_set(count, x, out, err);
    }
    *rms = ok ? sqrt(2 * cost / (LAMP_COUNT * TRAINING_ROWS)) : 0;
    free(s);
    return ok;
}
