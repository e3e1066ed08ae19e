// SPDX-License-Identifier: Apache-2.0
#include "simulator/ceiling.h"

#include <stdlib.h>

#include "simulator/chance.h"

static const double trim_m = 0.012; // dark frame around the ceiling

double ceiling_trim_m(void)
{
    return trim_m;
}

static double pixel_x(const struct ceiling_image *c, int column)
{
    return ((column + 0.5) / c->width - 0.5) * c->width_m;
}

static double pixel_z(const struct ceiling_image *c, int row)
{
    return ((row + 0.5) / c->height - 0.5) * c->depth_m;
}

static double place_in_row(const struct scenario_lamp *lamp, int i)
{
    double share = lamp->count > 1 ? (double)i / (lamp->count - 1) : 0.5;
    return lamp->row_m[0] + share * (lamp->row_m[1] - lamp->row_m[0]);
}

static double tube(const struct scenario_lamp *lamp, double along, double across)
{
    double r = across / (lamp->diameter_m / 2), half = lamp->length_m / 2, u = along / half;
    double profile = 1 / (1 + pow(r * r, 4));
    double glow = 0.03 / (1 + r * r);
    double end = 1 / (1 + exp((fabs(along) - half + 0.02) / 0.006));
    return (profile + glow) * end * (1 - 0.1 * u * u);
}

static double spot(const struct scenario_lamp *lamp, double x, double z)
{
    double r2 = (x * x + z * z) / (lamp->diameter_m * lamp->diameter_m / 4);
    return exp(-r2 * r2) + 0.12 * exp(-r2 / 9);
}

static double haze(const struct ceiling_image *c, const struct scenario_lamp *lamp, double x,
                   double z)
{
    double u = 2 * x / c->width_m, v = 2 * z / c->depth_m;
    return lamp->haze * (1 - 0.35 * u * u) * (1 - 0.35 * v * v);
}

static double pattern(const struct ceiling_image *c, const struct scenario_lamp *lamp,
                      const double *strength, double x, double z)
{
    if (fabs(x) > c->width_m / 2 - trim_m || fabs(z) > c->depth_m / 2 - trim_m)
        return 0;
    double sum = haze(c, lamp, x, z);
    for (int i = 0; i < lamp->count; i++) {
        double at = place_in_row(lamp, i);
        sum += strength[i] * (lamp->form == LAMP_TUBES ? tube(lamp, x - lamp->offset_m, z - at)
                                                       : spot(lamp, x - at, z - lamp->offset_m));
    }
    return sum;
}

bool ceiling_make(const struct scenario_ceiling *ceiling, const struct scenario_lamp *lamp,
                  int seed, struct ceiling_image *out, struct error *err)
{
    struct ceiling_image c = {
        .centre = {ceiling->centre_m[0], ceiling->centre_m[1], ceiling->centre_m[2]},
        .width_m = ceiling->width_m,
        .depth_m = ceiling->depth_m,
        .width = ceiling->true_px[0],
        .height = ceiling->true_px[1],
    };
    c.luminance = malloc(sizeof *c.luminance * c.width * c.height);
    if (!c.luminance)
        return fail(err, ERROR_SYSTEM, "out of memory for the ceiling");
    double strength[16];
    struct chance chance = chance_start(seed, lamp->name, 1);
    for (int i = 0; i < lamp->count; i++)
        strength[i] = 1 + 0.06 * chance_either(&chance);
    for (int row = 0; row < c.height; row++)
        for (int column = 0; column < c.width; column++)
            c.luminance[row * c.width + column] =
                pattern(&c, lamp, strength, pixel_x(&c, column), pixel_z(&c, row));
    *out = c;
    return true;
}

void ceiling_fini(struct ceiling_image *image)
{
    free(image->luminance);
    *image = (struct ceiling_image){0};
}

void ceiling_scale(struct ceiling_image *image, double k)
{
    for (int i = 0; i < image->width * image->height; i++)
        image->luminance[i] *= k;
}

