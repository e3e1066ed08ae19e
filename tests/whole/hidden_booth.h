// SPDX-License-Identifier: Apache-2.0
// A booth whose instruments, map, pose and panel are off by what only the
// simulator knows, and what the product finds out in it. No wire, no clock.
// Include after cmocka.h.
#ifndef TESTS_WHOLE_HIDDEN_BOOTH_H
#define TESTS_WHOLE_HIDDEN_BOOTH_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/budget_booth.h"
#include "calibration/display_fit.h"
#include "calibration/patches.h"
#include "calibration/proof.h"
#include "calibration/report_steps.h"
#include "calibration/statistics.h"
#include "config/spectra.h"
#include "daemon/desk.h"
#include "drivers/irradiance.h"
#include "simulator/hidden.h"
#include "simulator/model_ooi_kind.h"
#include "simulator/model_pr655.h"
#include "simulator/panel.h"
#include "simulator/stand.h"
#include "simulator/world.h"

enum { PATCHES = 12, SPOTS = 7, TEACH = 10, LAMPS = 3, EXPOSURE_US = 30000, CORRECTIONS = 3 };
enum { TRUE_ACROSS = 120, TRUE_DOWN = 80, MAP_ACROSS = 60, MAP_DOWN = 40 };
static const double LUX = 600; // the radiometer then reads every spot of the ceiling
static const double COLLECTOR_LUX = 1000;
static const double PANEL_WHITE = 450; // twice the sample's: the chart uses most codes

// ---- what all sessions share -------------------------------------------------------

struct shared {
    struct spectra chart;
    struct scenario scenario;
    struct ocean_unit unit;
    struct ocean_axis *axis;
    struct detector_model *detectors[LAMPS];
    struct uncertainties u;
};

static struct shared shared;

static inline struct detector_model *make_detector(const struct ooi_kind *kind, uint64_t seed)
{
    struct detector_options o = {.zones = kind->zones,
                                 .full = kind->full,
                                 .saturation = kind->saturation,
                                 .collector_mm2 = 11.95,
                                 .seed = seed};
    for (int i = 0; i < 4; i++)
        o.wavelength[i] = shared.unit.wavelength[i] = strtod(kind->wavelength[i], NULL);
    for (int i = 0; i < 8; i++)
        o.nonlinearity[i] = shared.unit.nonlinearity[i] = strtod(kind->nonlinearity[i], NULL);
    return detector_create(&o);
}

// The calibration file as its maker wrote it, in memory.
static inline bool make_axis(struct error *err)
{
    static char text[40000] = "nm,uJ_per_count\n";
    struct table table;
    for (int nm = 345; nm <= 1000; nm++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%d,%.8e\n", nm,
                 detector_calibration(nm));
    shared.axis = calloc(1, sizeof *shared.axis);
    if (!shared.axis || !csv_parse("calibration", text, strlen(text), &table, err))
        return false;
    bool fine = ocean_axis_make(&shared.unit, &table, 11.95, shared.axis, err);
    table_fini(&table);
    return fine;
}

static inline int make_shared(void **state)
{
    (void)state;
    struct error err = {0};
    const struct ooi_kind *kind = ooi_kind(OOI_USB2000PLUS);
    shared.unit = (struct ocean_unit){
        .model = ocean_model(kind->product), .order = 7, .saturation = kind->saturation};
    bool fine = spectra_load("config/materials/colorchecker24.csv", true, &shared.chart, &err) &&
                scenario_load("simulator/scenarios/booth.ini", &shared.scenario, &err) &&
                uncertainties_load(NULL, &shared.u, &err);
    for (int i = 0; i < LAMPS; i++)
        shared.detectors[i] = make_detector(kind, (uint64_t)i + 1);
    fine = fine && make_axis(&err);
    for (int i = 0; i < LAMPS; i++)
        shared.scenario.lamps[i].lux = LUX;
    shared.scenario.panel.white_cdm2 = PANEL_WHITE;
    shared.scenario.ceiling.true_px[0] = TRUE_ACROSS;
    shared.scenario.ceiling.true_px[1] = TRUE_DOWN;
    shared.scenario.ceiling.map_px[0] = MAP_ACROSS;
    shared.scenario.ceiling.map_px[1] = MAP_DOWN;
    if (!fine)
        print_error("%s\n", err.text);
    return fine ? 0 : -1;
}

