// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/session.h"
#include "config/lamps.h"

enum { TEACH_READINGS = 10, PROBE_READINGS = 2, SPOTS = 5, GRID = 24, CANDIDATES = 2 * GRID * GRID };
static const double STEADY = 0.005;    // relative change of illuminance between two short readings
static const double SPOT_M = 0.010;    // what the radiometer sees of the ceiling
static const double AROUND_M = 0.024;  // what must be alike around it
static const double ALIKE = 0.03;
static const double APART_M = 0.02;   // spots apart, so that they are of different pixels
static const double STEP_DOWN = 0.6;  // of a luminance that overloaded the radiometer

static bool steady_light(struct session *s, const char *lamp, struct error *err)
{
    double before = 0, lux = 0, spread;
    struct spectrum ignored;
    for (int attempt = 0; attempt < 20; attempt++) {
        if (!bench_teach(&s->bench, lamp, PROBE_READINGS, &ignored, &spread, &lux, err))
            return false;
        if (before > 0 && fabs(lux / before - 1) < STEADY)
            return true;
        before = lux;
    }
    return fail(err, ERROR_RETRY, "lamp %s is not steady: %.0f lx, before %.0f lx", lamp, lux, before);
}

struct spot {
    double x_m, z_m, map_cdm2;
};

static int brighter_first(const void *a, const void *b)
{
    double x = ((const struct spot *)a)->map_cdm2, y = ((const struct spot *)b)->map_cdm2;
    return (x < y) - (x > y);
}

// Places whose surroundings are alike, so that aiming a little beside them
// does no harm; the brightest first. Returns how many.
static int even_places(const struct luminance_map *map, struct spot places[CANDIDATES])
{
    const struct ceiling *c = &map->ceiling;
    int n = 0;
    for (int j = 0; j < GRID; j++) {
        for (int i = 0; i < 2 * GRID; i++) {
            double x = c->centre_m[0] + c->width_m * ((i + 0.5) / (2 * GRID) - 0.5);
            double z = c->centre_m[2] + c->depth_m * ((j + 0.5) / GRID - 0.5);
            double here = luminance_map_spot(map, x, z, SPOT_M);
            double around = luminance_map_spot(map, x, z, AROUND_M);
            if (here > 0 && fabs(around / here - 1) < ALIKE)
                places[n++] = (struct spot){x, z, here};
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
    struct spot taken[SPOTS];
    double measured = 0, mapped = 0, limit = INFINITY;
    for (int i = 0; i < count && lamp->spots < SPOTS; i++) {
        double cdm2;
        if (places[i].map_cdm2 > limit || !far_from(taken, lamp->spots, &places[i]))
            continue;
        if (measure_spot(s, lamp->name, &places[i], &cdm2, err)) {
            taken[lamp->spots++] = places[i];
            measured += cdm2;
            mapped += places[i].map_cdm2;
        } else if (err->code == ERROR_RANGE) {
            limit = STEP_DOWN * places[i].map_cdm2;
        } else {
            return false;
        }
    }
    if (!lamp->spots)
        return fail(err, ERROR_DATA, "no even place of the luminance map that the radiometer can read");
    lamp->map_scale = measured / mapped;
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
    bool fine = measure_spots(s, lamp, places, count, err);
    free(places);
    return fine || while_doing(err, "%s", path);
}

static bool save(struct session *s, const char *map, const struct lamp_report *lamp,
                 struct error *err)
{
    struct lamp taught = {.file = {.spread = lamp->spread,
                                    .map_scale = lamp->map_scale,
                                    .taught_lux = lamp->lux,
                                    .readings = lamp->teach_readings},
                          .irradiance = lamp->irradiance};
    snprintf(taught.file.name, sizeof taught.file.name, "%s", lamp->name);
    snprintf(taught.file.map, sizeof taught.file.map, "%s", map);
    snprintf(taught.file.instrument, sizeof taught.file.instrument, "%s",
             s->settings.spectrometer.options.serial);
    clock_utc(taught.file.taught_at);
    return lamp_save(s->settings.lamps.folder, &taught, err);
}

bool session_teach(struct session *s, int index, struct error *err)
{
    struct lamp_report *lamp = &s->facts->lamps[index];
    char map[512];
    lamp->teach_readings = TEACH_READINGS;
    snprintf(map, sizeof map, "%.400s/ceiling-%.63s.exr", s->maps, lamp->name);
    if (!bench_lamp(&s->bench, lamp->name, err) || !steady_light(s, lamp->name, err) ||
        !bench_teach(&s->bench, lamp->name, TEACH_READINGS, &lamp->irradiance, &lamp->spread,
                     &lamp->lux, err) ||
        !scale_map(s, map, lamp, err) || !save(s, map, lamp, err))
        return while_doing(err, "teaching lamp %s", lamp->name);
    lamp->chromaticity = xy_of(xyz_absolute(&lamp->irradiance, OBSERVER_1931_2));
    lamp->cct = cct_of(lamp->chromaticity);
    return true;
}
