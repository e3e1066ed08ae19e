// SPDX-License-Identifier: Apache-2.0
// Whether the stated uncertainty is true: hundreds of sessions, each in a booth
// whose instruments, map and pose are off by what only the simulator knows.
// The product's own computations run on what those instruments say; the truth
// comes from the simulator's physics. No wire, no clock.
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail

#include "base/clock.h"
#include "calibration/budget_booth.h"
#include "calibration/proof.h"
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

#ifdef __SANITIZE_ADDRESS__
enum { SESSIONS = 24 };
static const double COVER_LEAST = 0.85, COVER_MOST = 1; // few sessions scatter
#else
enum { SESSIONS = 408 };
static const double COVER_LEAST = 0.92, COVER_MOST = 0.98; // as asked: 95 % within 3
#endif

enum {
    DRAWS = 400,
    PATCHES = 12,
    SPOTS = 7,
    TEACH = 10,
    LAMPS = 3,
    EXPOSURE_US = 30000,
    CORRECTIONS = 3
};
enum { TRUE_ACROSS = 120, TRUE_DOWN = 80, MAP_ACROSS = 60, MAP_DOWN = 40 };
static const double LUX = 400; // the radiometer then reads every spot of the ceiling
static const double COLLECTOR_LUX = 1000;

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

static struct detector_model *make_detector(const struct ooi_kind *kind, uint64_t seed)
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
static bool make_axis(struct error *err)
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

static int make_shared(void **state)
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
    shared.scenario.ceiling.true_px[0] = TRUE_ACROSS;
    shared.scenario.ceiling.true_px[1] = TRUE_DOWN;
    shared.scenario.ceiling.map_px[0] = MAP_ACROSS;
    shared.scenario.ceiling.map_px[1] = MAP_DOWN;
    if (!fine)
        print_error("%s\n", err.text);
    return fine ? 0 : -1;
}

static int free_shared(void **state)
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

static void look(void *context, int64_t at_ns, struct spectrum *out)
{
    const struct session_here *s = context;
    (void)at_ns;
    *out = s->seen;
}

// Sends a command and gives what came back, time passing as it must.
static void talk(struct session_here *s, const char *command, char *out, size_t size)
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
static bool read_light(struct session_here *s, struct xyz *xyz, struct spectrum *radiance)
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

static void teach(struct session_here *s, uint64_t seed)
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
static bool photograph(struct session_here *s, int seed)
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
static void choose_spots(struct session_here *s)
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

static bool scale_map(struct session_here *s)
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

static bool set_up(struct session_here *s, int seed, struct error *err)
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
    if (!lamp_make(&s->scenario, lamp, easel.centre, easel.normal, &s->lamp, err) ||
        !(s->radiometer = pr655_create(&o)))
        return false;
    talk(s, "PHOTO\r", text, sizeof text);
    return true;
}

static void true_light(struct session_here *s)
{
    struct easel easel =
        easel_at(&s->scenario.stand, s->scenario.stand.tilt_deg + s->hidden.tilt_deg);
    struct vec3 p = vec3_add(easel.centre, (struct vec3){0, s->hidden.up_m, s->hidden.near_m});
    s->irradiance = s->lamp.per_lux;
    spectrum_scale(&s->irradiance,
                   (1 + s->hidden.level) * ceiling_illuminance(&s->lamp.image, p, easel.normal));
}

static bool find_out(struct session_here *s, int seed, struct error *err)
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

static int chart_index(int patch)
{
    return patch * shared.chart.count / PATCHES;
}

static struct xyz sum_of(const struct spectrum *light, const struct spectrum *reflectance)
{
    struct spectrum s;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        s.v[i] = light->v[i] * (reflectance ? reflectance->v[i] : 1) / M_PI;
    return xyz_absolute(&s, OBSERVER_1931_2);
}

static struct mat3 light_of_primaries(const struct panel *panel)
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

static void light_up(struct session_here *s, struct vec3 linear)
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
static void show(struct session_here *s, const struct spectrum *reflectance)
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

static struct lab lab_in(const struct truth *t, bool published, const struct xyz *set, int i)
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

// How often the truth lies within U, by figure: L, C, H of both ways.
struct tally {
    int within[2][3], all[2][3];
    double z2[2][3]; // squares of error over u
};

static void count(struct tally *t, int way, int figure, const struct budget_figure *f, double truth)
{

    t->within[way][figure] += fabs(f->value - truth) <= 2 * f->u;
    t->all[way][figure]++;
    t->z2[way][figure] += pow((f->value - truth) / f->u, 2);
}

