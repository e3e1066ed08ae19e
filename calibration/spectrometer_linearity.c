// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/spectrometer.h"
#include "drivers/exposure.h"

enum { READINGS = 20, EXPOSURES = 8, LEAST = 3, PIXELS_LEAST = 10, LONGEST_US = 500000 };

static const double STRONG = 0.5; // of the highest count
static const double POOR = 0.005; // of counts per time
static const double WORTH_SAYING = 0.002;

// Pixels above half of the highest count of the longest exposure.
static int strong_pixels(const struct raw_counts *light, const struct raw_counts *dark, bool *used)
{
    const struct pixel_range a = light->detector.active;
    double most = 0;
    int count = 0;
    for (int i = a.first; i <= a.last; i++)
        most = fmax(most, light->mean[i] - dark->mean[i]);
    for (int i = a.first; i <= a.last; i++)
        count += used[i] = light->mean[i] - dark->mean[i] > STRONG * most;
    return count;
}

static bool comparable(const struct raw_counts *light, const struct raw_counts *dark, int count,
                       struct error *err)
{
    for (int i = 0; i < count; i++) {
        if (light[i].integration_us != dark[i].integration_us ||
            light[i].detector.pixels != light->detector.pixels ||
            dark[i].detector.pixels != light->detector.pixels)
            return fail(err, ERROR_DATA, "light of %d us and dark of %d us do not belong together",
                        light[i].integration_us, dark[i].integration_us);
        if (light[i].saturated)
            return fail(err, ERROR_DATA, "%d pixels are saturated at %d us", light[i].saturated,
                        light[i].integration_us);
    }
    return count >= LEAST || fail(err, ERROR_DATA, "%d exposures; at least %d", count, LEAST);
}

struct summed {
    double linear, above, variance;
};

static struct summed sum_of(const struct ocean_unit *unit, enum bend bend,
                            const struct raw_counts *light, const struct raw_counts *dark,
                            const bool *used)
{
    struct summed s = {0};
    double drift = raw_black(light) - raw_black(dark), common = 0;
    for (int i = 0; i < light->detector.pixels; i++) {
        if (!used[i])
            continue;
        double base = dark->mean[i] + drift;
        s.linear += ocean_linear_counts(unit, bend, light->mean[i], base, NULL);
        s.above += light->mean[i] - base;
        s.variance += light->deviation[i] * light->deviation[i] / light->readings;
        common += M_SQRT2 * raw_black_sigma(light, light->readings);
    }
    s.variance += common * common;
    return s;
}

static void judge_bend(const struct ocean_unit *unit, enum bend bend,
                       const struct raw_counts *light, const struct raw_counts *dark,
                       const bool *used, struct linearity_facts *f)
{
    double rate[LINEARITY_MOST], mean = 0, squares = 0;
    f->noise = 0;
    for (int i = 0; i < f->count; i++) {
        struct summed s = sum_of(unit, bend, &light[i], &dark[i], used);
        rate[i] = s.linear / light[i].integration_us;
        mean += rate[i] / f->count;
        f->part[i] = s.above / f->pixels / light[i].detector.saturation;
        f->noise += s.variance / (s.above * s.above) / f->count;
    }
    for (int i = 0; i < f->count; i++) {
        f->off[bend][i] = rate[i] / mean - 1;
        squares += f->off[bend][i] * f->off[bend][i] / f->count;
    }
    f->rms[bend] = sqrt(squares);
    f->noise = sqrt(f->noise);
}

bool linearity_judge(const struct raw_counts *light, const struct raw_counts *dark, int count,
                     struct linearity_facts *out, struct error *err)
{
    struct ocean_model model;
    struct linearity_facts f = {.count = count, .best = BEND_OFF};
    bool used[DETECTOR_PIXELS_MOST] = {false};
    int longest = 0;
    if (!comparable(light, dark, count, err))
        return false;
    for (int i = 0; i < count; i++) {
        f.integration_us[i] = light[i].integration_us;
        longest = light[i].integration_us > light[longest].integration_us ? i : longest;
    }
    f.pixels = strong_pixels(&light[longest], &dark[longest], used);
    if (f.pixels < PIXELS_LEAST)
        return fail(err, ERROR_DATA, "only %d pixels see light", f.pixels);
    struct ocean_unit unit = raw_unit(light, &model);
    for (int bend = BEND_OFF; bend >= BEND_ABOVE_DARK; bend--) {
        judge_bend(&unit, (enum bend)bend, light, dark, used, &f);
        if (f.rms[bend] < f.rms[f.best])
            f.best = bend;
    }
    *out = f;
    return true;
}

// ---- the command -----------------------------------------------------------

struct exposures {
    struct raw_counts light[LINEARITY_MOST], dark[LINEARITY_MOST], again;
};

// Eighths of the best exposure; whole mains periods where there are enough.
static bool choose(struct spectrometer_command *c, struct error *err)
{
    int best = 0;
    const struct exposure_limits limits = {c->settings.spectrometer.options.mains_hz, 10,
                                           LONGEST_US, 1};
    if (c->exposure_count >= LEAST)
        return true;
    if (c->exposure_count)
        return fail(err, ERROR_RANGE, "--exposure: %d of them; at least %d", c->exposure_count,
                    LEAST);
    if (!spectrometer_expose(c, LONGEST_US, &best, err))
        return false;
    bool periods = best >= EXPOSURES * 1e6 / limits.mains_hz;
    for (int i = 1; i <= EXPOSURES; i++) {
        int us = best / EXPOSURES * i;
        c->exposures[c->exposure_count++] = periods ? exposure_round(us, &limits) : us;
    }
    return true;
}

