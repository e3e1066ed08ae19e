// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/spectrometer.h"
#include "calibration/statistics.h"
#include "config/paths.h"
#include "files/write.h"

enum { PARTS = 16, READINGS = 20, HOLD_READINGS = 2, LINE_PIXELS = 5 };

static const double SEEN = 5e-4; // of saturation: a thousandth of the peak's light
static const double LEAK_PATTERN = 0.1, LINE_PATTERN = 0.25; // of the dark current
static const double SIGMAS = 6;                              // of noise, never by chance
static const double MEDIAN_NOISE = 1.2533; // of a median over that of a mean, normal noise
static const int PRESET_US[] = {1000, 10000, 50000, 100000};

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_of(const double *values, int count)
{
    double sorted[DETECTOR_PIXELS_MOST];
    memcpy(sorted, values, sizeof *values * (size_t)count);
    qsort(sorted, (size_t)count, sizeof *sorted, ascending);
    return percentile(sorted, count, 50);
}

// Level above black in the second half of the readings less that in the first.
static double drift_of(const struct raw_counts *d)
{
    int half = d->readings / 2;
    double sum = 0;
    for (int i = 0; i < half; i++) {
        int late = d->readings - half + i;
        sum += (d->active[late] - d->black[late]) - (d->active[i] - d->black[i]);
    }
    return half ? sum / half : 0;
}

// What noise of a median of so many pixels may come to.
static double chance(const struct raw_counts *dark, double noise, int pixels)
{
    return SIGMAS * MEDIAN_NOISE * noise / sqrt((double)pixels * dark->readings);
}

static void judge_leak(const struct raw_counts *dark, struct dark_facts *f)
{
    const struct detector *d = &dark->detector;
    int all = d->active.last - d->active.first + 1, size = all / PARTS > 0 ? all / PARTS : 1;
    double least = INFINITY, most = -INFINITY;
    for (int first = d->active.first; first + size - 1 <= d->active.last; first += size) {
        double median = median_of(dark->mean + first, size);
        least = fmin(least, median);
        if (median > most)
            f->leak_nm = refit_nm(d->wavelength, first + (size - 1) / 2.0);
        most = fmax(most, median);
    }
    f->leak = most - least;
    f->leak_limit = fmax(fmax(SEEN * d->saturation, LEAK_PATTERN * fabs(f->level - f->black)),
                         chance(dark, f->noise, size));
}

static void judge_line(const struct raw_counts *dark, struct dark_facts *f)
{
    const struct detector *d = &dark->detector;
    const struct pixel_range a = d->active;
    double all = median_of(dark->mean + a.first, a.last - a.first + 1), most = all;
    for (int i = a.first; i + LINE_PIXELS - 1 <= a.last; i++) {
        double median = median_of(dark->mean + i, LINE_PIXELS);
        if (median > most)
            f->line_nm = refit_nm(d->wavelength, i + LINE_PIXELS / 2);
        most = fmax(most, median);
    }
    f->line = most - all;
    f->line_limit = fmax(fmax(SEEN * d->saturation, LINE_PATTERN * fabs(all - f->black)),
                         chance(dark, f->noise, LINE_PIXELS));
}

void dark_judge(const struct raw_counts *dark, struct dark_facts *f)
{
    const struct detector *d = &dark->detector;
    *f = (struct dark_facts){.black = raw_black(dark), .noise = raw_noise(dark)};
    for (int i = 0; i < dark->readings; i++)
        f->level += dark->active[i] / dark->readings;
    int half = dark->readings / 2;
    f->drift = drift_of(dark);
    f->drift_limit =
        fmax(SEEN * d->saturation, SIGMAS * M_SQRT2 * raw_black_sigma(dark, half ? half : 1));
    judge_leak(dark, f);
    judge_line(dark, f);
    f->saturated = dark->saturated > 0;
    f->unsteady = fabs(f->drift) > f->drift_limit;
    f->illuminated = f->leak > f->leak_limit || f->line > f->line_limit;
}

static bool belong_together(const struct raw_counts *darks, int count, struct error *err)
{
    for (int i = 1; i < count; i++)
        if (darks[i].integration_us <= darks[i - 1].integration_us ||
            darks[i].detector.pixels != darks[0].detector.pixels ||
            strcmp(darks[i].instrument, darks[0].instrument))
            return fail(err, ERROR_RANGE, "darks of %s at %d us and of %s at %d us are no series",
                        darks[i - 1].instrument, darks[i - 1].integration_us, darks[i].instrument,
                        darks[i].integration_us);
    return true;
}

bool darks_save(const char *path, const struct raw_counts *darks, int count, struct error *err)
{
    struct whole_file file;
    if (!belong_together(darks, count, err) || !whole_file_begin(&file, path, err))
        return false;
    fprintf(file.stream, "# stored darks of %s%s, %s\n", darks->instrument,
            darks->emulated ? " (emulated)" : "", darks->taken_at);
    for (int i = 0; i < count; i++)
        fprintf(file.stream, "%sus%dx%d", i ? "," : "", darks[i].integration_us, darks[i].readings);
    fputc('\n', file.stream);
    for (int p = 0; p < darks->detector.pixels; p++)
        for (int i = 0; i < count; i++)
            fprintf(file.stream, "%.9g%c", darks[i].mean[p], i + 1 < count ? ',' : '\n');
    return whole_file_commit(&file, err);
}

// ---- the command -----------------------------------------------------------

struct dark_series {
    struct raw_counts of[LINEARITY_MOST];
    struct dark_facts facts[LINEARITY_MOST];
    int count;
};

static int ascending_whole(const void *a, const void *b)
{
    return *(const int *)a - *(const int *)b;
}

