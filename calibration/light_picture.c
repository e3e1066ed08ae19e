// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>

#include "calibration/light.h"
#include "files/png.h"

enum { WIDTH_LEAST = 1024, WIDTH_MOST = 2048, DISC = 3 };

struct canvas {
    const struct luminance_map *map;
    int width, height;
    uint8_t *rgb;
};

static void put(struct canvas *c, int x, int y, uint8_t r, uint8_t g, uint8_t b)
{
    if (x < 0 || y < 0 || x >= c->width || y >= c->height)
        return;
    uint8_t *at = c->rgb + ((size_t)y * c->width + x) * 3;
    at[0] = r;
    at[1] = g;
    at[2] = b;
}

static int from_map(int at, int size, int map_size)
{
    return (int)((long)at * size / map_size);
}

// Mean of the map's pixels under one pixel of the picture.
static double under(const struct canvas *c, int x, int y)
{
    int w = c->map->width, h = c->map->height;
    int left = (int)((long)x * w / c->width), right = (int)((long)(x + 1) * w / c->width);
    int top = (int)((long)y * h / c->height), bottom = (int)((long)(y + 1) * h / c->height);
    double sum = 0;
    right = right > left ? right : left + 1;
    bottom = bottom > top ? bottom : top + 1;
    for (int row = top; row < bottom; row++)
        for (int col = left; col < right; col++)
            sum += c->map->luminance[(size_t)row * w + col];
    return sum / ((double)(right - left) * (bottom - top));
}

static void paint_map(struct canvas *c)
{
    double most = 0;
    for (size_t i = 0; i < (size_t)c->map->width * c->map->height; i++)
        most = fmax(most, c->map->luminance[i]);
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++) {
            double share = most > 0 ? cbrt(under(c, x, y) / most) : 0;
            uint8_t grey = (uint8_t)lround(255 * fmin(share, 1));
            put(c, x, y, grey, grey, grey);
        }
}

static void frame(struct canvas *c, const struct pixels *region)
{
    int left = from_map(region->left, c->width, c->map->width);
    int right = from_map(region->right, c->width, c->map->width) - 1;
    int top = from_map(region->top, c->height, c->map->height);
    int bottom = from_map(region->bottom, c->height, c->map->height) - 1;
    for (int x = left; x <= right; x++) {
        put(c, x, top, 70, 130, 220);
        put(c, x, bottom, 70, 130, 220);
    }
    for (int y = top; y <= bottom; y++) {
        put(c, left, y, 70, 130, 220);
        put(c, right, y, 70, 130, 220);
    }
}

static void disc(struct canvas *c, const struct light_point *point)
{
    const struct ceiling *ceiling = &c->map->ceiling;
    double u = (point->at.x - ceiling->centre_m[0]) / ceiling->width_m + 0.5;
    double v = (point->at.z - ceiling->centre_m[2]) / ceiling->depth_m + 0.5;
    int x = (int)(u * c->width), y = (int)(v * c->height);
    for (int dy = -DISC; dy <= DISC; dy++)
        for (int dx = -DISC; dx <= DISC; dx++)
            if (dx * dx + dy * dy <= DISC * DISC)
                put(c, x + dx, y + dy, 230, 40, 30);
}

static int width_for(int width)
{
    if (width >= WIDTH_LEAST)
        return width < WIDTH_MOST ? width : WIDTH_MOST;
    return (WIDTH_LEAST + width - 1) / width * width;
}

bool light_picture(const char *path, const struct luminance_map *map,
                   const struct light_points *lights, const struct pixels *regions,
                   struct error *err)
{
    struct canvas c = {.map = map, .width = width_for(map->width)};
    double height = (double)map->height * c.width / map->width;
    c.height = (int)fmin(fmax(height, 1), 8 * WIDTH_MOST);
    c.rgb = malloc((size_t)c.width * c.height * 3);
    if (!c.rgb)
        return fail(err, ERROR_SYSTEM, "%s: no memory for %d x %d pixels", path, c.width, c.height);
    paint_map(&c);
    for (int i = 0; lights && i < lights->count; i++)
        frame(&c, &regions[i]);
    for (int i = 0; lights && i < lights->count; i++)
        disc(&c, &lights->points[i]);
    bool fine = png_save_rgb8(path, c.width, c.height, c.rgb, err);
    free(c.rgb);
    return fine;
}
