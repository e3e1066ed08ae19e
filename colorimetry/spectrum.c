// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/spectrum.h"

#include <math.h>

#define STEP_SLACK_NM 1e-3 // rounding of printed wavelengths
#define SPRAGUE_LEAST_NM 2.0
#define SPRAGUE_MOST_NM 20.0
#define VISIBLE_FIRST_NM 400.0
#define VISIBLE_LAST_NM 700.0

enum { SPRAGUE_POINTS = 6 };

struct samples {
    const double *nm, *values;
    size_t count;
};

static bool check(const struct samples *s, struct error *err)
{
    if (s->count < 2)
        return fail(err, ERROR_DATA, "%zu sample(s) make no spectrum; at least 2 are needed",
                    s->count);
    for (size_t i = 0; i < s->count; i++) {
        if (!isfinite(s->nm[i]))
            return fail(err, ERROR_DATA, "wavelength %zu is not a finite number", i + 1);
        if (!isfinite(s->values[i]))
            return fail(err, ERROR_DATA, "the value at %g nm (sample %zu) is not a finite number",
                        s->nm[i], i + 1);
        if (i > 0 && s->nm[i] <= s->nm[i - 1])
            return fail(err, ERROR_DATA,
                        "wavelength %g nm (sample %zu) does not follow %g nm; wavelengths must "
                        "rise",
                        s->nm[i], i + 1, s->nm[i - 1]);
    }
    if (s->nm[0] > VISIBLE_LAST_NM || s->nm[s->count - 1] < VISIBLE_FIRST_NM)
        return fail(err, ERROR_DATA, "wavelengths %g..%g miss %g..%g nm; are they nanometres?",
                    s->nm[0], s->nm[s->count - 1], VISIBLE_FIRST_NM, VISIBLE_LAST_NM);
    return true;
}

static bool equal_steps(const struct samples *s)
{
    double step = (s->nm[s->count - 1] - s->nm[0]) / (double)(s->count - 1);
    if (step < SPRAGUE_LEAST_NM - STEP_SLACK_NM || step > SPRAGUE_MOST_NM + STEP_SLACK_NM)
        return false;
    for (size_t i = 1; i < s->count; i++)
        if (fabs(s->nm[i] - (s->nm[0] + step * (double)i)) > STEP_SLACK_NM)
            return false;
    return true;
}

static bool finer_than_grid(const struct samples *s)
{
    for (size_t i = 1; i < s->count; i++)
        if (s->nm[i] - s->nm[i - 1] < 1 - STEP_SLACK_NM)
            return true;
    return false;
}

static double end_value(const struct samples *s, double nm, bool held)
{
    if (!held)
        return 0;
    return nm < s->nm[0] ? s->values[0] : s->values[s->count - 1];
}

// A value of the samples continued by two points at each end (CIE 167:2005).
static double sprague_point(const struct samples *s, long i)
{
    static const double BEYOND[2][SPRAGUE_POINTS] = {
        {508, -540, 488, -367, 144, -24},     // one step beyond the end
        {884, -1960, 3033, -2648, 1080, -180} // two steps
    };
    long n = (long)s->count;
    if (i >= 0 && i < n)
        return s->values[i];
    long beyond = i < 0 ? -i : i - n + 1;
    double sum = 0;
    for (int k = 0; k < SPRAGUE_POINTS; k++)
        sum += BEYOND[beyond - 1][k] * s->values[i < 0 ? k : n - 1 - k];
    return sum / 209;
}

static double sprague(const struct samples *s, long i, double t)
{
    double a = sprague_point(s, i - 2), b = sprague_point(s, i - 1), c = s->values[i];
    double d = s->values[i + 1], e = sprague_point(s, i + 2), f = sprague_point(s, i + 3);
    double k1 = 2 * a - 16 * b + 16 * d - 2 * e;
    double k2 = -a + 16 * b - 30 * c + 16 * d - e;
    double k3 = -9 * a + 39 * b - 70 * c + 66 * d - 33 * e + 7 * f;
    double k4 = 13 * a - 64 * b + 126 * c - 124 * d + 61 * e - 12 * f;
    double k5 = -5 * a + 25 * b - 50 * c + 50 * d - 25 * e + 5 * f;
    return c + t * (k1 + t * (k2 + t * (k3 + t * (k4 + t * k5)))) / 24;
}

// Lagrange through the up to four samples nearest to the interval.
static double lagrange(const struct samples *s, long i, double t)
{
    long points = s->count < 4 ? (long)s->count : 4;
    long first = i - 1 < 0 ? 0 : i - 1;
    if (first + points > (long)s->count)
        first = (long)s->count - points;
    double at = (double)(i - first) + t, sum = 0;
    for (long j = 0; j < points; j++) {
        double weight = 1;
        for (long k = 0; k < points; k++)
            if (k != j)
                weight *= (at - (double)k) / (double)(j - k);
        sum += weight * s->values[first + j];
    }
    return sum;
}

// Grid points between two samples.
struct run {
    size_t first, count;
    double kept, wanted; // sums: of the positive values, and what it should be
};

static void cut_undershoots(struct spectrum *s, struct run *runs, size_t count)
{
    for (struct run *r = runs; r < runs + count; r++) {
        for (size_t g = r->first; g < r->first + r->count; g++) {
            r->wanted += s->v[g];
            s->v[g] = fmax(s->v[g], 0);
            r->kept += s->v[g];
        }
    }
}