double ceiling_illuminance(const struct ceiling_image *image, struct vec3 p, struct vec3 n)
{
    double sum = 0, y = image->centre.y - p.y;
    if (y <= 0)
        return 0;
    for (int row = 0; row < image->height; row++) {
        const double *line = image->luminance + (size_t)row * image->width;
        double z = image->centre.z + pixel_z(image, row) - p.z;
        double across = n.y * y + n.z * z, d2_across = y * y + z * z;
        double x = image->centre.x + pixel_x(image, 0) - p.x, step = image->width_m / image->width;
        for (int column = 0; column < image->width; column++) {
            double xi = x + column * step, facing = n.x * xi + across, d2 = d2_across + xi * xi;
            sum += facing > 0 ? line[column] * facing / (d2 * d2) : 0;
        }
    }
    return sum * y * (image->width_m / image->width) * (image->depth_m / image->height);
}

double ceiling_spot(const struct ceiling_image *image, double x_m, double z_m, double diameter_m)
{
    double step_x = image->width_m / image->width, step_z = image->depth_m / image->height;
    double x = x_m - image->centre.x, z = z_m - image->centre.z, r = diameter_m / 2, sum = 0;
    enum { ACROSS = 64 }; // sub-samples, so that small spots on coarse pixels are fair
    long inside = 0;
    for (int j = 0; j < ACROSS; j++)
        for (int i = 0; i < ACROSS; i++) {
            double dx = ((i + 0.5) / ACROSS * 2 - 1) * r, dz = ((j + 0.5) / ACROSS * 2 - 1) * r;
            if (dx * dx + dz * dz > r * r)
                continue;
            double column = floor((x + dx + image->width_m / 2) / step_x);
            double row = floor((z + dz + image->depth_m / 2) / step_z);
            inside++;
            if (column >= 0 && column < image->width && row >= 0 && row < image->height)
                sum += image->luminance[(long)row * image->width + (long)column];
        }
    return sum / inside;
}

static double line_mean(const double *line, int count, double from, double to)
{
    double sum = 0;
    for (int i = (int)from; i < count && i < to; i++) {
        double low = i > from ? i : from, high = i + 1 < to ? i + 1 : to;
        sum += (high - low) * line[i];
    }
    return sum / (to - from);
}

static double area_mean(const struct ceiling_image *c, int width, int height, int column, int row)
{
    double left = (double)column * c->width / width,
           right = (double)(column + 1) * c->width / width;
    double top = (double)row * c->height / height, bottom = (double)(row + 1) * c->height / height;
    double sum = 0;
    for (int i = (int)top; i < c->height && i < bottom; i++) {
        double low = i > top ? i : top, high = i + 1 < bottom ? i + 1 : bottom;
        sum += (high - low) * line_mean(c->luminance + (size_t)i * c->width, c->width, left, right);
    }
    return sum / (bottom - top);
}

bool ceiling_true_map(const struct ceiling_image *image, double k, const int map_px[2],
                      struct exr *out, struct error *err)
{
    int width = map_px[0], height = map_px[1];
    if (!exr_init(out, width, height, 1, err))
        return false;
    for (int row = 0; row < height; row++)
        for (int column = 0; column < width; column++)
            out->pixels[(size_t)row * width + column] =
                (float)(k * area_mean(image, width, height, column, row));
    snprintf(out->names[0], sizeof out->names[0], "Y");
    exr_set_number(out, "boothd.width_m", image->width_m);
    exr_set_number(out, "boothd.depth_m", image->depth_m);
    return true;
}

bool ceiling_camera_map(const struct ceiling_image *image, const struct scenario_ceiling *settings,
                        const char *lamp, int seed, struct exr *out, struct error *err)
{
    struct chance chance = chance_start(seed, lamp, 2);
    double sign = chance_uniform(&chance) < 0.5 ? -1 : 1;
    double scale = 1 + sign * settings->map_scale_error * (0.5 + 0.5 * chance_uniform(&chance));
    if (!ceiling_true_map(image, scale, settings->map_px, out, err))
        return false;
    for (int i = 0; i < out->width * out->height; i++) {
        double seen = (double)out->pixels[i];
        seen *= 1 + settings->map_noise * chance_normal(&chance);
        seen += settings->map_read_noise_cdm2 * chance_normal(&chance);
        out->pixels[i] = (float)seen;
    }
    exr_set_text(out, "boothd.lamp", lamp);
    return true;
}
