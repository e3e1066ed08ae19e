// SPDX-License-Identifier: Apache-2.0
#include "simulator/photograph.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "files/write.h"
#include "simulator/lens.h"
#include "simulator/sensor.h"

enum { ACROSS = 4 };                                    // rays through a pixel, a side
static const double FLAT_CDM2 = 1000, FLAT_SHARE = 0.6; // of the full well, on the axis

// Peaks and widths of the colour channels' sensitivities.
static const double PEAK_NM[3] = {600, 540, 460}, WIDTH_NM = 40;

struct shoot {
    const struct scenario *scenario;
    const char *folder;
    struct lens lens;
    struct sensor sensor;
    int channels;
    struct ceiling_image ceiling[3]; // as each channel sees it; owned
    double wall[3];
    double *light, *flat; // [channels][height_px][width_px], owned
    struct whole_file list;
};

// ---- what the camera has before it -----------------------------------------

// Response of a channel to a lamp, over that of the eye.
static double channel_gain(const struct lamp *lamp, int channel, int channels)
{
    double sum = 0, all = 0;
    for (int i = 0; channels == 3 && i < SPECTRUM_COUNT; i++) {
        double d = (SPECTRUM_FIRST_NM + i - PEAK_NM[channel]) / WIDTH_NM;
        double s = exp(-d * d / 2);
        sum += 683 * s * lamp->per_lux.v[i]; // per_lux gives 1 lx
        all += s;
    }
    return channels == 3 ? sum / all * 106.86 : 1; // 106.86 nm: the integral of V
}

static bool gather_light(struct shoot *s, struct world *world, int64_t at_ns, struct error *err)
{
    for (int c = 0; c < s->channels; c++) {
        struct ceiling_image *sum = &s->ceiling[c];
        for (int i = 0; i < SCENARIO_LAMPS_MOST; i++) {
            const struct lamp *lamp = world_lamp(world, i);
            if (!lamp)
                continue;
            int count = lamp->image.width * lamp->image.height;
            double k = world_output(world, at_ns, i) * channel_gain(lamp, c, s->channels);
            if (!sum->luminance) {
                *sum = lamp->image;
                sum->luminance = calloc((size_t)count, sizeof *sum->luminance);
            }
            if (!sum->luminance)
                return fail(err, ERROR_SYSTEM, "out of memory for the ceiling");
            for (int p = 0; p < count; p++)
                sum->luminance[p] += k * lamp->image.luminance[p];
        }
        struct vec3 beside = {sum->centre.x + sum->width_m / 2, sum->centre.y - sum->depth_m / 3,
                              sum->centre.z};
        s->wall[c] = s->scenario->ceiling_camera.wall_reflectance / M_PI *
                     ceiling_illuminance(sum, beside, (struct vec3){-1, 0, 0});
    }
    return true;
}

static double luminance_at(const struct shoot *s, int channel, double x, double z)
{
    const struct ceiling_image *c = &s->ceiling[channel];
    int column = (int)floor(((x - c->centre.x) / c->width_m + 0.5) * c->width);
    int row = (int)floor(((z - c->centre.z) / c->depth_m + 0.5) * c->height);
    if (column < 0 || row < 0 || column >= c->width || row >= c->height)
        return s->wall[channel];
    return c->luminance[(size_t)row * c->width + column];
}

// Where the ray through a place of the picture meets the ceiling's plane; all
// of the walls lies on it too, outside the ceiling.
static void meet(const struct shoot *s, double x_px, double y_px, double at[2])
{
    struct vec3 d = lens_direction(&s->lens, x_px, y_px);
    double t = (s->ceiling[0].centre.y - s->lens.place.y) / fmax(d.y, 1e-9);
    at[0] = s->lens.place.x + t * d.x;
    at[1] = s->lens.place.z + t * d.z;
}

