// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/session.h"
#include "config/lamps.h"

enum { TEACH_READINGS = 10, PROBE_READINGS = 2, STEADY_ATTEMPTS = 50, GRID = 24, CANDIDATES = 2 * GRID * GRID };
static const double STEADY = 0.005;    // relative change of illuminance between two short readings
static const double SPOT_M = 0.010;    // what the radiometer sees of the ceiling
static const double BESIDE_M = 0.005; // twice what aiming may be off
static const double ALIKE = 0.02;     // four times the noise of a map's spot mean
static const double AGREE = 0.02;     // spots that scale the map more differently contradict each other
static const double APART_M = 0.02;   // spots apart, so that they are of different pixels
static const double STEP_DOWN = 0.6;  // of a luminance that overloaded the radiometer

static bool steady_light(struct session *s, const char *lamp, struct error *err)
{
    struct taught now = {.lux = 0};
    for (int attempt = 0; attempt < STEADY_ATTEMPTS; attempt++) {
        double before = now.lux;
        if (!bench_teach(&s->bench, lamp, PROBE_READINGS, &now, err))
            return false;
        if (before > 0 && fabs(now.lux / before - 1) < STEADY)
            return true;
    }
    return fail(err, ERROR_RETRY, "lamp %s does not become steady; now %.0f lx", lamp, now.lux);
}

struct spot {
    double x_m, z_m, map_cdm2;
};

static int brighter_first(const void *a, const void *b)
{
    double x = ((const struct spot *)a)->map_cdm2, y = ((const struct spot *)b)->map_cdm2;
    return (x < y) - (x > y);
}

