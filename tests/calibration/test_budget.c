// SPDX-License-Identifier: Apache-2.0
#include "calibration/budget.h"

#include <math.h>
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#undef fail

#include "calibration/budget_booth.h"
#include "calibration/budget_modes.h"
#include "colorimetry/illuminant.h"
#include "colorimetry/rendering.h"
#include "tests/fakes/folder.h"
#include "tests/fakes/near.h"

enum { PATCHES = 4, DRAWS = 4000, SEED = 7 };
#define SCATTER 0.05 // of a standard deviation from DRAWS draws: 1 / sqrt(2 DRAWS), four times
#define SMALL 1e-4   // of what should not be there at all
#define EXACT 1e-12
#define SENSITIVITY 0.15 // of figures computed with another 1 nm model of the same thing

// A white, a grey and two test colours under D65, shown nearly right.
struct sample_booth {
    struct budget_patch patches[PATCHES];
    struct budget_input in;
};

static struct xyz shown(const struct spectrum *lamp, const struct spectrum *r, double lux, double k)
{
    struct xyz c = xyz_relative(lamp, r, OBSERVER_1931_2);
    double scale = k * lux / 100 / acos(-1);
    return (struct xyz){scale * c.X, scale * c.Y, scale * c.Z};
}

static struct sample_booth *booth_of(const char *lamp)
{
    struct sample_booth *b = calloc(1, sizeof *b);
    b->in = (struct budget_input){.observer = OBSERVER_1931_2,
                                  .lux = 1000,
                                  .count = PATCHES,
                                  .patches = b->patches,
                                  .shares = true};
    b->in.u.spectrometer_waves = b->in.u.radiometer_waves = 3;
    assert_true(illuminant(lamp, &b->in.lamp, NULL));
    for (int i = 0; i < PATCHES; i++) {
        struct budget_patch *p = &b->patches[i];
        if (i < 2)
            for (int k = 0; k < SPECTRUM_COUNT; k++)
                p->reflectance.v[k] = i ? 0.2 : 1;
        else
            test_colour(i, &p->reflectance);
        p->screen = shown(&b->in.lamp, &p->reflectance, b->in.lux, 1 + 0.003 * i);
        p->counts = true;
    }
    return b;
}