static inline int free_shared(void **state)
{
    (void)state;
    spectra_fini(&shared.chart);
    free(shared.axis);
    for (int i = 0; i < LAMPS; i++)
        detector_destroy(shared.detectors[i]);
    return 0;
}

// ---- one session ---------------------------------------------------------------------

struct session_here {
    struct scenario scenario;
    struct hidden hidden;
    struct lamp lamp;
    struct panel panel;
    struct pr655 *radiometer;
    struct spectrum light, seen; // that the radiometer looks at; as it takes it to be
    int64_t now_ns;
    // what is found out
    struct spectrum taught;
    double spread;
    struct luminance_map map;
    struct map_spot spots[SPOTS];
    double spot_scale[SPOTS];
    struct booth_light booth;
    // what is true
    struct spectrum irradiance; // on the screen
};

static inline void look(void *context, int64_t at_ns, struct spectrum *out)
{
    const struct session_here *s = context;
    (void)at_ns;
    *out = s->seen;
}

// Sends a command and gives what came back, time passing as it must.
static inline void talk(struct session_here *s, const char *command, char *out, size_t size)
{
    size_t got = 0;
    int64_t again = s->now_ns;
    for (const char *c = command; *c; c++)
        pr655_in(s->radiometer, s->now_ns, *c);
    while (again != INT64_MAX && got + 1 < size) {
        s->now_ns = again > s->now_ns ? again : s->now_ns;
        got += pr655_out(s->radiometer, s->now_ns, out + got, size - 1 - got, &again);
    }
    got += pr655_out(s->radiometer, s->now_ns, out + got, size - 1 - got, &again);
    out[got] = 0;
}

// What the radiometer reads: its spectrum on the grid, and XYZ summed over its
// own points.
static inline bool read_light(struct session_here *s, struct xyz *xyz, struct spectrum *radiance)
{
    char text[8192];
    double nm[PR655_POINTS], v[PR655_POINTS], sum[3] = {0};
    const struct spectrum *cmf = observer_cmf(OBSERVER_1931_2);
    hidden_sees(&s->hidden.radiometer, &s->light, &s->seen);
    talk(s, "M5\r", text, sizeof text);
    const char *line = strncmp(text, "00000", 5) ? NULL : strchr(text, '\n');
    for (int i = 0; i < PR655_POINTS; i++, line = strchr(line + 1, '\n')) {
        if (!line || sscanf(line, " %lf,%lf", &nm[i], &v[i]) != 2)
            return false;
        for (int c = 0; c < 3; c++)
            sum[c] += 683 * PR655_STEP_NM * v[i] * cmf[c].v[(int)nm[i] - SPECTRUM_FIRST_NM];
    }
    *xyz = (struct xyz){sum[0], sum[1], sum[2]};
    return spectrum_from_samples(nm, v, PR655_POINTS, false, radiance, NULL);
}

static inline void teach(struct session_here *s, uint64_t seed)
{
    struct spectrum light = s->lamp.per_lux, seen, readings[TEACH], sigma;
    struct ocean_process process = {0};
    struct noise noise;
    spectrum_scale(&light, COLLECTOR_LUX);
    hidden_sees(&s->hidden.spectrometer, &light, &seen);
    noise_init(&noise, seed, 't');
    for (int i = 0; i < TEACH; i++) {
        static _Thread_local struct ocean_reading reading;
        static _Thread_local uint16_t raw[MODEL_PIXELS_MOST];
        reading = (struct ocean_reading){.integration_us = EXPOSURE_US};
        detector_expose(shared.detectors[seed % LAMPS], &seen, EXPOSURE_US * 1e-6, 3600, &noise,
                        raw);
        ocean_reading_add(&shared.unit, shared.axis->used, raw, &reading);
        ocean_irradiance(&shared.unit, shared.axis, &process, &reading, &readings[i], &sigma, NULL);
    }
    teach_average(readings, TEACH, &s->taught, &s->spread);
}