// Up and down again, so that a lamp that drifts evenly does no harm.
static bool measure(struct spectrometer_command *c, struct exposures *e, struct error *err)
{
    int n = c->exposure_count, readings = (c->readings ? c->readings : READINGS) / 2;
    for (int i = 0; i < n; i++) {
        if (!bench_raw(&c->bench, c->exposures[i], readings, &e->light[i], err))
            return false;
        bench_progress(&c->bench, "exposures", i + 1, 3 * n);
    }
    for (int i = n - 1; i >= 0; i--) {
        if (!bench_raw(&c->bench, c->exposures[i], readings, &e->again, err) ||
            !raw_join(&e->light[i], &e->again, err))
            return false;
        bench_progress(&c->bench, "exposures", 2 * n - i, 3 * n);
    }
    if (!bench_lid(&c->bench, true, err))
        return false;
    for (int i = 0; i < n; i++) {
        if (!bench_raw(&c->bench, c->exposures[i], 2 * readings, &e->dark[i], err))
            return false;
        bench_progress(&c->bench, "exposures", 2 * n + i + 1, 3 * n);
    }
    return true;
}

static const char *bend_name(int bend)
{
    return settings_find(spectrometer_settings, "nonlinearity")->choices[bend];
}

// What boothd uses now, or -1.
static int bend_in_use(struct spectrometer_command *c)
{
    json_t *status = bench_status(&c->bench, NULL);
    const json_t *rows = json_object_get(json_object_get(status, "settings"), "spectrometer");
    const char *name = json_string_value(json_object_get(rows, "nonlinearity"));
    int found = -1;
    for (int i = BEND_ABOVE_DARK; name && i <= BEND_OFF; i++)
        if (!strcmp(name, bend_name(i)))
            found = i;
    json_decref(status);
    return found;
}

static void doubt(const struct linearity_facts *f, int in_use, char warning[WARNING_SIZE])
{
    if (f->rms[f->best] > POOR)
        snprintf(warning, WARNING_SIZE,
                 "counts per time differ by %.2f %% (rms) at best: was the light steady?",
                 100 * f->rms[f->best]);
    else if (in_use >= 0 && f->rms[in_use] > f->rms[f->best] + WORTH_SAYING)
        snprintf(warning, WARNING_SIZE,
                 "nonlinearity = %s leaves %.2f %% (rms), %s only %.2f %%: put that into "
                 "[spectrometer]",
                 bend_name(in_use), 100 * f->rms[in_use], bend_name(f->best),
                 100 * f->rms[f->best]);
}

static void print_text(const struct linearity_facts *f, int in_use)
{
    printf("%d pixels; counts per time off their mean, %%\n%9s %9s", f->pixels, "us", "counts");
    for (int b = BEND_ABOVE_DARK; b <= BEND_OFF; b++)
        printf(" %12s", bend_name(b));
    for (int i = 0; i < f->count; i++) {
        printf("\n%9d %8.1f%%", f->integration_us[i], 100 * f->part[i]);
        for (int b = BEND_ABOVE_DARK; b <= BEND_OFF; b++)
            printf(" %+12.3f", 100 * f->off[b][i]);
    }
    printf("\n%19s", "rms");
    for (int b = BEND_ABOVE_DARK; b <= BEND_OFF; b++)
        printf(" %12.3f", 100 * f->rms[b]);
    printf("\n(noise alone: %.3f)\nbest: nonlinearity = %s%s\n", 100 * f->noise, bend_name(f->best),
           in_use == f->best ? ", as boothd's settings say" : "");
}

static void print_json(const struct linearity_facts *f, int in_use, const char *warning)
{
    json_t *rows = json_array();
    for (int i = 0; i < f->count; i++)
        json_array_append_new(rows, json_pack("{s:i, s:f, s:[f,f,f]}", "integration_us",
                                              f->integration_us[i], "part", f->part[i], "off",
                                              f->off[0][i], f->off[1][i], f->off[2][i]));
    json_t *all =
        json_pack("{s:[s,s,s], s:o, s:[f,f,f], s:f, s:i, s:s, s:s, s:s}", "ways", bend_name(0),
                  bend_name(1), bend_name(2), "exposures", rows, "rms", f->rms[0], f->rms[1],
                  f->rms[2], "noise", f->noise, "pixels", f->pixels, "best", bend_name(f->best),
                  "in_use", in_use < 0 ? "" : bend_name(in_use), "warning", warning);
    json_dumpf(all, stdout, JSON_INDENT(2));
    putchar('\n');
    json_decref(all);
}

static bool at_the_bench(struct spectrometer_command *c, struct exposures *e, struct error *err)
{
    struct error later = {0};
    bool fine = bench_light(&c->bench, c->lamp, "a steady, warm lamp on direct current", err) &&
                choose(c, err) && measure(c, e, err);
    return bench_lid(&c->bench, false, fine ? err : &later) && fine;
}

bool spectrometer_linearity(struct spectrometer_command *c, char *warning, struct error *err)
{
    struct linearity_facts f;
    if (c->readings && (c->readings < 2 || c->readings > RAW_READINGS_MOST / 2))
        return fail(err, ERROR_RANGE, "--readings: %d is outside 2..%d", c->readings,
                    RAW_READINGS_MOST / 2);
    struct exposures *e = calloc(1, sizeof *e);
    bool fine = (e || fail(err, ERROR_SYSTEM, "no memory for counts")) && at_the_bench(c, e, err) &&
                linearity_judge(e->light, e->dark, c->exposure_count, &f, err);
    free(e);
    if (!fine)
        return false;
    int in_use = bend_in_use(c);
    doubt(&f, in_use, warning);
    if (c->json)
        print_json(&f, in_use, warning);
    else
        print_text(&f, in_use);
    return true;
}
