// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/session.h"
#include "config/lamps.h"

enum { TEACH_READINGS = 10, PROBE_READINGS = 2, SPOTS = 5, GRID = 24 };
static const double STEADY = 0.005;    // relative change of illuminance between two short readings
static const double SPOT_M = 0.010;    // what the radiometer sees of the ceiling
static const double AROUND_M = 0.024;  // what must be alike around it
static const double ALIKE = 0.03;

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

static void insert(struct spot *best, struct spot candidate)
{
    for (int i = 0; i < SPOTS; i++) {
        if (candidate.map_cdm2 > best[i].map_cdm2) {
            struct spot pushed = best[i];
            best[i] = candidate;
            candidate = pushed;
        }
    }
}

// Bright places whose surroundings are alike, so that aiming a little beside
// them does no harm.
static void choose_spots(const struct luminance_map *map, struct spot best[SPOTS])
{
    const struct ceiling *c = &map->ceiling;
    for (int j = 0; j < GRID; j++) {
        for (int i = 0; i < 2 * GRID; i++) {
            double x = c->centre_m[0] + c->width_m * ((i + 0.5) / (2 * GRID) - 0.5);
            double z = c->centre_m[2] + c->depth_m * ((j + 0.5) / GRID - 0.5);
            double here = luminance_map_spot(map, x, z, SPOT_M);
            double around = luminance_map_spot(map, x, z, AROUND_M);
            if (here > 0 && fabs(around / here - 1) < ALIKE)
                insert(best, (struct spot){x, z, here});
        }
    }
}

static bool scale_map(struct session *s, const char *path, struct lamp_report *lamp,
                      struct error *err)
{
    struct luminance_map map;
    if (!luminance_map_load(path, &s->settings.ceiling, &map, err))
        return false;
    struct spot spots[SPOTS] = {0};
    choose_spots(&map, spots);
    luminance_map_fini(&map);
    double measured = 0, mapped = 0;
    for (int i = 0; i < SPOTS && spots[i].map_cdm2 > 0; i++) {
        char what[128];
        struct xyz xyz;
        snprintf(what, sizeof what, "ceiling under %s at x %.3f z %.3f m", lamp->name, spots[i].x_m,
                 spots[i].z_m);
        if (!bench_aim_ceiling(&s->bench, spots[i].x_m, spots[i].z_m, err) ||
            !bench_measure(&s->bench, what, &xyz, NULL, err))
            return false;
        measured += xyz.Y;
        mapped += spots[i].map_cdm2;
        lamp->spots++;
    }
    if (!lamp->spots)
        return fail(err, ERROR_DATA, "%s: no bright even place to scale it by", path);
    lamp->map_scale = measured / mapped;
    return true;
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