// The camera's map, with the fall-off of its lens.
static inline bool photograph(struct session_here *s, int seed)
{
    struct exr image = {0};
    const struct scenario_ceiling *c = &s->scenario.ceiling;
    if (!ceiling_camera_map(&s->lamp.image, c, s->lamp.name, seed, &image, NULL))
        return false;
    s->map = (struct luminance_map){.ceiling = {.width_m = c->width_m, .depth_m = c->depth_m},
                                    .width = image.width,
                                    .height = image.height};
    memcpy(s->map.ceiling.centre_m, c->centre_m, sizeof c->centre_m);
    s->map.luminance = calloc((size_t)image.width * image.height, sizeof *s->map.luminance);
    for (int row = 0; s->map.luminance && row < image.height; row++)
        for (int column = 0; column < image.width; column++) {
            double x = 2 * (column + 0.5) / image.width - 1, z = 2 * (row + 0.5) / image.height - 1;
            const double *k = s->hidden.map_fall;
            double fall = 1 + k[0] * x + k[1] * z + k[2] * (x * x + z * z) / 2;
            size_t i = (size_t)row * image.width + column;
            s->map.luminance[i] = fmax(image.pixels[i], 0) * fall;
        }
    exr_fini(&image);
    return s->map.luminance != NULL;
}

// Spots of one lamp's bright places, spread over them.
static inline void choose_spots(struct session_here *s)
{
    const struct ceiling *c = &s->map.ceiling;
    for (int i = 0; i < SPOTS; i++) {
        double best = -1;
        for (int row = 0; row < MAP_DOWN; row++)
            for (int column = i * MAP_ACROSS / SPOTS; column < (i + 1) * MAP_ACROSS / SPOTS;
                 column++) {
                double x = c->centre_m[0] + c->width_m * ((column + 0.5) / MAP_ACROSS - 0.5);
                double z = c->centre_m[2] + c->depth_m * ((row + 0.5) / MAP_DOWN - 0.5);
                double l = s->lamp.image.luminance[2 * row * TRUE_ACROSS + 2 * column];
                if (l <= best)
                    continue;
                best = l;
                s->spots[i] = (struct map_spot){x, z};
            }
    }
}

static inline bool scale_map(struct session_here *s)
{
    double pixel = s->map.ceiling.width_m / MAP_ACROSS;
    for (int i = 0; i < SPOTS; i++) {
        struct xyz xyz;
        struct spectrum radiance;
        const struct map_spot *p = &s->spots[i];
        s->light = s->lamp.per_lux;
        spectrum_scale(&s->light, ceiling_spot(&s->lamp.image, p->x_m, p->z_m, pixel));
        if (!read_light(s, &xyz, &radiance))
            return false;
        s->spot_scale[i] = xyz.Y / luminance_map_spot(&s->map, p->x_m, p->z_m, pixel);
    }
    luminance_map_scale(&s->map, summarise(s->spot_scale, SPOTS).median);
    return true;
}

struct lab_here;
static inline void move_in(struct session_here *s, const struct lab_here *lab);

// lab NULL: with a panel and a radiometer of its own.
static inline bool set_up(struct session_here *s, int seed, const struct lab_here *lab,
                          struct error *err)
{
    s->scenario = shared.scenario;
    s->scenario.world.seed = seed;
    hidden_draw((uint64_t)seed, &s->hidden);
    const struct scenario_lamp *lamp = &s->scenario.lamps[seed % LAMPS];
    struct easel easel = easel_at(&s->scenario.stand, s->scenario.stand.tilt_deg);
    struct pr655_options o = {.around = {.context = s, .radiance = look},
                              .serial = "hidden",
                              .seed = (uint64_t)seed,
                              .hurry = 1};
    char text[256];
    panel_init(&s->panel, &s->scenario.panel, seed);
    if (lab)
        move_in(s, lab);
    if (!lamp_make(&s->scenario, lamp, easel.centre, easel.normal, &s->lamp, err) ||
        !(s->radiometer = pr655_create(&o)))
        return false;
    talk(s, "PHOTO\r", text, sizeof text);
    return true;
}

