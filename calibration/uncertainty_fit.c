// SPDX-License-Identifier: Apache-2.0
#include "calibration/uncertainty_fit.h"

#include <math.h>
#include <stdlib.h>

#include "calibration/fit_ceres.h"
#include "calibration/statistics.h"
#include "colorimetry/metric.h"

static const double WILD = 4; // times the median: counts no further
static const double SAME_COUNTS = 1e-6;
static const double KEPT = 1e4; // modes are rounded to this part of a CIELAB unit
enum { CELLS_A_SIDE = 4, CELLS = 64 };
enum { REPEATS_LEAST = 4, BINS = 6 }; // BINS: of distance, doubling from NEAREST
static const double NEAREST = 4;      // CIELAB units: the first bin's end
static const double LENGTHS[] = {4, 8, 16, 32, 64};

// A left-out patch: where, and what its prediction missed in CIEDE2000 units.
struct miss {
    int cell; // of the counts
    struct lab at;
    struct vec3 off;
};

// Sums over pairs of patches by their distance.
struct pairs {
    double product[BINS], distance[BINS];
    long count[BINS];
};

struct counts uncertainty_place(int place)
{
    const double step = 1.0 / (UNCERTAINTY_SIDE - 1);
    return (struct counts){place / (UNCERTAINTY_SIDE * UNCERTAINTY_SIDE) * step,
                           place / UNCERTAINTY_SIDE % UNCERTAINTY_SIDE * step,
                           place % UNCERTAINTY_SIDE * step};
}

bool uncertainty_modes(const double *covariance, struct display_uncertainty *out, struct error *err)
{
    double modes[UNCERTAINTY_MODES][UNCERTAINTY_PLACES][3];
    if (!principal_modes(covariance, 3 * UNCERTAINTY_PLACES, UNCERTAINTY_MODES, modes[0][0], err))
        return false;
    out->modes = UNCERTAINTY_MODES;
    for (int k = 0; k < UNCERTAINTY_MODES; k++)
        for (int p = 0; p < UNCERTAINTY_PLACES; p++)
            for (int n = 0; n < 3; n++)
                out->mode[k][p][n] = rint(modes[k][p][n] * KEPT) / KEPT + 0.0;
    return true;
}

// ---- repeatability ---------------------------------------------------------

static bool same(struct counts a, struct counts b)
{
    return fmax(fabs(a.r - b.r), fmax(fabs(a.g - b.g), fabs(a.b - b.b))) < SAME_COUNTS;
}

static struct vec3 lab_of_patch(const struct measurements *m, int i)
{
    struct lab lab = {0, 0, 0};
    lab_of(m->patches[i].xyz, m->white, &lab, NULL); // measurements_load saw to white
    return (struct vec3){lab.L, lab.a, lab.b};
}

// Sum of squares about a group's mean from its pairs: sum over i and j of
// |x_i - x_j|^2 = 2 size sum of |x_i - mean|^2.
static double noise_variance(const struct measurements *m)
{
    double sum = 0;
    int readings = 0, groups = 0;
    for (int i = 0; i < m->count; i++) {
        int size = 0;
        bool first = true;
        double squares = 0;
        struct vec3 a = lab_of_patch(m, i);
        struct mat3 metric = de00_metric((struct lab){a.x, a.y, a.z});
        for (int j = 0; j < m->count; j++) {
            if (!same(m->patches[i].counts, m->patches[j].counts))
                continue;
            struct vec3 d = mat3_apply(metric, vec3_sub(lab_of_patch(m, j), a));
            squares += vec3_dot(d, d) / 3;
            first = first && j >= i;
            size++;
        }
        if (size > 1) {
            sum += squares / (2.0 * size);
            readings++;
            groups += first;
        }
    }
    return readings >= REPEATS_LEAST ? sum / (readings - groups) : 0;
}

// ---- what left-out patches say ---------------------------------------------

// One of 64 cells of the cube of counts.
static int cell_of(struct counts c)
{
    const double v[3] = {c.r, c.g, c.b};
    int cell = 0;
    for (int i = 0; i < 3; i++)
        cell = CELLS_A_SIDE * cell + (int)fmin(v[i] * CELLS_A_SIDE, CELLS_A_SIDE - 1);
    return cell;
}

static int find_misses(const struct measurements *m, const struct display_cross *cross,
                       enum display_kind kind, struct miss *misses, double *room)
{
    int n = 0;
    for (int i = 0; i < m->count; i++) {
        struct lab was;
        if (!cross->scored[i] || !lab_of(cross->predicted[i][kind], m->white, &was, NULL))
            continue;
        struct vec3 apart = vec3_sub(lab_of_patch(m, i), (struct vec3){was.L, was.a, was.b});
        misses[n].cell = cell_of(m->patches[i].counts);
        misses[n].at = was;
        misses[n].off = mat3_apply(de00_metric(was), apart);
        room[n] = vec3_length(misses[n].off);
        n++;
    }
    double most = n ? WILD * summarise(room, n).median : 0;
    for (int i = 0; i < n; i++)
        if (room[i] > most && room[i] > 0)
            misses[i].off = vec3_scale(misses[i].off, most / room[i]);
    return n;
}