// Mean over a pixel of corners a b / c d, along which places run straight.
static double pixel_mean(const struct shoot *s, int channel, const double *a, const double *b,
                         const double *c, const double *d)
{
    double sum = 0;
    for (int j = 0; j < ACROSS; j++)
        for (int i = 0; i < ACROSS; i++) {
            double u = (i + 0.5) / ACROSS, v = (j + 0.5) / ACROSS, at[2];
            for (int k = 0; k < 2; k++)
                at[k] = (1 - v) * ((1 - u) * a[k] + u * b[k]) + v * ((1 - u) * c[k] + u * d[k]);
            sum += luminance_at(s, channel, at[0], at[1]);
        }
    return sum / (ACROSS * ACROSS);
}

static void corners_of_row(const struct shoot *s, int row, double (*out)[2])
{
    for (int column = 0; column <= s->scenario->ceiling_camera.width_px; column++)
        meet(s, column - 0.5, row - 0.5, out[column]);
}

static bool expose_scene(struct shoot *s, struct error *err)
{
    const struct scenario_ceiling_camera *camera = &s->scenario->ceiling_camera;
    size_t width = (size_t)camera->width_px, count = width * (size_t)camera->height_px;
    double(*above)[2] = calloc(2 * (width + 1), sizeof *above), (*below)[2] = above + width + 1;
    s->light = calloc(count * (size_t)s->channels, sizeof *s->light);
    s->flat = calloc(count * (size_t)s->channels, sizeof *s->flat);
    if (!above || !s->light || !s->flat) {
        free(above);
        return fail(err, ERROR_SYSTEM, "out of memory for a picture");
    }
    corners_of_row(s, 0, below);
    for (int y = 0; y < camera->height_px; y++) {
        memcpy(above, below, (width + 1) * sizeof *above);
        corners_of_row(s, y + 1, below);
        for (size_t x = 0; x < width; x++) {
            double falloff = lens_falloff(&s->lens, lens_ideal(&s->lens, (double)x, y));
            for (int c = 0; c < s->channels; c++) {
                size_t at = (size_t)c * count + (size_t)y * width + x;
                s->light[at] =
                    falloff * pixel_mean(s, c, above[x], above[x + 1], below[x], below[x + 1]);
                s->flat[at] = falloff * FLAT_CDM2;
            }
        }
    }
    free(above);
    return true;
}

// ---- what it leaves --------------------------------------------------------

static bool take(struct shoot *s, const char *kind, int number, const double *light,
                 double exposure_s, struct error *err)
{
    char name[64], path[1200];
    struct picture frame = {0};
    struct chance chance = chance_start((uint64_t)s->scenario->world.seed, kind, (uint64_t)number);
    snprintf(name, sizeof name, "%s-%02d.png", kind, number);
    snprintf(path, sizeof path, "%s/%s", s->folder, name);
    bool fine = sensor_expose(&s->sensor, light, s->channels, exposure_s, &chance, &frame, err) &&
                png_save(path, &frame, err);
    picture_fini(&frame);
    fprintf(s->list.stream, "%s,%.9g,%s\n", name, exposure_s, kind);
    return fine;
}

static bool take_all(struct shoot *s, struct error *err)
{
    const struct scenario_ceiling_camera *camera = &s->scenario->ceiling_camera;
    double flat_s = FLAT_SHARE * camera->full_well_e / (camera->sensitivity * FLAT_CDM2);
    double exposure_s = camera->shortest_s;
    for (int i = 1; i <= camera->exposures; i++, exposure_s *= camera->ratio)
        if (!take(s, "light", i, s->light, exposure_s, err) ||
            (i > camera->exposures - camera->darks && !take(s, "dark", i, NULL, exposure_s, err)))
            return false;
    for (int i = 1; i <= camera->flats; i++)
        if (!take(s, "flat", i, s->flat, flat_s, err))
            return false;
    return true;
}

