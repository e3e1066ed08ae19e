// SPDX-License-Identifier: Apache-2.0
#include "calibration/budget_booth.h"

#include <math.h>
#include <stdlib.h>

#include "calibration/statistics.h"

static const double TILT_STEP_DEG = 0.25, PLACE_STEP_M = 0.002, FALL_STEP = 0.5;

static double lux_at(const struct luminance_map *map, const struct stand *stand, double tilt_deg,
                     double up_m, double near_m)
{
    struct rigid pose = stand_pose(stand, tilt_deg);
    struct vec3 p = vec3_add(pose.translation, (struct vec3){0, up_m, near_m});
    return luminance_map_illuminance(map, p, mat3_apply(pose.rotation, (struct vec3){0, 0, 1}));
}

// The k-th way in which a map may fall off; x and z in -1..1 from its centre.
static double fall(int k, double x, double z)
{
    return k == 0 ? x : k == 1 ? z : (x * x + z * z) / 2;
}

static double fall_at(const struct ceiling *c, int k, const struct map_spot *spot)
{
    return fall(k, 2 * (spot->x_m - c->centre_m[0]) / c->width_m,
                2 * (spot->z_m - c->centre_m[2]) / c->depth_m);
}

static double over_light(const struct luminance_map *map, int k)
{
    double sum = 0, light = 0;
    for (int row = 0; row < map->height; row++)
        for (int column = 0; column < map->width; column++) {
            double l = map->luminance[(size_t)row * map->width + column];
            sum +=
                l * fall(k, 2 * (column + 0.5) / map->width - 1, 2 * (row + 0.5) / map->height - 1);
            light += l;
        }
    return sum / light;
}

// Median of the fall-off over the spots, as they scale the map, or its mean
// over the map's light; *std receives its standard deviation over the spots.
static double at_spots(const struct luminance_map *map, int k, const struct map_spot *spots,
                       int count, double *std)
{
    double falls[MAP_SPOTS];
    *std = 0;
    if (!count)
        return over_light(map, k);
    count = count < MAP_SPOTS ? count : MAP_SPOTS;
    for (int i = 0; i < count; i++)
        falls[i] = fall_at(&map->ceiling, k, &spots[i]);
    struct summary all = summarise(falls, count);
    *std = all.std;
    return all.median;
}

// Change of lux for a fall-off of 1; luminances stay positive on the way.
static double lux_by_fall(const struct luminance_map *map, struct luminance_map *room, int k,
                          struct vec3 p, struct vec3 n)
{
    for (int row = 0; row < map->height; row++)
        for (int column = 0; column < map->width; column++) {
            size_t i = (size_t)row * map->width + column;
            room->luminance[i] =
                map->luminance[i] * (1 + FALL_STEP * fall(k, 2 * (column + 0.5) / map->width - 1,
                                                          2 * (row + 0.5) / map->height - 1));
        }
    return (luminance_map_illuminance(room, p, n) - luminance_map_illuminance(map, p, n)) /
           FALL_STEP;
}

bool booth_light_at(const struct luminance_map *map, const struct stand *stand, double tilt_deg,
                    const struct map_spot *spots, int count, struct booth_light *out,
                    struct error *err)
{
    struct rigid pose = stand_pose(stand, tilt_deg);
    struct vec3 n = mat3_apply(pose.rotation, (struct vec3){0, 0, 1});
    struct booth_light l = {.lux = lux_at(map, stand, tilt_deg, 0, 0)};
    struct luminance_map room = *map;
    if (!(l.lux > 0))
        return fail(err, ERROR_RANGE, "the screen gets no light at a tilt of %g degrees", tilt_deg);
    room.luminance = calloc((size_t)map->width * map->height, sizeof *room.luminance);
    if (!room.luminance)
        return fail(err, ERROR_SYSTEM, "out of memory for the luminance map");
    l.by_tilt = (lux_at(map, stand, tilt_deg + TILT_STEP_DEG, 0, 0) -
                 lux_at(map, stand, tilt_deg - TILT_STEP_DEG, 0, 0)) /
                (2 * TILT_STEP_DEG * l.lux);
    l.by_up = (lux_at(map, stand, tilt_deg, PLACE_STEP_M, 0) -
               lux_at(map, stand, tilt_deg, -PLACE_STEP_M, 0)) /
              (2 * PLACE_STEP_M * l.lux);
    l.by_near = (lux_at(map, stand, tilt_deg, 0, PLACE_STEP_M) -
                 lux_at(map, stand, tilt_deg, 0, -PLACE_STEP_M)) /
                (2 * PLACE_STEP_M * l.lux);
    for (int k = 0; k < 3; k++) {
        double std;
        l.by_shape[k] = lux_by_fall(map, &room, k, pose.translation, n) / l.lux -
                        at_spots(map, k, spots, count, &std);
        l.spots_by_shape = hypot(l.spots_by_shape, std);
    }
    free(room.luminance);
    *out = l;
    return true;
}

// A median scatters more than a mean.
double map_scale_uncertainty(const struct booth_light *light, const struct uncertainties *u,
                             double spread, int count)
{
    double shape = u->map_shape * light->spots_by_shape;
    double rest = sqrt(fmax(spread * spread - shape * shape, 0));
    return sqrt(M_PI / 2) * fmax(rest, u->radiometer_repeat) / sqrt(count > 0 ? count : 1);
}

void booth_light_into(const struct booth_light *light, double spread, int count,
                      struct budget_input *input)
{
    input->lux = light->lux;
    input->by_tilt = light->by_tilt;
    input->by_up = light->by_up;
    input->by_near = light->by_near;
    input->map_spots = map_scale_uncertainty(light, &input->u, spread, count);
    for (int k = 0; k < 3; k++)
        input->map_by_shape[k] = light->by_shape[k];
}