// Least squares of the mean squares a CIEDE2000 axis: everywhere + neutral *
// uncertainty_neutral(colour), both >= 0. Every occupied cell counts alike:
// patches are dense along ramps, where a model errs least.
static void split(const struct miss *misses, int n, double *everywhere, double *neutral)
{
    int count[CELLS] = {0};
    double ww = 0, w1 = 0, one = 0, sw = 0, s1 = 0;
    for (int i = 0; i < n; i++)
        count[misses[i].cell]++;
    for (int i = 0; i < n; i++) {
        double weight = 1.0 / count[misses[i].cell], w = uncertainty_neutral(misses[i].at);
        double square = vec3_dot(misses[i].off, misses[i].off) / 3;
        ww += weight * w * w;
        w1 += weight * w;
        one += weight;
        sw += weight * w * square;
        s1 += weight * square;
    }
    double determinant = ww * one - w1 * w1;
    *neutral = determinant > 1e-6 * ww * one ? (one * sw - w1 * s1) / determinant : 0;
    *neutral = fmax(*neutral, 0);
    *everywhere = one > 0 ? (s1 - *neutral * w1) / one : 0;
    if (*everywhere < 0) {
        *everywhere = 0;
        *neutral = sw / ww;
    }
}

static int bin_of(double distance)
{
    int bin = 0;
    for (double end = NEAREST; bin < BINS && distance > end; end *= 2)
        bin++;
    return bin;
}

static struct pairs pair_up(const struct miss *misses, int n)
{
    struct pairs p = {.count = {0}};
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++) {
            double distance = delta_e_ab(misses[i].at, misses[j].at);
            int bin = bin_of(distance);
            if (bin >= BINS)
                continue;
            p.product[bin] += vec3_dot(misses[i].off, misses[j].off) / 3;
            p.distance[bin] += distance;
            p.count[bin]++;
        }
    return p;
}

// The variance and length of exp(-distance / length) nearest to the pairs' mean
// products, bins weighted by their pairs.
static void fit_smooth(const struct pairs *p, double total, double *variance, double *length)
{
    double best = INFINITY;
    *variance = 0;
    *length = LENGTHS[0];
    for (size_t k = 0; k < sizeof LENGTHS / sizeof *LENGTHS; k++) {
        double cross = 0, square = 0, left = 0;
        for (int b = 0; b < BINS; b++)
            if (p->count[b]) {
                double shape = exp(-p->distance[b] / (double)p->count[b] / LENGTHS[k]);
                cross += p->product[b] * shape;
                square += (double)p->count[b] * shape * shape;
            }
        double v = square > 0 ? fmin(fmax(cross / square, 0), total) : 0;
        for (int b = 0; b < BINS; b++)
            if (p->count[b]) {
                double shape = exp(-p->distance[b] / (double)p->count[b] / LENGTHS[k]);
                double off = p->product[b] / (double)p->count[b] - v * shape;
                left += (double)p->count[b] * off * off;
            }
        if (left < best) {
            best = left;
            *variance = v;
            *length = LENGTHS[k];
        }
    }
}

// Mean variance that the modes alone give the patches, a CIEDE2000 axis.
static double modes_variance(const struct measurements *m, const struct display_cross *cross,
                             const struct display_model *model, const struct display_uncertainty *u)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < m->count; i++) {
        if (!cross->scored[i])
            continue;
        double de00 = display_uncertainty_de00(u, model, m->patches[i].counts);
        sum += de00 * de00 / 3;
        n++;
    }
    return n ? sum / n : 0;
}

bool uncertainty_rest(const struct measurements *m, const struct display_cross *cross,
                      const struct display_model *model, struct display_uncertainty *out,
                      struct error *err)
{
    struct miss *misses = malloc(((size_t)m->count + 1) * sizeof *misses);
    double *room = malloc(((size_t)m->count + 1) * sizeof *room);
    if (!misses || !room) {
        free(misses);
        free(room);
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    }
    int n = find_misses(m, cross, model->kind, misses, room);
    double everywhere, neutral, smooth, noise = noise_variance(m);
    split(misses, n, &everywhere, &neutral);
    struct pairs pairs = pair_up(misses, n);
    fit_smooth(&pairs, everywhere, &smooth, &out->length_lab);
    out->smooth_de00 = out->local_de00 = 0; // leaves the modes alone
    double explained = modes_variance(m, cross, model, out);
    out->smooth_de00 = sqrt(fmax(smooth - explained, 0));
    out->local_de00 = sqrt(fmax(everywhere - fmax(smooth, explained), 0));
    out->neutral_de00 = sqrt(neutral);
    out->noise_de00 = sqrt(noise);
    free(misses);
    free(room);
    return true;
}
