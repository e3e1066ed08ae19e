// SPDX-License-Identifier: Apache-2.0
#include "render/lights.h"

#include <stdlib.h>

#define real double
#include "render/shaders/diffuse.glsl"

static const double SIZE_TOLERANCE = 0.01;
static const double FAR_SIDES = 50; // beyond, a pixel is a point to 1e-4
enum { CORNERS_MOST = 5, SPOT_STEPS = 4 };

static bool size_from(const struct exr *image, const char *name, const double *known, double *size,
                      struct error *err)
{
    double value, settings = known ? *known : NAN;
    bool stated = exr_number(image, name, &value);
    *size = stated ? value : settings;
    if (!known)
        return (stated && value > 0 && isfinite(value)) ||
               fail(err, ERROR_DATA, "no attribute \"%s\" that says how large the ceiling is",
                    name);
    if (!stated)
        return true;
    if (!(fabs(value - settings) <= SIZE_TOLERANCE * settings))
        return fail(err, ERROR_DATA, "%s: %g m, but the settings say %g m (allowed within %g %%)",
                    name, value, settings, 100 * SIZE_TOLERANCE);
    return true;
}

static bool take_pixels(const float *pixels, size_t count, struct luminance_map *map)
{
    map->luminance = malloc(count * sizeof *map->luminance);
    if (!map->luminance)
        return false;
    for (size_t i = 0; i < count; i++)
        map->luminance[i] = pixels[i] > 0 ? pixels[i] : 0;
    return true;
}

static bool map_of(const struct exr *image, const struct ceiling *ceiling,
                   struct luminance_map *map, struct error *err)
{
    int channel = exr_channel(image, "Y");
    if (channel < 0)
        return fail(err, ERROR_DATA, "no channel \"Y\" (cd/m2)");
    struct luminance_map read = {.width = image->width, .height = image->height};
    struct ceiling *c = &read.ceiling;
    if (ceiling)
        *c = *ceiling;
    if (!size_from(image, "boothd.width_m", ceiling ? &ceiling->width_m : NULL, &c->width_m, err) ||
        !size_from(image, "boothd.depth_m", ceiling ? &ceiling->depth_m : NULL, &c->depth_m, err))
        return false;
    size_t count = (size_t)image->width * image->height;
    const float *pixels = image->pixels + channel * count;
    for (size_t i = 0; i < count; i++)
        if (!isfinite(pixels[i]))
            return fail(err, ERROR_DATA, "Y: column %zu, row %zu is not finite", i % image->width,
                        i / image->width);
    if (!take_pixels(pixels, count, &read))
        return fail(err, ERROR_SYSTEM, "no memory for %d x %d pixels", read.width, read.height);
    *map = read;
    return true;
}

bool luminance_map_load(const char *path, const struct ceiling *ceiling, struct luminance_map *map,
                        struct error *err)
{
    struct exr image = {0};
    if (!exr_load(path, &image, err))
        return false;
    bool good = map_of(&image, ceiling, map, err);
    exr_fini(&image);
    return good || while_doing(err, "%s", path);
}

void luminance_map_fini(struct luminance_map *map)
{
    free(map->luminance);
    map->luminance = NULL;
}

void luminance_map_scale(struct luminance_map *map, double k)
{
    for (size_t i = 0; i < (size_t)map->width * map->height; i++)
        map->luminance[i] *= k;
}

// Column or row of a place, unbounded.
static double place_in(double at_m, double centre_m, double size_m, int count)
{
    return ((at_m - centre_m) / size_m + 0.5) * count;
}

static int clamped(double place, int count)
{
    return place < 0 ? 0 : place >= count ? count - 1 : (int)place;
}