// The longest that boothd chooses itself, and some below it.
static bool preset_exposures(struct spectrometer_command *c, struct error *err)
{
    json_t *status = bench_status(&c->bench, err);
    const json_t *settings = json_object_get(status, "settings");
    const json_t *rows = json_object_get(settings, "spectrometer");
    const char *longest = json_string_value(json_object_get(rows, "longest_us"));
    int most = longest ? atoi(longest) : 0;
    json_decref(status);
    if (!status)
        return false;
    if (most <= 0)
        return fail(err, ERROR_DATA, "boothd's status tells no spectrometer.longest_us");
    for (size_t i = 0; i < sizeof PRESET_US / sizeof *PRESET_US; i++)
        if (PRESET_US[i] < most)
            c->exposures[c->exposure_count++] = PRESET_US[i];
    c->exposures[c->exposure_count++] = most;
    return true;
}

static bool measure(struct spectrometer_command *c, struct dark_series *s, struct error *err)
{
    qsort(c->exposures, (size_t)c->exposure_count, sizeof *c->exposures, ascending_whole);
    for (int i = 0; i < c->exposure_count; i++) {
        struct raw_counts *d = &s->of[s->count];
        if (!bench_raw(&c->bench, c->exposures[i], c->readings ? c->readings : READINGS, d, err))
            return false;
        bench_progress(&c->bench, "darks", i + 1, c->exposure_count);
        // Shorter ones than the instrument holds all come as its shortest.
        if (s->count && d->integration_us <= s->of[s->count - 1].integration_us)
            continue;
        dark_judge(d, &s->facts[s->count++]);
    }
    return true;
}

static void doubt(const struct dark_series *s, char warning[WARNING_SIZE])
{
    for (int i = 0; i < s->count; i++) {
        const struct dark_facts *f = &s->facts[i];
        int us = s->of[i].integration_us;
        if (f->saturated || f->illuminated) {
            bool line = f->line / f->line_limit > f->leak / f->leak_limit;
            snprintf(
                warning, WARNING_SIZE,
                "the dark of %d us looks illuminated: %s%.0f counts more about %.0f nm than "
                "elsewhere (%.0f at most); keep all light out and measure again before you use "
                "it",
                us, f->saturated ? "saturated, " : "", line ? f->line : f->leak,
                line ? f->line_nm : f->leak_nm, line ? f->line_limit : f->leak_limit);
            return;
        }
        if (f->unsteady)
            snprintf(warning, WARNING_SIZE,
                     "the dark of %d us drifted by %.1f counts while it was measured (%.1f at "
                     "most): let the spectrometer warm up",
                     us, f->drift, f->drift_limit);
    }
}

static void print_text(const struct dark_series *s)
{
    printf("%9s %8s %8s %8s %7s %7s %7s %7s\n", "us", "readings", "level", "black", "noise",
           "drift", "leak", "line");
    for (int i = 0; i < s->count; i++) {
        const struct dark_facts *f = &s->facts[i];
        printf("%9d %8d %8.1f %8.1f %7.1f %+7.1f %7.1f %7.1f%s\n", s->of[i].integration_us,
               s->of[i].readings, f->level, f->black, f->noise, f->drift, f->leak, f->line,
               f->saturated || f->illuminated ? "  illuminated?"
               : f->unsteady                  ? "  unsteady"
                                              : "");
    }
}

static void print_json(const struct dark_series *s, const char *path, const char *warning)
{
    json_t *darks = json_array();
    for (int i = 0; i < s->count; i++) {
        const struct dark_facts *f = &s->facts[i];
        json_array_append_new(
            darks,
            json_pack(
                "{s:i, s:i, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:b, s:b, s:b}",
                "integration_us", s->of[i].integration_us, "readings", s->of[i].readings, "level",
                f->level, "black", f->black, "noise", f->noise, "drift", f->drift, "drift_limit",
                f->drift_limit, "leak", f->leak, "leak_limit", f->leak_limit, "leak_nm", f->leak_nm,
                "line", f->line, "line_limit", f->line_limit, "line_nm", f->line_nm, "saturated",
                f->saturated, "unsteady", f->unsteady, "illuminated", f->illuminated));
    }
    json_t *all =
        json_pack("{s:s, s:b, s:s, s:o, s:s}", "instrument", s->of->instrument, "emulated",
                  s->of->emulated, "file", path, "darks", darks, "warning", warning);
    json_dumpf(all, stdout, JSON_INDENT(2));
    putchar('\n');
    json_decref(all);
}

// The lid is opened again whatever happened.
static bool under_the_lid(struct spectrometer_command *c, struct dark_series *s, struct error *err)
{
    struct error later = {0};
    bool fine = bench_lid(&c->bench, true, err) && measure(c, s, err);
    return bench_lid(&c->bench, false, fine ? err : &later) && fine;
}

bool spectrometer_dark(struct spectrometer_command *c, char *warning, struct error *err)
{
    char path[512];
    struct dark_series *s = calloc(1, sizeof *s);
    bool fine = s || fail(err, ERROR_SYSTEM, "no memory for darks");
    fine = fine &&
           (!c->readings || c->readings >= HOLD_READINGS ||
            fail(err, ERROR_RANGE, "--readings: noise and drift need %d at least", HOLD_READINGS));
    fine = fine && path_absolute(c->out, path, sizeof path, err) &&
           (c->exposure_count || preset_exposures(c, err)) && under_the_lid(c, s, err) &&
           darks_save(path, s->of, s->count, err);
    if (fine) {
        doubt(s, warning);
        if (c->json)
            print_json(s, path, warning);
        else {
            print_text(s);
            printf("\nFor boothd's settings; they count from its next start on:\n[spectrometer]\n"
                   "darks = %s\n",
                   path);
        }
    }
    free(s);
    return fine;
}