// In the order of the usual calibration programs, whose p1 belongs to y.
static bool write_calibration(const struct shoot *s, struct error *err)
{
    const struct scenario_ceiling_camera *c = &s->scenario->ceiling_camera;
    char path[1200];
    struct whole_file file;
    snprintf(path, sizeof path, "%s/camera.ini", s->folder);
    if (!whole_file_begin(&file, path, err))
        return false;
    fprintf(file.stream,
            "[camera]\nwidth_px = %d\nheight_px = %d\nfx_px = %.9g\nfy_px = %.9g\n"
            "cx_px = %.9g\ncy_px = %.9g\nk1 = %.9g\nk2 = %.9g\nk3 = %.9g\np1 = %.9g\np2 = %.9g\n"
            "\n[ceiling]\ntop = near\ninset_m = %.9g\n",
            c->width_px, c->height_px, c->focal_px, c->focal_px, s->lens.axis_px[0],
            s->lens.axis_px[1], c->radial[0], c->radial[1], c->radial[2], c->decentred[1],
            c->decentred[0], ceiling_trim_m());
    return whole_file_commit(&file, err);
}

// The eye's own, whatever the channels see.
static bool write_truth(const struct shoot *s, struct world *world, int64_t at_ns,
                        struct error *err)
{
    char path[1200];
    struct exr truth = {0};
    bool fine = true;
    for (int i = 0; fine && i < SCENARIO_LAMPS_MOST; i++) {
        const struct lamp *lamp = world_lamp(world, i);
        struct exr one = {0};
        if (!lamp)
            continue;
        fine = ceiling_true_map(&lamp->image, world_output(world, at_ns, i),
                                s->scenario->ceiling.map_px, &one, err);
        for (int p = 0; fine && truth.pixels && p < truth.width * truth.height; p++)
            truth.pixels[p] += one.pixels[p];
        if (fine && !truth.pixels) {
            truth = one;
            continue;
        }
        exr_fini(&one);
    }
    snprintf(path, sizeof path, "%s/truth.exr", s->folder);
    fine = fine && exr_save(path, &truth, err);
    exr_fini(&truth);
    return fine;
}

static json_t *answer(const struct shoot *s)
{
    static const double SIDES[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    const struct ceiling_image *c = &s->ceiling[0];
    json_t *corners = json_array();
    for (int i = 0; i < 4; i++) {
        struct vec3 at = {c->centre.x + SIDES[i][0] * c->width_m, c->centre.y,
                          c->centre.z + SIDES[i][1] * c->depth_m};
        double x, y;
        if (lens_project(&s->lens, at, &x, &y))
            json_array_append_new(corners, json_pack("[f, f]", x, y));
    }
    return json_pack("{s: s, s: i, s: o}", "folder", s->folder, "frames",
                     s->scenario->ceiling_camera.exposures, "corners_px", corners);
}

static bool shoot(struct shoot *s, struct world *world, int64_t at_ns, struct error *err)
{
    char path[1200];
    if (mkdir(s->folder, 0777) && errno != EEXIST)
        return fail_errno(err, "%s", s->folder);
    snprintf(path, sizeof path, "%s/list.csv", s->folder);
    return gather_light(s, world, at_ns, err) && expose_scene(s, err) &&
           sensor_init(&s->sensor, &s->scenario->ceiling_camera, s->scenario->world.seed, err) &&
           write_calibration(s, err) && write_truth(s, world, at_ns, err) &&
           whole_file_begin(&s->list, path, err) && take_all(s, err) &&
           whole_file_commit(&s->list, err);
}

json_t *photograph(struct world *world, int64_t at_ns, const char *folder, struct error *err)
{
    const struct scenario *scenario = world_scenario(world);
    struct shoot *s = calloc(1, sizeof *s);
    if (!s) {
        fail(err, ERROR_SYSTEM, "out of memory");
        return NULL;
    }
    *s = (struct shoot){.scenario = scenario,
                        .folder = folder,
                        .lens = lens_make(&scenario->ceiling_camera),
                        .channels = scenario->ceiling_camera.colour ? 3 : 1};
    bool fine = shoot(s, world, at_ns, err) || while_doing(err, "photographing the ceiling");
    json_t *reply = fine ? answer(s) : NULL;
    whole_file_abandon(&s->list);
    sensor_fini(&s->sensor);
    for (int c = 0; c < 3; c++)
        ceiling_fini(&s->ceiling[c]);
    free(s->light);
    free(s->flat);
    free(s);
    return reply;
}