// A run below zero as a whole is paid for by the brighter of its neighbours:
// the peak beside which it undershoots.
static void pay_for_undershoots(struct run *runs, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (runs[i].wanted >= 0)
            continue;
        double before = i > 0 ? runs[i - 1].wanted : 0;
        double after = i + 1 < count ? runs[i + 1].wanted : 0;
        if (before > 0 && before >= after)
            runs[i - 1].wanted += runs[i].wanted;
        else if (after > 0)
            runs[i + 1].wanted += runs[i].wanted;
        runs[i].wanted = 0;
    }
}

// No power below zero, and the energy of the lamp as it was.
static void keep_positive(struct spectrum *s, struct run *runs, size_t count)
{
    cut_undershoots(s, runs, count);
    pay_for_undershoots(runs, count);
    for (struct run *r = runs; r < runs + count; r++) {
        double scale = r->kept > 0 ? fmax(r->wanted, 0) / r->kept : 0;
        for (size_t g = r->first; g < r->first + r->count && r->wanted != r->kept; g++)
            s->v[g] *= scale;
    }
}

static bool nowhere_negative(const struct samples *s)
{
    for (size_t i = 0; i < s->count; i++)
        if (s->values[i] < 0)
            return false;
    return true;
}

static void interpolate_smooth(const struct samples *s, bool held, struct spectrum *out)
{
    struct run runs[SPECTRUM_COUNT] = {{0}};
    long last = (long)s->count - 1, interval = -1;
    size_t count = 0;
    double step = (s->nm[last] - s->nm[0]) / (double)last;
    for (size_t g = 0; g < SPECTRUM_COUNT; g++) {
        double nm = SPECTRUM_FIRST_NM + (double)g, at = (nm - s->nm[0]) / step;
        long i = (long)floor(at + STEP_SLACK_NM);
        double t = at - (double)i;
        if (i < 0 || i > last || (i == last && t > STEP_SLACK_NM)) {
            out->v[g] = end_value(s, nm, held);
        } else if (t < STEP_SLACK_NM) {
            out->v[g] = s->values[i];
        } else {
            out->v[g] = s->count < SPRAGUE_POINTS ? lagrange(s, i, t) : sprague(s, i, t);
            if (i != interval)
                runs[count++].first = g;
            runs[count - 1].count++;
            interval = i;
        }
    }
    if (nowhere_negative(s))
        keep_positive(out, runs, count);
}

static void interpolate_linear(const struct samples *s, bool held, struct spectrum *out)
{
    size_t i = 0;
    for (size_t g = 0; g < SPECTRUM_COUNT; g++) {
        double nm = SPECTRUM_FIRST_NM + (double)g;
        while (i + 2 < s->count && s->nm[i + 1] <= nm)
            i++;
        double t = (nm - s->nm[i]) / (s->nm[i + 1] - s->nm[i]);
        if (nm < s->nm[0] || nm > s->nm[s->count - 1])
            out->v[g] = end_value(s, nm, held);
        else
            out->v[g] = s->values[i] + t * (s->values[i + 1] - s->values[i]);
    }
}

// Integral of the straight line between samples i and i + 1 over [from, to].
static double area(const struct samples *s, size_t i, double from, double to)
{
    double slope = (s->values[i + 1] - s->values[i]) / (s->nm[i + 1] - s->nm[i]);
    return (to - from) * (s->values[i] + slope * ((from + to) / 2 - s->nm[i]));
}

static void bin_finer(const struct samples *s, bool held, struct spectrum *out)
{
    double first = s->nm[0], last = s->nm[s->count - 1];
    size_t i = 0;
    for (size_t g = 0; g < SPECTRUM_COUNT; g++) {
        double low = SPECTRUM_FIRST_NM + (double)g - 0.5, high = low + 1, sum = 0;
        while (i + 2 < s->count && s->nm[i + 1] <= low)
            i++;
        for (size_t k = i; k + 1 < s->count && s->nm[k] < high; k++) {
            double from = fmax(low, s->nm[k]), to = fmin(high, s->nm[k + 1]);
            if (to > from)
                sum += area(s, k, from, to);
        }
        sum += fmax(fmin(high, first) - low, 0) * end_value(s, first - 1, held);
        sum += fmax(high - fmax(low, last), 0) * end_value(s, last + 1, held);
        out->v[g] = sum;
    }
}

bool spectrum_from_samples(const double *nm, const double *values, size_t count, bool held,
                           struct spectrum *out, struct error *err)
{
    struct samples s = {nm, values, count};
    if (!check(&s, err))
        return false;
    if (equal_steps(&s))
        interpolate_smooth(&s, held, out);
    else if (finer_than_grid(&s))
        bin_finer(&s, held, out);
    else
        interpolate_linear(&s, held, out);
    return true;
}

double spectrum_sum(const struct spectrum *s)
{
    double sum = 0;
    for (size_t i = 0; i < SPECTRUM_COUNT; i++)
        sum += s->v[i];
    return sum;
}

void spectrum_scale(struct spectrum *s, double k)
{
    for (size_t i = 0; i < SPECTRUM_COUNT; i++)
        s->v[i] *= k;
}