// Largest relative difference between a place and its four neighbours: the
// middle of a slope is as bright as its surroundings, but not even.
static double unevenness(const struct luminance_map *map, const struct spot *p)
{
    static const int SIDES[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    double most = 0;
    for (int i = 0; i < 4; i++) {
        double side = luminance_map_spot(map, p->x_m + SIDES[i][0] * BESIDE_M,
                                         p->z_m + SIDES[i][1] * BESIDE_M, SPOT_M);
        most = fmax(most, fabs(side / p->map_cdm2 - 1));
    }
    return most;
}

// Even places, so that aiming a little beside them does no harm; the brightest
// first. Returns how many.
static int even_places(const struct luminance_map *map, struct spot places[CANDIDATES])
{
    const struct ceiling *c = &map->ceiling;
    int n = 0;
    for (int j = 0; j < GRID; j++) {
        for (int i = 0; i < 2 * GRID; i++) {
            struct spot p = {.x_m = c->centre_m[0] + c->width_m * ((i + 0.5) / (2 * GRID) - 0.5),
                             .z_m = c->centre_m[2] + c->depth_m * ((j + 0.5) / GRID - 0.5)};
            p.map_cdm2 = luminance_map_spot(map, p.x_m, p.z_m, SPOT_M);
            if (p.map_cdm2 > 0 && unevenness(map, &p) < ALIKE)
                places[n++] = p;
        }
    }
    qsort(places, (size_t)n, sizeof *places, brighter_first);
    return n;
}

static bool far_from(const struct spot *taken, int count, const struct spot *place)
{
    for (int i = 0; i < count; i++)
        if (hypot(taken[i].x_m - place->x_m, taken[i].z_m - place->z_m) < APART_M)
            return false;
    return true;
}

static bool measure_spot(struct session *s, const char *lamp, const struct spot *place, double *cdm2,
                         struct error *err)
{
    char what[128];
    struct xyz xyz;
    snprintf(what, sizeof what, "ceiling under %s at x %.3f z %.3f m", lamp, place->x_m, place->z_m);
    if (!bench_aim_ceiling(&s->bench, place->x_m, place->z_m, err) ||
        !bench_measure(&s->bench, what, &xyz, NULL, err))
        return false;
    *cdm2 = xyz.Y;
    return true;
}

// From the brightest place down; a place that overloads the radiometer makes
// it look for one well below.
static bool measure_spots(struct session *s, struct lamp_report *lamp, const struct spot *places,
                          int count, struct error *err)
{
    struct spot taken[FACTS_SPOTS];
    double limit = INFINITY;
    for (int i = 0; i < count && lamp->spots < FACTS_SPOTS; i++) {
        double cdm2;
        if (places[i].map_cdm2 > limit || !far_from(taken, lamp->spots, &places[i]))
            continue;
        if (measure_spot(s, lamp->name, &places[i], &cdm2, err)) {
            lamp->spot_ratios[lamp->spots] = cdm2 / places[i].map_cdm2;
            taken[lamp->spots++] = places[i];
        } else if (err->code == ERROR_RANGE) {
            limit = STEP_DOWN * places[i].map_cdm2;
        } else {
            return false;
        }
    }
    return lamp->spots || fail(err, ERROR_DATA, "no even place that the radiometer can read");
}

static bool agree(struct lamp_report *lamp, struct error *err)
{
    struct summary all = summarise(lamp->spot_ratios, lamp->spots);
    lamp->map_scale = all.median;
    for (int i = 0; i < lamp->spots; i++)
        if (fabs(lamp->spot_ratios[i] / all.median - 1) > AGREE)
            return fail(err, ERROR_DATA,
                        "spot reading %d scales the map by %.4f, the median of all by %.4f", i + 1,
                        lamp->spot_ratios[i], all.median);
    return true;
}

static bool scale_map(struct session *s, const char *path, struct lamp_report *lamp,
                      struct error *err)
{
    struct luminance_map map;
    struct spot *places = malloc(CANDIDATES * sizeof *places);
    if (!places)
        return fail(err, ERROR_SYSTEM, "out of memory");
    if (!luminance_map_load(path, &s->settings.ceiling, &map, err)) {
        free(places);
        return false;
    }
    int count = even_places(&map, places);
    luminance_map_fini(&map);
    bool fine = measure_spots(s, lamp, places, count, err) && agree(lamp, err);
    free(places);
    return fine || while_doing(err, "%s", path);
}

static bool save(struct session *s, const char *map, const struct lamp_report *lamp,
                 const struct taught *taught, struct error *err)
{
    struct lamp out = {.file = {.spread = taught->spread,
                                .map_scale = lamp->map_scale,
                                .taught_lux = taught->lux,
                                .readings = TEACH_READINGS},
                       .irradiance = taught->irradiance};
    snprintf(out.file.name, sizeof out.file.name, "%s", lamp->name);
    snprintf(out.file.map, sizeof out.file.map, "%s", map);
    snprintf(out.file.instrument, sizeof out.file.instrument, "%s", taught->instrument);
    clock_utc(out.file.taught_at);
    return lamp_save(s->settings.lamps.folder, &out, err);
}

void session_map(const struct session *s, int lamp, char *path, size_t size)
{
    snprintf(path, size, "%s/ceiling-%s.exr", s->maps, s->facts->lamps[lamp].name);
}

// The lamp drifts while the spots are read: the map belongs to the level at
// teaching, the spots to the mean of it and the level after them.
static bool allow_for_drift(struct session *s, struct lamp_report *lamp, const struct taught *taught,
                            struct error *err)
{
    struct taught after;
    if (!bench_teach(&s->bench, lamp->name, PROBE_READINGS, &after, err))
        return false;
    lamp->map_scale /= (1 + after.lux / taught->lux) / 2;
    return true;
}

bool session_teach(struct session *s, int index, struct error *err)
{
    struct lamp_report *lamp = &s->facts->lamps[index];
    struct taught taught;
    char map[512];
    session_map(s, index, map, sizeof map);
    if (!bench_lamp(&s->bench, lamp->name, err) || !steady_light(s, lamp->name, err) ||
        !bench_teach(&s->bench, lamp->name, TEACH_READINGS, &taught, err) ||
        !scale_map(s, map, lamp, err) || !allow_for_drift(s, lamp, &taught, err) ||
        !save(s, map, lamp, &taught, err))
        return while_doing(err, "teaching lamp %s", lamp->name);
    lamp->irradiance = taught.irradiance;
    lamp->spread = taught.spread;
    lamp->lux = taught.lux;
    lamp->teach_readings = TEACH_READINGS;
    lamp->chromaticity = xy_of(xyz_absolute(&lamp->irradiance, OBSERVER_1931_2));
    lamp->cct = cct_of(lamp->chromaticity);
    return true;
}