static inline void close_up(struct session_here *s)
{
    luminance_map_fini(&s->map);
    lamp_fini(&s->lamp);
    pr655_destroy(s->radiometer);
}

static inline void true_light(struct session_here *s)
{
    struct easel easel =
        easel_at(&s->scenario.stand, s->scenario.stand.tilt_deg + s->hidden.tilt_deg);
    struct vec3 p = vec3_add(easel.centre, (struct vec3){0, s->hidden.up_m, s->hidden.near_m});
    s->irradiance = s->lamp.per_lux;
    spectrum_scale(&s->irradiance,
                   (1 + s->hidden.level) * ceiling_illuminance(&s->lamp.image, p, easel.normal));
}

static inline bool find_out(struct session_here *s, int seed, struct error *err)
{
    struct stand stand;
    memcpy(stand.hinge_m, s->scenario.stand.hinge_m, sizeof stand.hinge_m);
    memcpy(stand.centre_from_hinge_m, s->scenario.stand.centre_from_hinge_m,
           sizeof stand.centre_from_hinge_m);
    teach(s, (uint64_t)seed);
    if (!photograph(s, seed))
        return false;
    choose_spots(s);
    return scale_map(s) && booth_light_at(&s->map, &stand, s->scenario.stand.tilt_deg, s->spots,
                                          SPOTS, &s->booth, err);
}

// ---- the chart -------------------------------------------------------------------------

static inline int chart_index(int patch)
{
    return patch * shared.chart.count / PATCHES;
}

static inline struct xyz sum_of(const struct spectrum *light, const struct spectrum *reflectance)
{
    struct spectrum s;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        s.v[i] = light->v[i] * (reflectance ? reflectance->v[i] : 1) / M_PI;
    return xyz_absolute(&s, OBSERVER_1931_2);
}

static inline struct mat3 light_of_primaries(const struct panel *panel)
{
    struct mat3 m, inverse = {{{0}}};
    for (int c = 0; c < 3; c++) {
        struct xyz p = xyz_absolute(&panel->primary[c], OBSERVER_1931_2);
        m.m[0][c] = p.X;
        m.m[1][c] = p.Y;
        m.m[2][c] = p.Z;
    }
    mat3_invert(m, &inverse);
    return inverse;
}

static inline void light_up(struct session_here *s, struct vec3 linear)
{
    const double v[3] = {linear.x, linear.y, linear.z};
    double code[3];
    struct spectrum reflected;
    for (int c = 0; c < 3; c++)
        code[c] = pow(fmin(fmax(v[c], 0), 1), 1 / 2.2);
    panel_patch(&s->panel, code, &s->light);
    panel_reflection(&s->panel, &s->irradiance, &reflected);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        s->light.v[i] += reflected.v[i];
}

// Comes as near to the sample as a good display model does: a few corrections.
static inline void show(struct session_here *s, const struct spectrum *reflectance)
{
    struct mat3 inverse = light_of_primaries(&s->panel);
    struct xyz aim = sum_of(&s->irradiance, reflectance), at = {0};
    struct vec3 linear = {0};
    for (int i = 0; i < CORRECTIONS; i++) {
        linear = vec3_add(
            linear, mat3_apply(inverse, (struct vec3){aim.X - at.X, aim.Y - at.Y, aim.Z - at.Z}));
        light_up(s, linear);
        at = xyz_absolute(&s->light, OBSERVER_1931_2);
    }
}

struct truth {
    struct xyz reference[PATCHES], screen[PATCHES], white;
};

static inline struct lab lab_in(const struct truth *t, bool published, const struct xyz *set, int i)
{
    struct lab lab = {0};
    if (!published) {
        lab_of(set[i], t->white, &lab, NULL);
        return lab;
    }
    double k = 1 / (PROOF_WHITE_PATCH * set[0].Y);
    struct xyz white = {t->white.X / t->white.Y, 1, t->white.Z / t->white.Y};
    struct xyz c = {k * set[i].X, k * set[i].Y, k * set[i].Z};
    lab_of(xyz_apply(proof_adaptation(white), c), proof_white, &lab, NULL);
    return lab;
}