// White is exact as published: both sets are divided by it.
static void tally_session(const struct budget *b, const struct truth *truth, struct tally *t)
{
    for (int way = 0; way < 2; way++)
        for (int i = way; i < PATCHES; i++) {
            struct lab a = lab_in(truth, way, truth->reference, i);
            struct delta_lch d = delta_lch_2000(a, lab_in(truth, way, truth->screen, i));
            const struct budget_difference *stated = way ? &b->published[i] : &b->absolute[i];
            count(t, way, 0, &stated->L, d.L);
            count(t, way, 1, &stated->C, d.C);
            count(t, way, 2, &stated->H, d.H);
        }
}

static void fill_input(const struct session_here *s, struct budget_input *in)
{
    struct summary spots = summarise(s->spot_scale, SPOTS);
    *in = (struct budget_input){.u = shared.u,
                                .scope = SCOPE_MEASURED,
                                .observer = OBSERVER_1931_2,
                                .lamp = s->taught,
                                .lamp_noise = s->spread / sqrt(TEACH),
                                .map_by_radiometer = true,
                                .count = PATCHES};
    booth_light_into(&s->booth, spots.std / spots.mean, SPOTS, in);
}

static bool measure_chart(struct session_here *s, struct budget_patch *patches,
                          struct spectrum *radiances, struct truth *truth)
{
    for (int i = 0; i < PATCHES; i++) {
        // white first, then every other patch
        int at = i ? chart_index(i) : 18;
        patches[i].reflectance = shared.chart.spectra[at];
        patches[i].radiance = &radiances[i];
        patches[i].counts = true;
        show(s, &patches[i].reflectance);
        truth->reference[i] = sum_of(&s->irradiance, &patches[i].reflectance);
        truth->screen[i] = xyz_absolute(&s->light, OBSERVER_1931_2);
        if (!read_light(s, &patches[i].screen, &radiances[i]))
            return false;
    }
    truth->white = sum_of(&s->irradiance, NULL);
    return true;
}

static bool state_and_compare(struct session_here *s, int seed, struct tally *t, struct error *err)
{
    struct budget_patch *patches = calloc(PATCHES, sizeof *patches);
    struct spectrum *radiances = calloc(PATCHES, sizeof *radiances);
    struct budget_input in;
    struct budget b = {0};
    struct truth truth;
    fill_input(s, &in);
    in.patches = patches;
    bool fine = patches && radiances && measure_chart(s, patches, radiances, &truth) &&
                budget_make(&in, DRAWS, (uint64_t)seed, &b, err);
    if (fine)
        tally_session(&b, &truth, t);
    budget_fini(&b);
    free(patches);
    free(radiances);
    return fine;
}

static bool session(int seed, struct tally *t, struct error *err)
{
    struct session_here *s = calloc(1, sizeof *s);
    bool fine = s && set_up(s, seed, err);
    if (fine)
        true_light(s);
    fine = fine && find_out(s, seed, err) && state_and_compare(s, seed, t, err);
    if (s) {
        luminance_map_fini(&s->map);
        lamp_fini(&s->lamp);
        pr655_destroy(s->radiometer);
    }
    free(s);
    return fine;
}

// ---- the test ----------------------------------------------------------------------------

static void stated_uncertainties_cover_the_truth(void **state)
{
    (void)state;
    static struct tally each[SESSIONS];
    static bool fine[SESSIONS];
    struct tally all = {0};
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < SESSIONS; i++)
        fine[i] = session(1000 + i, &each[i], NULL);
    for (int i = 0; i < SESSIONS; i++) {
        assert_true(fine[i]);
        for (int k = 0; k < 6; k++) {
            all.within[k / 3][k % 3] += each[i].within[k / 3][k % 3];
            all.all[k / 3][k % 3] += each[i].all[k / 3][k % 3];
            all.z2[k / 3][k % 3] += each[i].z2[k / 3][k % 3];
        }
    }
    for (int way = 0; way < 2; way++)
        for (int k = 0; k < 3; k++) {
            double share = (double)all.within[way][k] / all.all[way][k];
            print_message(
                "%s, delta %c: U covers the truth in %.1f %% of %d, rms error over u %.2f\n",
                way ? "as published" : "absolute", "LCH"[k], 100 * share, all.all[way][k],
                sqrt(all.z2[way][k] / all.all[way][k]));
            assert_true(share >= COVER_LEAST && share <= COVER_MOST);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stated_uncertainties_cover_the_truth),
    };
    return cmocka_run_group_tests(tests, make_shared, free_shared);
}
