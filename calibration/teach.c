// SPDX-License-Identifier: Apache-2.0
#include "calibration/teach.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "config/paths.h"

enum { WINDOW_READINGS = 6, PROBE_READINGS = 2, PROBES_MOST = 4096 };
static const double WINDOW_S = 3, WINDOW_GROWS = 1.5;

const struct teach_plan TEACH_WHOLE = {.drift = 0.005, .patience_s = 1800, .readings = 20};
const struct teach_plan TEACH_REHEARSAL = {.drift = 0.2, .patience_s = 120, .readings = 10};

// ---- stability -------------------------------------------------------------

static struct steadiness slope_over(const double *at_s, const double *lux, int n)
{
    struct line_fit line = line_through(at_s, lux, n);
    return (struct steadiness){.per_minute = 60 * line.slope / line.at_mean,
                               .per_minute_u = 60 * line.slope_u / line.at_mean,
                               .window_s = at_s[n - 1] - at_s[0]};
}

bool light_is_steady(const double *at_s, const double *lux, int n, const struct teach_plan *plan,
                     struct steadiness *out)
{
    double window_s = WINDOW_S;
    int first = n - 1;
    *out = (struct steadiness){.per_minute = NAN, .per_minute_u = NAN};
    while (first > 0) {
        while (first > 0 && (at_s[n - 1] - at_s[first] < window_s || n - first < WINDOW_READINGS))
            first--;
        double spans_s = at_s[n - 1] - at_s[first];
        if (spans_s < window_s || n - first < WINDOW_READINGS)
            break;
        *out = slope_over(at_s + first, lux + first, n - first);
        out->waited_s = at_s[n - 1] - at_s[0];
        if (fabs(out->per_minute) + 2 * out->per_minute_u <= plan->drift)
            return true;
        window_s = WINDOW_GROWS * spans_s;
    }
    return false;
}

static void show_wait(const struct bench *b, const char *lamp, const struct steadiness *s,
                      const struct teach_plan *plan, double waited_s, bool last)
{
    if (!b->terminal)
        return;
    fprintf(stderr, "\r\033[Klamp %s: ", lamp);
    if (isfinite(s->per_minute))
        fprintf(stderr, "%+.2f %% a minute (stands still within %g %%), ", 100 * s->per_minute,
                100 * plan->drift);
    fprintf(stderr, "%.0f s of at most %.0f s%s", waited_s, plan->patience_s, last ? "\n" : "");
}

static double seconds_since(int64_t began_ns)
{
    return (double)(clock_now_ns() - began_ns) / NS_PER_S;
}

// Half as many readings for twice as long, when there is no more room.
static int thin_out(double *at_s, double *lux, int n)
{
    for (int i = 0; i < n / 2; i++) {
        at_s[i] = at_s[2 * i + 1];
        lux[i] = lux[2 * i + 1];
    }
    return n / 2;
}

bool teach_await(struct bench *b, const char *lamp, const struct teach_plan *plan,
                 struct steadiness *out, struct error *err)
{
    double at_s[PROBES_MOST], lux[PROBES_MOST];
    int64_t began_ns = clock_now_ns();
    if (!bench_lamp(b, lamp, err))
        return false;
    for (int n = 0;;) {
        if (!bench_probe(b, lamp, PROBE_READINGS, &lux[n], err))
            return false;
        at_s[n++] = seconds_since(began_ns);
        bool steady = light_is_steady(at_s, lux, n, plan, out);
        bool late = at_s[n - 1] > plan->patience_s;
        show_wait(b, lamp, out, plan, at_s[n - 1], steady || late);
        if (steady)
            return true;
        if (late)
            return fail(err, ERROR_RETRY,
                        "lamp %s does not stand still within %.0f s: %.0f lx, %+.2f %% a minute "
                        "(uncertainty %.2f), wanted within %g",
                        lamp, plan->patience_s, lux[n - 1], 100 * out->per_minute,
                        100 * out->per_minute_u, 100 * plan->drift);
        if (n == PROBES_MOST)
            n = thin_out(at_s, lux, n);
    }
}

// ---- telling lamps apart ---------------------------------------------------

struct lamp_pair lamps_compare(const struct lamp *a, const struct lamp *b, double threshold)
{
    double one = lamp_limit(threshold, a->file.spread),
           other = lamp_limit(threshold, b->file.spread);
    struct lamp_pair p = {.distance = fmin(lamp_distance(&a->irradiance, &b->irradiance),
                                           lamp_distance(&b->irradiance, &a->irradiance)),
                          .limit = fmax(one, other)};
    p.likeness = p.distance <= p.limit       ? LAMPS_ALIKE
                 : p.distance <= one + other ? LAMPS_CLOSE
                                             : LAMPS_APART;
    return p;
}