double luminance_map_spot(const struct luminance_map *map, double x_m, double z_m,
                          double diameter_m)
{
    const struct ceiling *c = &map->ceiling;
    double x = place_in(x_m, c->centre_m[0], c->width_m, map->width);
    double y = place_in(z_m, c->centre_m[2], c->depth_m, map->height);
    double rx = diameter_m / 2 / c->width_m * map->width;
    double ry = diameter_m / 2 / c->depth_m * map->height;
    double sum = 0;
    long count = 0;
    for (int row = clamped(y - ry, map->height); row <= clamped(y + ry, map->height); row++)
        for (int col = clamped(x - rx, map->width); col <= clamped(x + rx, map->width); col++)
            for (int step = 0; step < SPOT_STEPS * SPOT_STEPS; step++) {
                double dx = col + (step % SPOT_STEPS + 0.5) / SPOT_STEPS - x;
                double dy = row + (step / SPOT_STEPS + 0.5) / SPOT_STEPS - y;
                if (hypot(dx / rx, dy / ry) > 1)
                    continue;
                sum += map->luminance[(size_t)row * map->width + col];
                count++;
            }
    if (count > 0)
        return sum / count;
    if (x < 0 || y < 0 || x >= map->width || y >= map->height)
        return 0;
    return map->luminance[(size_t)y * map->width + (size_t)x];
}

double light_points_illuminance(const struct light_points *lights, double level, struct vec3 p,
                                struct vec3 n)
{
    double sum = 0;
    for (int i = 0; i < lights->count; i++) {
        struct vec3 to = vec3_sub(lights->points[i].at, p);
        sum += diffuse_point(to.x, to.y, to.z, n.x, n.y, n.z, 0, -1, 0,
                             lights->points[i].intensity_cd);
    }
    return level * sum;
}

// The part of a polygon in front of the surface's horizon; at n = 0 counts as
// in front, so that an edge on the horizon is never taken twice.
static int clip_to_horizon(const struct vec3 *in, int count, struct vec3 n, struct vec3 *out)
{
    int kept = 0;
    for (int i = 0; i < count; i++) {
        struct vec3 a = in[i], b = in[(i + 1) % count];
        double da = vec3_dot(a, n), db = vec3_dot(b, n);
        if (da >= 0)
            out[kept++] = a;
        if ((da >= 0) != (db >= 0))
            out[kept++] = vec3_add(a, vec3_scale(vec3_sub(b, a), da / (da - db)));
    }
    return kept;
}

// Lambert's polygon formula with the edge's own cross product, which keeps its
// digits for small and for distant polygons. Corners relative to the surface.
static double polygon_illuminance(const struct vec3 *corner, int count, struct vec3 n)
{
    struct vec3 inside[CORNERS_MOST];
    double sum = 0;
    count = clip_to_horizon(corner, count, n, inside);
    for (int i = 0; i < count; i++) {
        struct vec3 a = inside[i], b = inside[(i + 1) % count];
        struct vec3 across = vec3_cross(a, vec3_sub(b, a));
        double length = vec3_length(across);
        if (length > 0)
            sum += atan2(length, vec3_dot(a, b)) / length * vec3_dot(across, n);
    }
    return fabs(sum) / 2;
}

static double pixel_illuminance(struct vec3 to, double half_x, double half_z, struct vec3 n)
{
    struct vec3 corner[4] = {
        {to.x - half_x, to.y, to.z - half_z},
        {to.x + half_x, to.y, to.z - half_z},
        {to.x + half_x, to.y, to.z + half_z},
        {to.x - half_x, to.y, to.z + half_z},
    };
    return polygon_illuminance(corner, 4, n);
}

double luminance_map_illuminance(const struct luminance_map *map, struct vec3 p, struct vec3 n)
{
    const struct ceiling *c = &map->ceiling;
    double step_x = c->width_m / map->width, step_z = c->depth_m / map->height;
    double far = FAR_SIDES * fmax(step_x, step_z), area = step_x * step_z, sum = 0;
    struct vec3 to = {0, c->centre_m[1] - p.y, 0};
    if (!(to.y > 0))
        return 0;
    for (int row = 0; row < map->height; row++) {
        const double *luminance = map->luminance + (size_t)row * map->width;
        double row_sum = 0;
        to.z = c->centre_m[2] - c->depth_m / 2 + (row + 0.5) * step_z - p.z;
        for (int col = 0; col < map->width; col++) {
            if (!(luminance[col] > 0))
                continue;
            to.x = c->centre_m[0] - c->width_m / 2 + (col + 0.5) * step_x - p.x;
            if (vec3_dot(to, to) > far * far)
                row_sum +=
                    diffuse_point(to.x, to.y, to.z, n.x, n.y, n.z, 0, -1, 0, luminance[col] * area);
            else
                row_sum += luminance[col] * pixel_illuminance(to, step_x / 2, step_z / 2, n);
        }
        sum += row_sum;
    }
    return sum;
}
