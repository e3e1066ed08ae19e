// SPDX-License-Identifier: Apache-2.0
#include "calibration/spots.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "calibration/statistics.h"

enum { GRID = 24, CANDIDATES = 2 * GRID * GRID };
static const double SPOT_M = 0.010;   // what the radiometer sees of the ceiling
static const double BESIDE_M = 0.005; // twice what aiming may be off
static const double ALIKE = 0.02;     // four times the noise of a map's spot mean
static const double AGREE = 0.02; // spots that scale the map more differently contradict each other
static const double APART_M = 0.02;  // spots apart, so that they are of different pixels
static const double STEP_DOWN = 0.6; // of a luminance that overloaded the radiometer

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

static bool measure_spot(struct bench *b, const char *lamp, const struct spot *place, double *cdm2,
                         struct error *err)
{
    char what[128];
    struct xyz xyz;
    snprintf(what, sizeof what, "ceiling under %s at x %.3f z %.3f m", lamp, place->x_m,
             place->z_m);
    if (!bench_aim_ceiling(b, place->x_m, place->z_m, err) ||
        !bench_measure(b, what, &xyz, NULL, err))
        return false;
    *cdm2 = xyz.Y;
    return true;
}

// From the brightest place down; a place that overloads the radiometer makes
// it look for one well below.
static bool measure_spots(struct bench *b, const char *lamp, const struct spot *places, int count,
                          struct spot_scale *out, struct error *err)
{
    struct spot taken[SPOTS_MOST];
    double limit = INFINITY;
    for (int i = 0; i < count && out->count < SPOTS_MOST; i++) {
        double cdm2;
        if (places[i].map_cdm2 > limit || !far_from(taken, out->count, &places[i]))
            continue;
        if (measure_spot(b, lamp, &places[i], &cdm2, err)) {
            out->ratios[out->count] = cdm2 / places[i].map_cdm2;
            out->x_m[out->count] = places[i].x_m;
            out->z_m[out->count] = places[i].z_m;
            taken[out->count++] = places[i];
        } else if (err->code == ERROR_RANGE) {
            limit = STEP_DOWN * places[i].map_cdm2;
        } else {
            return false;
        }
    }
    return out->count || fail(err, ERROR_DATA, "no even place that the radiometer can read");
}

static bool agree(struct spot_scale *s, struct error *err)
{
    s->scale = summarise(s->ratios, s->count).median;
    for (int i = 0; i < s->count; i++)
        if (fabs(s->ratios[i] / s->scale - 1) > AGREE)
            return fail(err, ERROR_DATA,
                        "spot reading %d scales the map by %.4f, the median of all by %.4f", i + 1,
                        s->ratios[i], s->scale);
    return true;
}

bool spots_scale(struct bench *b, const char *lamp, const struct luminance_map *map,
                 struct spot_scale *out, struct error *err)
{
    struct spot *places = malloc(CANDIDATES * sizeof *places);
    struct spot_scale found = {0};
    if (!places)
        return fail(err, ERROR_SYSTEM, "out of memory");
    int count = even_places(map, places);
    bool fine = measure_spots(b, lamp, places, count, &found, err) && agree(&found, err);
    free(places);
    if (fine)
        *out = found;
    return fine;
}

bool spots_apply(const struct luminance_map *map, const struct spot_reading *readings, int count,
                 struct spot_scale *out, struct error *err)
{
    struct spot_scale given = {.count = count};
    for (int i = 0; i < count; i++) {
        const struct spot_reading *r = &readings[i];
        double there = luminance_map_spot(map, r->x_m, r->z_m, SPOT_M);
        if (!(there > 0 && r->cdm2 > 0))
            return fail(err, ERROR_DATA,
                        "spot reading %d, %g cd/m2 at x %.3f z %.3f m: the map is dark there, "
                        "clipped, or ends before",
                        i + 1, r->cdm2, r->x_m, r->z_m);
        given.ratios[i] = r->cdm2 / there;
    }
    if (count < 1 || !agree(&given, err))
        return false;
    *out = given;
    return true;
}