static bool apart_from(const struct lamps *others, const struct lamp *lamp, double threshold,
                       char *close, size_t size, struct error *err)
{
    *close = 0;
    for (int i = 0; i < others->count; i++) {
        const struct lamp *other = &others->lamps[i];
        if (!strcmp(other->file.name, lamp->file.name))
            continue;
        struct lamp_pair p = lamps_compare(other, lamp, threshold);
        if (p.likeness == LAMPS_ALIKE)
            return fail(err, ERROR_DATA,
                        "lamp %s could not be told from the taught lamp %s: distance %.4f, "
                        "needed is more than %.4f; nothing was written",
                        lamp->file.name, other->file.name, p.distance, p.limit);
        size_t used = strlen(close);
        if (p.likeness == LAMPS_CLOSE)
            snprintf(close + used, size - used, "%s%s", used ? ", " : "", other->file.name);
    }
    return true;
}

// ---- teaching --------------------------------------------------------------

// The lamp drifts while the spots are read: the map belongs to the level at
// teaching, the spots to the mean of it and the level after them.
static bool allow_for_drift(struct bench *b, const char *name, struct teaching *t,
                            struct error *err)
{
    double lux;
    if (!bench_probe(b, name, PROBE_READINGS, &lux, err))
        return false;
    t->map_scale = t->spots.scale / ((1 + lux / t->taught.lux) / 2);
    return true;
}

static bool scale_map(struct bench *b, const struct booth_settings *s, const char *name,
                      const char *path, struct teaching *t, struct error *err)
{
    struct luminance_map map;
    if (!luminance_map_load(path, &s->ceiling, &map, err))
        return false;
    bool fine = spots_scale(b, name, &map, &t->spots, err);
    luminance_map_fini(&map);
    return fine ? allow_for_drift(b, name, t, err) : while_doing(err, "%s", path);
}

static const struct lamp *find(const struct lamps *lamps, const char *name)
{
    for (int i = 0; i < lamps->count; i++)
        if (!strcmp(lamps->lamps[i].file.name, name))
            return &lamps->lamps[i];
    return NULL;
}

// A map goes with the light it was taken in.
static void keep_map(const struct lamp *before, struct lamp *lamp, struct teaching *t)
{
    if (!before || !*before->file.map)
        return;
    memcpy(lamp->file.map, before->file.map, sizeof lamp->file.map);
    t->map_scale = before->file.map_scale * t->taught.lux / before->file.taught_lux;
    t->map_kept = true;
}

static struct lamp lamp_of(const char *name, const struct taught *taught, int readings)
{
    struct lamp lamp = {.file = {.spread = taught->spread,
                                 .map_scale = 1,
                                 .taught_lux = taught->lux,
                                 .readings = readings},
                        .irradiance = taught->irradiance};
    snprintf(lamp.file.name, sizeof lamp.file.name, "%s", name);
    snprintf(lamp.file.instrument, sizeof lamp.file.instrument, "%s", taught->instrument);
    clock_utc(lamp.file.taught_at);
    return lamp;
}

static bool teach_beside(struct bench *b, const struct booth_settings *s, const char *name,
                         const char *map, const struct lamps *others, const struct teach_plan *plan,
                         struct teaching *t, struct error *err)
{
    if (!teach_await(b, name, plan, &t->steadiness, err) ||
        !bench_teach(b, name, plan->readings, &t->taught, err))
        return false;
    struct lamp lamp = lamp_of(name, &t->taught, plan->readings);
    if (t->taught.lux < s->state.dark_lux)
        return fail(err, ERROR_DATA, "%.2f lx: below %g lx the booth counts as dark", t->taught.lux,
                    s->state.dark_lux);
    if (!apart_from(others, &lamp, s->state.lamp_distance, t->close, sizeof t->close, err))
        return false;
    if (!map)
        keep_map(find(others, name), &lamp, t);
    else if (!path_absolute(map, lamp.file.map, sizeof lamp.file.map, err) ||
             !scale_map(b, s, name, map, t, err))
        return false;
    lamp.file.map_scale = t->map_scale;
    return lamp_save(s->lamps.folder, &lamp, err);
}

bool teach_lamp(struct bench *b, const struct booth_settings *settings, const char *name,
                const char *map, const struct teach_plan *plan, struct teaching *out,
                struct error *err)
{
    struct lamps others = {0};
    const char *folder = settings->lamps.folder;
    *out = (struct teaching){.map_scale = 1};
    if (!lamp_name_fits(name, err) || (path_exists(folder) && !lamps_load(folder, &others, err)))
        return false;
    bool fine = teach_beside(b, settings, name, map, &others, plan, out, err);
    lamps_fini(&others);
    return fine || while_doing(err, "teaching lamp %s", name);
}
