// SPDX-License-Identifier: Apache-2.0
// What each clock of the proof costs: per lamp change, per pose, per frame.
// Medians over interleaved runs; quote the ratios, not the times.
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/statistics.h"
#include "colorimetry/display_table.h"
#include "render/material.h"
#include "render/reference.h"
#include "render/renderer.h"

#include "colorimetry/illuminant.h"

enum { RUNS = 9, MAP_WIDTH = 256, MAP_HEIGHT = 170, WIDTH = 1280, HEIGHT = 800 };

struct bench {
    // The later ones are for the other kinds of display model and for poses, so
    // that each redoes its own stages only.
    struct renderer *renderer, *interacting, *corrected, *posed;
    struct scene scene;
    struct material material;
    struct luminance_map map, large;
    struct light_points lights;
    struct spectrum lamp;
    struct display_model display, interaction, residual;
    struct band_set bands;
};

static bool patch_frame(struct bench *b, struct error *err)
{
    struct scene patch = b->scene;
    patch.kind = SCENE_PATCH;
    patch.patch = (struct counts){0.5, 0.5, 0.5};
    return renderer_show(b->renderer, &patch, true, NULL, err);
}

static bool frame(struct bench *b, struct error *err)
{
    return renderer_show(b->renderer, &b->scene, true, NULL, err);
}

static bool frame_of(struct bench *b, struct renderer *renderer, const struct display_model *model,
                     struct error *err)
{
    struct scene scene = b->scene;
    scene.display = model;
    return renderer_show(renderer, &scene, true, NULL, err);
}

static bool frame_interaction(struct bench *b, struct error *err)
{
    return frame_of(b, b->interacting, &b->interaction, err);
}

static bool frame_residual(struct bench *b, struct error *err)
{
    return frame_of(b, b->corrected, &b->residual, err);
}

static bool residual_table(struct bench *b, struct error *err)
{
    struct display_table *table = display_table_create(&b->residual, err);
    free(table);
    return table;
}

static bool pose(struct bench *b, struct error *err)
{
    static int turn;
    struct stand stand = {{0, 0, 0}, {0, 0.2, 0.03}};
    struct scene scene = b->scene;
    scene.booth_from_screen = stand_pose(&stand, 30 + 0.1 * (++turn % 7));
    return renderer_show(b->posed, &scene, true, NULL, err);
}

static bool matrix(struct bench *b, struct error *err)
{
    struct band_matrix m;
    return band_matrix_adapted(&b->bands, &b->lamp, OBSERVER_1931_2, &m, err);
}

static bool bake(struct bench *b, struct error *err)
{
    struct xyz white;
    float *texels = material_bake(&b->material, &b->lamp, OBSERVER_1931_2, SPECTRAL_BANDS, &b->bands, &white, err);
    free(texels);
    return texels;
}

static bool cut(struct bench *b, struct error *err)
{
    struct light_points lights;
    if (!median_cut(&b->map, CUT_VARIANCE, 32, &lights, err))
        return false;
    light_points_fini(&lights);
    return true;
}

static bool cut_large(struct bench *b, struct error *err)
{
    struct light_points lights;
    if (!median_cut(&b->large, CUT_VARIANCE, 1024, &lights, err))
        return false;
    light_points_fini(&lights);
    return true;
}

static bool reference_row(struct bench *b, struct error *err)
{
    (void)err;
    double sum = 0;
    for (int x = 0; x < WIDTH; x++)
        sum += reference_pixel(&b->scene, x, HEIGHT / 2).emitted.Y;
    return isfinite(sum);
}

static const struct measure {
    const char *name;
    bool (*run)(struct bench *b, struct error *err);
} MEASURES[] = {
    {"patch frame (fill and present)", patch_frame}, {"surface frame", frame},
    {"likewise, display with interaction", frame_interaction},
    {"likewise, display with residual", frame_residual},
    {"table of a residual per display", residual_table},
    {"surface frame after a pose change", pose},      {"band matrix per lamp", matrix},
    {"bake of the chart per lamp", bake},             {"median cut, 32 lights", cut},
    {"median cut, 4096 x 2048, 1024 lights", cut_large},
    {"reference, one row of pixels", reference_row},
};
enum { MEASURES_COUNT = sizeof MEASURES / sizeof *MEASURES };

static void fill_map(struct luminance_map *map, int width, int height)
{
    *map = (struct luminance_map){.ceiling = {{0, 0.75, 0.05}, 0.9, 0.6},
                                  .width = width,
                                  .height = height,
                                  .luminance = calloc((size_t)width * height, sizeof(double))};
    for (int y = 0; map->luminance && y < height; y++)
        for (int x = 0; x < width; x++)
            map->luminance[(size_t)y * width + x] = y % 60 < 8 ? 9000 : 80;
}

static bool fill_display(struct display_model *d, struct error *err)
{
    const double matrix_cdm2[3][4] = {{438, 239, 178, 0.3}, {206, 622, 71, 0.3}, {0, 41, 939, 0.3}};
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < DISPLAY_NODES; i++)
            d->curve[c][i] = pow(i / (DISPLAY_NODES - 1.0), 2.2);
    memcpy(d->matrix, matrix_cdm2, sizeof matrix_cdm2);
    return display_model_prepare(d, err);
}

