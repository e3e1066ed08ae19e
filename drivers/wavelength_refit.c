// SPDX-License-Identifier: Apache-2.0
#include "drivers/wavelength_refit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PEAKS_MOST = 256,
    HALF_WIDTH = 3,
    HALF_WIDTH_MOST = 12,
    NEIGHBOURS = 12,
    SHIFT_STEPS = 50,
    ORDER = 4,
    AXIS_PIXELS_LEAST = 8
};

static const double shift_most_nm = 5, window_nm = 1, other_shift_nm = 2;
static const double least_part = 0.01, noise_times = 10, most_wide = 1.4;
static const double least_span_nm = 200, most_left_nm = 0.5, least_left_nm = 0.03;
static const double visible_nm[2] = {400, 700};

const double refit_mercury_argon[] = {253.652, 296.728, 302.150, 313.155, 334.148, 365.015,
                                      404.656, 407.783, 435.833, 546.074, 576.960, 579.066,
                                      696.543, 706.722, 738.398, 763.511, 772.376, 794.818,
                                      826.452, 842.465, 852.144, 866.794, 912.297, 0};

static double at(const double c[ORDER], double x)
{
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

// Median step between neighbours about a pixel but off its peak: noise, even
// where other lines stand near.
static double noise_about(const double *counts, int pixels, int peak)
{
    double steps[2 * (HALF_WIDTH + NEIGHBOURS)];
    int count = 0;
    for (int i = peak - HALF_WIDTH - NEIGHBOURS; i < peak + HALF_WIDTH + NEIGHBOURS; i++) {
        if (i < 1 || i >= pixels - 1 || (i > peak - 2 * HALF_WIDTH && i < peak + 2 * HALF_WIDTH))
            continue;
        double step = fabs(counts[i] - (counts[i - 1] + counts[i + 1]) / 2);
        int at_step = count++;
        for (; at_step > 0 && steps[at_step - 1] > step; at_step--)
            steps[at_step] = steps[at_step - 1];
        steps[at_step] = step;
    }
    return count ? steps[count / 2] : INFINITY;
}

static bool is_peak(const double *counts, int pixels, int i)
{
    for (int d = 1; d <= HALF_WIDTH; d++)
        if (!(counts[i] > counts[i - d]) || !(counts[i] >= counts[i + d]))
            return false;
    double foot = (counts[i - HALF_WIDTH] + counts[i + HALF_WIDTH]) / 2;
    return counts[i] - foot > noise_times * noise_about(counts, pixels, i);
}

static bool solve(double m[ORDER][ORDER + 1], double out[ORDER])
{
    for (int i = 0; i < ORDER; i++) {
        int pivot = i;
        for (int r = i + 1; r < ORDER; r++)
            if (fabs(m[r][i]) > fabs(m[pivot][i]))
                pivot = r;
        if (fabs(m[pivot][i]) < 1e-12)
            return false;
        for (int c = 0; c <= ORDER; c++) {
            double swap = m[i][c];
            m[i][c] = m[pivot][c];
            m[pivot][c] = swap;
        }
        for (int r = 0; r < ORDER; r++)
            for (int c = ORDER; r != i && c >= i; c--)
                m[r][c] -= m[r][i] / m[i][i] * m[i][c];
    }
    for (int i = 0; i < ORDER; i++)
        out[i] = m[i][ORDER] / m[i][i];
    return true;
}

static void add_normal(double normal[ORDER][ORDER + 1], const double power[ORDER], double value)
{
    for (int i = 0; i < ORDER; i++) {
        for (int j = 0; j < ORDER; j++)
            normal[i][j] += power[i] * power[j];
        normal[i][ORDER] += power[i] * value;
    }
}

// Vertex of the parabola through the logarithms of what stands above half of the
// peak, weighted by the counts' squares: exact for a Gaussian line (Guo 2011).
static double vertex(const double *counts, int pixels, int peak)
{
    double m[ORDER][ORDER + 1] = {0}, c[ORDER];
    const double half = counts[peak] / 2;
    int from = peak - 1, to = peak + 1;
    while (from > 0 && peak - from < HALF_WIDTH_MOST && counts[from - 1] > half)
        from--;
    while (to < pixels - 1 && to - peak < HALF_WIDTH_MOST && counts[to + 1] > half)
        to++;
    for (int i = from; i <= to; i++) {
        double y = fmax(counts[i], 1e-9), x = i - peak, power[ORDER] = {y, y * x, y * x * x, 0};
        add_normal(m, power, y * log(y / counts[peak]));
    }
    m[ORDER - 1][ORDER - 1] = 1;
    double off = solve(m, c) && c[2] < 0 ? -c[1] / (2 * c[2]) : 0;
    return peak + fmin(fmax(off, -1), 1);
}

static double least_between(const double *counts, int from, int to)
{
    double least = counts[from];
    for (int i = from; i <= to; i++)
        least = fmin(least, counts[i]);
    return least;
}

// Two lines that run into each other push each other's peaks aside.
static bool stands_alone(const double *counts, const int *at, int count, int which)
{
    const double half = counts[at[which]] / 2;
    return (which == 0 || least_between(counts, at[which - 1], at[which]) < half) &&
           (which == count - 1 || least_between(counts, at[which], at[which + 1]) < half);
}

// Where the counts cross half of the peak, from it towards step.
static double crossing(const double *counts, int pixels, int peak, int step)
{
    const double half = counts[peak] / 2;
    int i = peak;
    while (i + step >= 0 && i + step < pixels && counts[i + step] > half)
        i += step;
    int beyond = i + step;
    if (beyond < 0 || beyond >= pixels)
        return i;
    return i + step * (counts[i] - half) / (counts[i] - counts[beyond]);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// A lamp's lines are all as wide as the slit makes them: what is wider is more than one.
static int drop_wide(double *peaks, const double *widths, int count)
{
    double sorted[PEAKS_MOST];
    int kept = 0;
    memcpy(sorted, widths, sizeof *widths * (size_t)count);
    qsort(sorted, (size_t)count, sizeof *sorted, ascending);
    for (int i = 0; i < count; i++)
        if (widths[i] <= most_wide * sorted[count / 2])
            peaks[kept++] = peaks[i];
    return kept;
}

static int find_peaks(const double *counts, int pixels, double peaks[PEAKS_MOST])
{
    double most = 0, widths[PEAKS_MOST];
    int at[PEAKS_MOST], count = 0, alone = 0;
    for (int i = 0; i < pixels; i++)
        most = fmax(most, counts[i]);
    for (int i = HALF_WIDTH; i < pixels - HALF_WIDTH && count < PEAKS_MOST; i++)
        if (counts[i] > least_part * most && is_peak(counts, pixels, i))
            at[count++] = i;
    for (int i = 0; i < count; i++) {
        if (!stands_alone(counts, at, count, i))
            continue;
        widths[alone] = crossing(counts, pixels, at[i], 1) - crossing(counts, pixels, at[i], -1);
        peaks[alone++] = vertex(counts, pixels, at[i]);
    }
    return drop_wide(peaks, widths, alone);
}

struct matches {
    double pixel[REFIT_LINES_MOST], nm[REFIT_LINES_MOST];
    int count;
    double off; // sum of squares
};

static void match(const double old[ORDER], double shift, const double *peaks, int peak_count,
                  const double *lines, struct matches *out)
{
    *out = (struct matches){0};
    for (int l = 0; lines[l] > 0 && out->count < REFIT_LINES_MOST; l++) {
        int found = 0, which = 0;
        for (int p = 0; p < peak_count; p++)
            if (fabs(at(old, peaks[p]) + shift - lines[l]) <= window_nm) {
                found++;
                which = p;
            }
        if (found != 1)
            continue;
        double off = at(old, peaks[which]) + shift - lines[l];
        out->pixel[out->count] = peaks[which];
        out->nm[out->count++] = lines[l];
        out->off += off * off;
    }
}

static bool better(const struct matches *a, const struct matches *b)
{
    return a->count > b->count || (a->count == b->count && a->off < b->off);
}

static bool best_shift(const double old[ORDER], const double *peaks, int peak_count,
                       const double *lines, struct matches *best, double *shift, struct error *err)
{
    struct matches rival = {0}, tried;
    *best = rival;
    *shift = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int s = -SHIFT_STEPS; s <= SHIFT_STEPS; s++) {
            double by = s * shift_most_nm / SHIFT_STEPS;
            match(old, by, peaks, peak_count, lines, &tried);
            if (pass == 0 && better(&tried, best)) {
                *best = tried;
                *shift = by;
            }
            if (pass == 1 && fabs(by - *shift) > other_shift_nm && better(&tried, &rival))
                rival = tried;
        }
    if (best->count < REFIT_LINES_LEAST)
        return fail(err, ERROR_DATA, "%d of the lamp's lines found among %d peaks; at least %d",
                    best->count, peak_count, REFIT_LINES_LEAST);
    return rival.count < best->count ||
           fail(err, ERROR_DATA, "ambiguous: two shifts of the axis match %d lines each",
                best->count);
}

// On -1..1, where powers stay apart.
static void powers(double pixel, int pixels, double out[ORDER])
{
    double x = 2 * pixel / pixels - 1;
    for (int i = 0; i < ORDER; i++)
        out[i] = i ? out[i - 1] * x : 1;
}

// As a correction of the old axis.
static bool fit(const double *pixel, const double *nm, int count, const double old[ORDER],
                int pixels, double out[ORDER])
{
    double normal[ORDER][ORDER + 1] = {0}, power[ORDER], more[ORDER];
    const double half = pixels / 2.0;
    for (int k = 0; k < count; k++) {
        powers(pixel[k], pixels, power);
        add_normal(normal, power, nm[k] - at(old, pixel[k]));
    }
    if (!solve(normal, more))
        return false;
    const double a = more[0], b = more[1], c = more[2], d = more[3];
    out[0] = old[0] + a - b + c - d;
    out[1] = old[1] + (b - 2 * c + 3 * d) / half;
    out[2] = old[2] + (c - 3 * d) / (half * half);
    out[3] = old[3] + d / (half * half * half);
    return true;
}

static bool take_lines(const struct matches *m, const double old[ORDER], struct refit *r,
                       struct error *err)
{
    double sum = 0;
    r->lines = m->count;
    for (int k = 0; k < m->count; k++) {
        double is = at(r->wavelength, m->pixel[k]), off = is - m->nm[k];
        r->line[k] = (struct refit_line){m->nm[k], m->pixel[k], at(old, m->pixel[k]), off};
        if (!(fabs(off) <= most_left_nm))
            return fail(err, ERROR_DATA, "the line at %g nm is left %.2f nm off", m->nm[k], off);
        sum += off * off;
    }
    r->rms_nm = sqrt(sum / m->count);
    return true;
}

static bool check_axis(const struct refit *r, struct error *err)
{
    for (int i = 0; i < r->pixels; i++) {
        double nm = at(r->wavelength, i);
        if (!(at(r->wavelength, i + 0.5) > at(r->wavelength, i - 0.5)))
            return fail(err, ERROR_DATA, "fitted wavelengths do not ascend at pixel %d", i);
        if (nm >= visible_nm[0] && nm <= visible_nm[1] && refit_sigma(r, i) > most_left_nm)
            return fail(err, ERROR_DATA,
                        "the %d lines found leave the axis uncertain by %.1f nm at %.0f nm",
                        r->lines, refit_sigma(r, i), nm);
    }
    return true;
}

bool refit_wavelengths(const double *counts, int pixels, const double old[4],
                       const double *lines_nm, struct refit *out, struct error *err)
{
    double peaks[PEAKS_MOST];
    struct matches m;
    struct refit r = {.pixels = pixels};
    int peak_count = find_peaks(counts, pixels, peaks);
    if (!best_shift(old, peaks, peak_count, lines_nm, &m, &r.shift_nm, err))
        return false;
    double span = m.nm[m.count - 1] - m.nm[0];
    if (span < least_span_nm)
        return fail(err, ERROR_DATA, "the %d lines found span %.0f nm; at least %.0f nm", m.count,
                    span, least_span_nm);
    if (!fit(m.pixel, m.nm, m.count, old, pixels, r.wavelength))
        return fail(err, ERROR_DATA, "the %d lines found do not fix the axis", m.count);
    if (!take_lines(&m, old, &r, err) || !check_axis(&r, err))
        return false;
    *out = r;
    return true;
}

double refit_nm(const double wavelength[4], double pixel)
{
    return at(wavelength, pixel);
}

// Variance of the residuals times p' (P'P)^-1 p.
double refit_sigma(const struct refit *r, double pixel)
{
    double normal[ORDER][ORDER + 1] = {0}, power[ORDER], here[ORDER], solved[ORDER], spread = 0;
    powers(pixel, r->pixels, here);
    for (int k = 0; k < r->lines; k++) {
        powers(r->line[k].pixel, r->pixels, power);
        add_normal(normal, power, 0);
    }
    for (int i = 0; i < ORDER; i++)
        normal[i][ORDER] = here[i];
    if (r->lines <= ORDER || !solve(normal, solved))
        return INFINITY;
    for (int i = 0; i < ORDER; i++)
        spread += here[i] * solved[i];
    double left = r->rms_nm * sqrt((double)r->lines / (r->lines - ORDER));
    return fmax(left, least_left_nm) * sqrt(fmax(spread, 0));
}

bool refit_axis(const double *nm, int pixels, double out[4], double *worst_nm, struct error *err)
{
    const double none[ORDER] = {0};
    double *pixel = calloc(pixels > 0 ? (size_t)pixels : 1, sizeof *pixel), worst = 0;
    for (int i = 0; pixel && i < pixels; i++)
        pixel[i] = i;
    bool fits = pixel && pixels >= AXIS_PIXELS_LEAST && fit(pixel, nm, pixels, none, pixels, out);
    free(pixel);
    if (!fits)
        return fail(err, ERROR_DATA, "%d wavelengths are no axis", pixels);
    for (int i = 0; i < pixels; i++)
        worst = fmax(worst, fabs(at(out, i) - nm[i]));
    *worst_nm = worst;
    return true;
}