static struct budget made(const struct sample_booth *b)
{
    struct budget out = {0};
    struct error err = {0};
    if (!budget_make(&b->in, DRAWS, SEED, &out, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    return out;
}

// 116/3 per unit of ln Y at white, over S_L = 1 + 0.015 2500 / sqrt(20 + 2500).
static void one_per_cent_of_luminance_is_022_at_white(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("D65");
    b->in.u.radiometer_level = 0.01;
    struct budget out = made(b);
    assert_near(out.absolute[0].L.u, 0.2213, SCATTER * 0.2213);
    assert_near(out.absolute[0].C.u, 0, 2e-3); // white has no chroma to scale
    assert_near(out.published[0].L.u, 0, SMALL);
    assert_near(out.absolute[0].L.share[CAUSE_RADIOMETER_CALIBRATION], 1, EXACT);
    budget_fini(&out);
    free(b);
}

static void a_map_scaled_by_the_same_radiometer_takes_its_level_out(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("D65");
    b->in.u.radiometer_level = 0.01;
    b->in.map_by_radiometer = true;
    struct budget out = made(b);
    for (int i = 0; i < PATCHES; i++)
        assert_near(out.absolute[i].L.u, 0, 5e-3); // both move alike: only their difference scales
    budget_fini(&out);
    free(b);
}

// x, y of the white moved by one standard deviation of a mode.
static double moved_by(const char *lamp, enum budget_cause cause, const struct uncertainties *u)
{
    struct sample_booth *b = booth_of(lamp);
    struct budget_modes m;
    b->in.u = *u;
    b->in.u.spectrometer_waves = b->in.u.radiometer_waves = 1;
    assert_true(budget_modes_make(&b->in, &m, NULL));
    struct xyz w = m.reference[PATCHES];
    struct xy at = xy_of(w);
    double most = 0;
    for (int k = 0; k < m.count; k++)
        if (m.modes[k].cause == cause && m.modes[k].reference) {
            struct xyz d = m.modes[k].reference[PATCHES];
            struct xy c = xy_of((struct xyz){w.X + d.X, w.Y + d.Y, w.Z + d.Z});
            most = fmax(most, fmax(fabs(c.x - at.x), fabs(c.y - at.y)));
        }
    budget_modes_fini(&m);
    free(b);
    return most;
}

// Chromaticities move by what another 1 nm model of such instruments gave.
static void spectrometer_errors_move_white_as_known(void **state)
{
    (void)state;
    static const struct {
        const char *lamp;
        double shift, slope; // by 0.5 nm; by 2 % over 180 nm
    } known[] = {{"A", 3e-4, 1.4e-3}, {"D65", 3.6e-4, 1.5e-3}, {"FL8", 2.6e-4, 1.6e-3}};
    struct uncertainties shift = {.spectrometer_nm = 0.5}, slope = {.spectrometer_slope = 0.02};
    for (int i = 0; i < 3; i++) {
        double by_shift = moved_by(known[i].lamp, CAUSE_SPECTROMETER_WAVELENGTH, &shift);
        double by_slope = moved_by(known[i].lamp, CAUSE_SPECTROMETER_CALIBRATION, &slope);
        assert_near(by_shift / known[i].shift, 1, 2 * SENSITIVITY); // given with one digit
        assert_near(by_slope / known[i].slope, 1, SENSITIVITY);
    }
}

static void shares_sum_to_one_and_name_only_causes_in_scope(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("FL8");
    assert_true(uncertainties_load(NULL, &b->in.u, NULL));
    b->in.lamp_noise = 0.003;
    b->in.by_up = 2;
    struct budget measured = made(b);
    b->in.scope = SCOPE_SHOWN;
    b->in.display_rms = (struct vec3){0.2, 0.2, 0.2};
    b->in.reflectance = 0.002;
    struct budget out = made(b);
    for (int i = 0; i < PATCHES; i++) {
        const struct budget_figure *f[] = {&measured.absolute[i].L, &measured.absolute[i].E,
                                           &out.absolute[i].H, &out.published[i].E};
        for (int k = 0; k < 4; k++) {
            double sum = 0;
            for (int c = 0; c < CAUSES; c++)
                sum += f[k]->share[c];
            assert_near(sum, 1, EXACT);
        }
        assert_true(f[0]->share[CAUSE_DISPLAY_MODEL] == 0);
        assert_true(f[0]->share[CAUSE_DRIFT] == 0);
        assert_true(f[2]->share[CAUSE_DISPLAY_MODEL] > 0.01);
        assert_true(f[2]->share[CAUSE_RADIOMETER_REPEATABILITY] == 0);
        assert_true(out.absolute[i].E.u > 0 && measured.absolute[i].E.u > 0);
    }
    budget_fini(&measured);
    budget_fini(&out);
    free(b);
}

static void a_display_model_off_by_some_dE00_is_that_uncertain(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("D65");
    b->in.scope = SCOPE_SHOWN;
    b->in.display_rms = (struct vec3){0.3 / sqrt(3), 0.3 / sqrt(3), 0.3 / sqrt(3)};
    struct budget out = made(b);
    for (int i = 2; i < PATCHES; i++) { // neutrals have no hue to be off in
        const struct budget_difference *d = &out.absolute[i];
        double all = sqrt(d->L.u * d->L.u + d->C.u * d->C.u + d->H.u * d->H.u);
        assert_near(all, 0.3, 2 * SCATTER * 0.3); // a third each way
    }
    budget_fini(&out);
    free(b);
}

static void a_residual_of_lightness_alone_is_told_as_such(void **state)
{
    (void)state;
    const struct xyz white = {95, 100, 109}, grey = {19, 20, 21.8}, lighter = {19.4, 20.42, 22.26};
    struct lab a, b;
    struct vec3 r = budget_residual(&grey, &lighter, 1, white);
    assert_true(lab_of(grey, white, &a, NULL) && lab_of(lighter, white, &b, NULL));
    assert_near(r.x, delta_lch_2000(a, b).L, 0.01 * r.x); // the metric is that of small steps
    assert_true(r.x > 0.4 && r.y < 0.05 && r.z < 0.05);
    struct vec3 none = budget_residual(&grey, &grey, 1, white);
    assert_near(none.x + none.y + none.z, 0, EXACT);
}

static void twice_the_uncertainties_give_twice_the_uncertainty(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("FL11");
    b->in.u.spectrometer_slope = 0.002;
    b->in.u.radiometer_repeat = 0.001;
    b->in.u.tilt_deg = 0.05;
    b->in.by_tilt = 0.02;
    struct budget once = made(b);
    b->in.u.spectrometer_slope *= 2;
    b->in.u.radiometer_repeat *= 2;
    b->in.u.tilt_deg *= 2;
    struct budget twice = made(b);
    for (int i = 1; i < PATCHES; i++) {
        assert_near(twice.absolute[i].L.u / once.absolute[i].L.u, 2, 0.02); // nearly linear
        assert_near(twice.published[i].L.u / once.published[i].L.u, 2, 0.02);
    }
    budget_fini(&once);
    budget_fini(&twice);
    free(b);
}

static void the_same_seed_gives_the_same_budget_on_any_number_of_threads(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("D50");
    assert_true(uncertainties_load(NULL, &b->in.u, NULL));
    omp_set_num_threads(1);
    struct budget one = made(b);
    omp_set_num_threads(3);
    struct budget three = made(b);
    assert_memory_equal(one.absolute, three.absolute, PATCHES * sizeof *one.absolute);
    assert_memory_equal(one.published, three.published, PATCHES * sizeof *one.published);
    assert_true(one.absolute_all.mean_u == three.absolute_all.mean_u);
    budget_fini(&one);
    budget_fini(&three);
    free(b);
}

static void values_are_the_differences_themselves(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("D65");
    struct budget out = made(b);
    struct xyz white = shown(&b->in.lamp, NULL, b->in.lux, 1);
    double sum = 0, most = 0;
    for (int i = 0; i < PATCHES; i++) {
        struct lab r, s;
        assert_true(
            lab_of(shown(&b->in.lamp, &b->patches[i].reflectance, b->in.lux, 1), white, &r, NULL));
        assert_true(lab_of(b->patches[i].screen, white, &s, NULL));
        assert_near(out.absolute[i].E.value, delta_e_2000(r, s), 1e-9);
        assert_near(out.absolute[i].L.value, delta_lch_2000(r, s).L, 1e-9);
        assert_near(out.absolute[i].E.u, 0, 1e-9);
        sum += out.absolute[i].E.value;
        most = fmax(most, out.absolute[i].E.value);
    }
    assert_near(out.absolute_all.mean, sum / PATCHES, 1e-12);
    assert_near(out.absolute_all.max, most, 1e-12);
    budget_fini(&out);
    free(b);
}

static void a_budget_without_light_is_refused(void **state)
{
    (void)state;
    struct sample_booth *b = booth_of("A");
    struct budget out;
    struct error err = {0};
    b->in.lux = 0;
    assert_false(budget_make(&b->in, DRAWS, SEED, &out, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    b->in.lux = 100;
    memset(&b->in.lamp, 0, sizeof b->in.lamp);
    assert_false(budget_make(&b->in, DRAWS, SEED, &out, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_false(budget_make(&b->in, 10, SEED, &out, &err));
    free(b);
}

static void verdicts_keep_a_guard_band(void **state)
{
    (void)state;
    assert_int_equal(verdict_of(0.5, 0.3, 1), VERDICT_PASS);
    assert_int_equal(verdict_of(0.8, 0.3, 1), VERDICT_UNDECIDED);
    assert_int_equal(verdict_of(1.2, 0.3, 1), VERDICT_UNDECIDED);
    assert_int_equal(verdict_of(1.4, 0.3, 1), VERDICT_FAIL);
    assert_int_equal(verdict_of(0.7, 0.3, 1), VERDICT_PASS);
    assert_int_equal(verdict_of(NAN, 0.3, 1), VERDICT_UNDECIDED);
}

static void uncertainties_come_from_a_file_or_from_presets(void **state)
{
    (void)state;
    struct folder folder;
    struct uncertainties preset, own;
    struct error err = {0};
    folder_open(&folder);
    assert_true(uncertainties_load("", &preset, NULL));
    assert_true(preset.radiometer_level > 0 && preset.spectrometer_waves > 0);
    const char *path = folder_put(&folder, "u.ini", "[uncertainty]\nradiometer_level = 0.02\n");
    assert_true(uncertainties_load(path, &own, NULL));
    assert_true(own.radiometer_level == 0.02);
    assert_true(own.tilt_deg == preset.tilt_deg);
    path = folder_put(&folder, "bad.ini", "[uncertainty]\ntilt_deg = -1\n");
    assert_false(uncertainties_load(path, &own, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    folder_close(&folder);
}

// ---- the booth -------------------------------------------------------------------

enum { SIDE = 64 };

static struct luminance_map map_of(double (*luminance)(double x, double z))
{
    struct luminance_map map = {
        .ceiling = {.centre_m = {0, 1, 0}, .width_m = 0.02, .depth_m = 0.02},
        .width = SIDE,
        .height = SIDE,
        .luminance = calloc(SIDE * SIDE, sizeof(double))};
    for (int row = 0; row < SIDE; row++)
        for (int column = 0; column < SIDE; column++)
            map.luminance[row * SIDE + column] =
                luminance(2 * (column + 0.5) / SIDE - 1, 2 * (row + 0.5) / SIDE - 1);
    return map;
}

static double even(double x, double z)
{
    (void)x, (void)z;
    return 1000;
}

// A small lamp straight above: E = I cos(tilt) / d^2.
static void light_from_straight_above_follows_the_inverse_square(void **state)
{
    (void)state;
    struct luminance_map map = map_of(even);
    struct stand stand = {0};
    struct booth_light l;
    assert_true(booth_light_at(&map, &stand, 30, NULL, 0, &l, NULL));
    double intensity = 1000 * 0.02 * 0.02;
    assert_near(l.lux, intensity * cos(30 * acos(-1) / 180), 1e-3 * l.lux); // 2 cm at 1 m
    assert_near(l.by_up, 2, 0.01);                                          // 2 / d, d = 1 m
    assert_near(l.by_tilt, -tan(30 * acos(-1) / 180) * acos(-1) / 180, 1e-4);
    luminance_map_fini(&map);
}

static void a_map_that_falls_off_alike_everywhere_is_scaled_back(void **state)
{
    (void)state;
    struct luminance_map map = map_of(even);
    struct stand stand = {0};
    struct booth_light l;
    assert_true(booth_light_at(&map, &stand, 0, NULL, 0, &l, NULL));
    for (int k = 0; k < 3; k++)
        assert_near(l.by_shape[k], 0, 1e-3); // a lamp seen as a point has no shape
    // spots at one corner only: where the map is off by all of its fall
    const struct map_spot corner[] = {{0.01, 0.01}};
    assert_true(booth_light_at(&map, &stand, 0, corner, 1, &l, NULL));
    assert_near(l.by_shape[0], -1, 1e-3);
    assert_near(l.by_shape[1], -1, 1e-3);
    assert_near(l.by_shape[2], 1.0 / 3 - 1, 1e-3); // mean of (x2 + z2) / 2 is 1/3
    luminance_map_fini(&map);
}

static void what_the_shape_makes_of_the_spots_is_not_counted_twice(void **state)
{
    (void)state;
    struct booth_light l = {.spots_by_shape = 0.5};
    struct uncertainties u = {.map_shape = 0.02, .radiometer_repeat = 0.001};
    double alone = map_scale_uncertainty(&l, &u, 0.01, 4);
    assert_near(alone, sqrt(acos(-1) / 2) * 0.001 / 2, 1e-12);
    u.map_shape = 0;
    assert_near(map_scale_uncertainty(&l, &u, 0.01, 4), sqrt(acos(-1) / 2) * 0.01 / 2, 1e-12);
}

static void a_dark_screen_has_no_light_to_be_uncertain_about(void **state)
{
    (void)state;
    struct luminance_map map = map_of(even);
    struct stand stand = {.centre_from_hinge_m = {0, 0, 3}}; // above the ceiling
    struct booth_light l;
    struct error err = {0};
    assert_false(booth_light_at(&map, &stand, 0, NULL, 0, &l, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    luminance_map_fini(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_per_cent_of_luminance_is_022_at_white),
        cmocka_unit_test(a_map_scaled_by_the_same_radiometer_takes_its_level_out),
        cmocka_unit_test(spectrometer_errors_move_white_as_known),
        cmocka_unit_test(shares_sum_to_one_and_name_only_causes_in_scope),
        cmocka_unit_test(a_display_model_off_by_some_dE00_is_that_uncertain),
        cmocka_unit_test(a_residual_of_lightness_alone_is_told_as_such),
        cmocka_unit_test(twice_the_uncertainties_give_twice_the_uncertainty),
        cmocka_unit_test(the_same_seed_gives_the_same_budget_on_any_number_of_threads),
        cmocka_unit_test(values_are_the_differences_themselves),
        cmocka_unit_test(a_budget_without_light_is_refused),
        cmocka_unit_test(verdicts_keep_a_guard_band),
        cmocka_unit_test(uncertainties_come_from_a_file_or_from_presets),
        cmocka_unit_test(light_from_straight_above_follows_the_inverse_square),
        cmocka_unit_test(a_map_that_falls_off_alike_everywhere_is_scaled_back),
        cmocka_unit_test(what_the_shape_makes_of_the_spots_is_not_counted_twice),
        cmocka_unit_test(a_dark_screen_has_no_light_to_be_uncertain_about),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