// Like those of panels whose channels take a tenth from each other.
static bool fill_others(struct bench *b, struct error *err)
{
    static const double terms[3][DISPLAY_TERMS] = {
        {-34, -9, -11, 9, -6, 2}, {-36, -22, -9, 4, 17, -1}, {-1, -31, -38, 0, 1, 19}};
    b->interaction = b->residual = b->display;
    b->interaction.kind = DISPLAY_INTERACTION;
    memcpy(b->interaction.interaction, terms, sizeof terms);
    b->residual.kind = DISPLAY_RESIDUAL;
    b->residual.residual = (struct lattice){.least = {-10, -110, -130}, .most = {110, 115, 115}};
    for (int k = 0; k < LATTICE_NODES; k++)
        for (int n = 0; n < 3; n++)
            b->residual.residual.node[k][n] = 4 * sin(0.1 * k + n);
    return display_model_prepare(&b->interaction, err) && display_model_prepare(&b->residual, err);
}

static bool begin(struct bench *b, struct error *err)
{
    static char names[24][64];
    struct spectrum palette[24];
    struct stand stand = {{0, 0, 0}, {0, 0.2, 0.03}};
    struct renderer_options options = {.width = WIDTH, .height = HEIGHT};
    for (int i = 0; i < 24; i++) {
        snprintf(names[i], sizeof names[i], "%d", i);
        for (int k = 0; k < SPECTRUM_COUNT; k++)
            palette[i].v[k] = 0.1 + 0.8 * exp(-pow((k - 20.0 * i) / 60, 2));
    }
    fill_map(&b->map, MAP_WIDTH, MAP_HEIGHT);
    fill_map(&b->large, 4096, 2048);
    if (!b->map.luminance || !b->large.luminance || !illuminant("FL8", &b->lamp, err) || !band_set_shipped(6, &b->bands, err) ||
        !fill_display(&b->display, err) || !fill_others(b, err) ||
        !material_chart("chart", palette, names, 24, 6, 4, 0.1, 0, &b->material, err) ||
        !median_cut(&b->map, CUT_VARIANCE, 32, &b->lights, err) ||
        !(b->renderer = renderer_create(&options, err)) ||
        !(b->interacting = renderer_create(&options, err)) ||
        !(b->corrected = renderer_create(&options, err)) ||
        !(b->posed = renderer_create(&options, err)))
        return false;
    b->scene = (struct scene){.kind = SCENE_SURFACE,
                              .screen = {0.52, 0.325, WIDTH, HEIGHT},
                              .booth_from_screen = stand_pose(&stand, 30),
                              .eye = {0, 0.55, 0.65},
                              .lights = &b->lights,
                              .lights_generation = 1,
                              .level = 1,
                              .texels_width = b->material.width,
                              .texels_height = b->material.height,
                              .texels_generation = 1,
                              .texel_offset = {0.5, 0.5, 0},
                              .texel_scale_x = 0.52,
                              .texel_scale_y = 0.325,
                              .screen_reflectance = 0.002,
                              .display = &b->display,
                              .display_generation = 1,
                              .bits = 8,
                              .dither = true};
    b->scene.texels = material_bake(&b->material, &b->lamp, OBSERVER_1931_2, SPECTRAL_FULL, NULL,
                                    &b->scene.white, err);
    return b->scene.texels;
}

static bool run(struct bench *b, double seconds[MEASURES_COUNT][RUNS], struct error *err)
{
    for (int r = -1; r < RUNS; r++) {
        for (int m = 0; m < MEASURES_COUNT; m++) {
            int64_t from = clock_now_ns();
            if (!MEASURES[m].run(b, err))
                return while_doing(err, "%s", MEASURES[m].name);
            if (r >= 0)
                seconds[m][r] = (double)(clock_now_ns() - from) / NS_PER_S;
        }
    }
    return true;
}

static void print(const struct bench *b, double seconds[MEASURES_COUNT][RUNS], FILE *table, FILE *json)
{
    double unit = summarise(seconds[0], RUNS).median;
    json_t *rows = json_array();
    fprintf(table, "%s, %d x %d, medians of %d interleaved runs\n", renderer_name(b->renderer), WIDTH,
            HEIGHT, RUNS);
    fprintf(table, "%-36s %10s %12s\n", "", "ms", "/ patch frame");
    for (int m = 0; m < MEASURES_COUNT; m++) {
        double median = summarise(seconds[m], RUNS).median;
        fprintf(table, "%-36s %10.3f %12.3f\n", MEASURES[m].name, 1000 * median, median / unit);
        json_array_append_new(rows, json_pack("{ss,sf,sf}", "name", MEASURES[m].name, "ms",
                                              1000 * median, "ratio", median / unit));
    }
    json_t *out = json_pack("{ss,si,si,si,so}", "renderer", renderer_name(b->renderer), "width", WIDTH,
                            "height", HEIGHT, "runs", RUNS, "rows", rows);
    json_dumpf(out, json, JSON_INDENT(1) | JSON_REAL_PRECISION(6));
    json_decref(out);
}

int main(int argc, char **argv)
{
    struct bench b = {0};
    struct error err = {0};
    double seconds[MEASURES_COUNT][RUNS];
    FILE *json = argc == 2 ? fopen(argv[1], "w") : NULL;
    bool fine = json && begin(&b, &err) && run(&b, seconds, &err);
    if (fine)
        print(&b, seconds, stdout, json);
    else
        fprintf(stderr, "bench: %s\n", json ? err.text : "usage: bench OUT.json");
    if (json)
        fclose(json);
    renderer_destroy(b.renderer);
    renderer_destroy(b.interacting);
    renderer_destroy(b.corrected);
    renderer_destroy(b.posed);
    return !fine;
}