// ---- a lab: a panel, a radiometer, and the display model made with it -----------------

struct lab_here {
    struct panel panel;
    struct hidden_instrument radiometer;
    struct display_model model;
    struct display_uncertainty uncertainty;
};

static inline bool read_codes(struct session_here *s, struct counts codes, struct xyz *out)
{
    struct spectrum radiance;
    panel_patch(&s->panel, (const double[3]){codes.r, codes.g, codes.b}, &s->light);
    return read_light(s, out, &radiance);
}

// In the dark, as boothcal display measure does.
static inline bool characterise(struct session_here *s, uint64_t seed, struct measurements *m,
                                struct error *err)
{
    const struct patch_sizes sizes = {
        .ramp_steps = 5, .near_black = 3, .random = 12, .white_every = 12};
    struct patch_set set = {0};
    bool fine = patch_set_characterise(&sizes, seed, &set, err);
    *m = (struct measurements){.path = "hidden", .display = "hidden", .absolute = true};
    m->patches = fine ? calloc((size_t)set.count, sizeof *m->patches) : NULL;
    for (int i = 0; fine && i < set.count; i++) {
        fine = read_codes(s, set.patches[i].counts, &set.patches[i].xyz);
        m->patches[m->count++] =
            (struct measured_patch){.counts = set.patches[i].counts, .xyz = set.patches[i].xyz};
    }
    fine = fine && patch_set_white(&set, &m->white);
    patch_set_fini(&set);
    return fine;
}

static inline bool lab_make(int seed, struct lab_here *lab, struct error *err)
{
    const enum display_kind kind = DISPLAY_INTERACTION; // such is the panel
    struct display_fit *found = calloc(1, sizeof *found);
    struct session_here *s = calloc(1, sizeof *s);
    struct measurements m = {0};
    bool fine = s && found && set_up(s, seed, NULL, err) &&
                characterise(s, (uint64_t)seed, &m, err) &&
                display_fit(&m, &kind, &lab->model, found, err);
    if (fine) {
        lab->panel = s->panel;
        lab->radiometer = s->hidden.radiometer;
        lab->uncertainty = found->uncertainty;
    }
    measurements_fini(&m);
    if (s)
        close_up(s);
    free(s);
    free(found);
    return fine;
}

static inline void move_in(struct session_here *s, const struct lab_here *lab)
{
    s->panel = lab->panel;
    s->hidden.radiometer = lab->radiometer;
}

// ---- what the eye sees -------------------------------------------------------------------

static inline double sin2_from(const struct easel *easel, struct vec3 eye)
{
    double cosine = vec3_dot(vec3_unit(vec3_sub(eye, easel->centre)), easel->normal);
    return 1 - cosine * cosine;
}

// Light over what the product corrects for, the eye being elsewhere.
static inline double eye_gain(const struct session_here *s)
{
    struct easel easel = easel_at(&s->scenario.stand, s->scenario.stand.tilt_deg);
    const double *e = s->scenario.head.eye_m;
    struct vec3 believed = {e[0], e[1], e[2]};
    struct vec3 truly = vec3_add(believed, s->hidden.eye_m);
    return panel_angle_gain(1, sin2_from(&easel, truly)) /
           panel_angle_gain(1, sin2_from(&easel, believed));
}

// What leaves for the eye at those codes: the panel has drifted, its surface
// reflects a little more or less than was measured.
static inline struct xyz seen(struct session_here *s, const double code[3])
{
    struct spectrum light, reflected;
    double gain = (1 + s->hidden.drift) * eye_gain(s);
    panel_patch(&s->panel, code, &light);
    panel_reflection(&s->panel, &s->irradiance, &reflected);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        light.v[i] = gain * light.v[i] + (1 + s->hidden.reflection) * reflected.v[i];
    return xyz_absolute(&light, OBSERVER_1931_2);
}

#endif
