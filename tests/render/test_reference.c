// SPDX-License-Identifier: Apache-2.0
#include "tests/render/surface.h"

static const double ROUNDING = 1e-12;
static const double TEXEL = 1e-6; // texels are single precision

static void one_light_straight_above_gives_what_the_hand_computes(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    // A flat screen of 161 x 101 pixels has its centre pixel at (0, 0.03, -0.2).
    struct light_point point = {{0, 0.75, -0.2}, 500};
    struct light_points lights = {1, &point};
    s.scene.lights = &lights;
    s.scene.screen.width_px = 161;
    s.scene.screen.height_px = 101;
    surface_tilt(&s, 0);
    struct pixel pixel = reference_pixel(&s.scene, 80, 50);
    double lux = 500 / (0.72 * 0.72), white_y = lux / M_PI;
    const float *texel = s.texels[2 * SURFACE_COLUMNS + 3];
    assert_relative(pixel.illuminance, lux, ROUNDING);
    assert_relative(pixel.surface.Y, texel[1] * white_y, TEXEL);
    assert_relative(pixel.emitted.X, (texel[0] - 0.002 * 0.9505) * white_y, TEXEL);
    assert_relative(pixel.emitted.Y, (texel[1] - 0.002) * white_y, TEXEL);
    assert_relative(pixel.emitted.Z, (texel[2] - 0.002 * 1.0891) * white_y, TEXEL);
    surface_fini(&s);
}

static void counts_sent_through_the_display_give_the_wanted_light(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    int inside = 0;
    for (int y = 5; y < SURFACE_HEIGHT; y += 10)
        for (int x = 5; x < SURFACE_WIDTH; x += 10) {
            struct pixel pixel = reference_pixel(&s.scene, x, y);
            struct xyz shown = display_forward(&s.display, pixel.inverse.counts);
            if (!pixel.inverse.in_gamut)
                continue;
            inside++;
            assert_relative(shown.X, pixel.emitted.X, 1e-9);
            assert_relative(shown.Y, pixel.emitted.Y, 1e-9);
            assert_relative(shown.Z, pixel.emitted.Z, 1e-9);
        }
    assert_true(inside > 100);
    surface_fini(&s);
}

static void a_dimmed_lamp_dims_everything_by_the_same_share(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    struct pixel full = reference_pixel(&s.scene, 100, 60);
    s.scene.level = 0.25;
    struct pixel dim = reference_pixel(&s.scene, 100, 60);
    assert_true(full.emitted.Y > 0);
    assert_relative(dim.illuminance, 0.25 * full.illuminance, ROUNDING);
    assert_relative(dim.emitted.X, 0.25 * full.emitted.X, ROUNDING);
    assert_relative(dim.emitted.Z, 0.25 * full.emitted.Z, ROUNDING);
    surface_fini(&s);
}

// In gamut the models give back what was wanted, to half a code.
static void what_is_sent_is_the_surface_within_a_code(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    s.scene.dither = true;
    struct pixel exact = reference_pixel(&s.scene, 80, 50);
    assert_true(exact.inverse.in_gamut);
    assert_relative(exact.sent.X, exact.surface.X, 1e-6);
    assert_relative(exact.sent.Y, exact.surface.Y, 1e-6);
    assert_relative(exact.sent.Z, exact.surface.Z, 1e-6);
    s.scene.dither = false;
    struct pixel rounded = reference_pixel(&s.scene, 80, 50);
    assert_relative(rounded.sent.Y, exact.surface.Y, 0.02); // a code of 8 bits at gamma 2.2
    assert_true(rounded.sent.Y != exact.sent.Y);
    surface_fini(&s);
}

static void outside_the_material_it_is_black_and_in_gamut(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    s.scene.texel_scale_x = 0.26; // the middle half of the screen
    struct pixel pixel = reference_pixel(&s.scene, 30, 50);
    assert_true(pixel.illuminance > 0);
    assert_true(pixel.emitted.Y == 0 && pixel.inverse.counts.g == 0 && pixel.inverse.in_gamut);
    assert_true(reference_pixel(&s.scene, 50, 50).emitted.Y > 0);
    assert_int_equal(scene_texel_column(&s.scene, 39), -1);
    assert_int_equal(scene_texel_column(&s.scene, 40), 0);
    assert_int_equal(scene_texel_column(&s.scene, 119), SURFACE_COLUMNS - 1);
    assert_int_equal(scene_texel_column(&s.scene, 120), -1);
    surface_fini(&s);
}

static void the_first_texel_is_at_the_top_left(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    assert_int_equal(scene_texel_column(&s.scene, 0), 0);
    assert_int_equal(scene_texel_row(&s.scene, 0), 0);
    assert_int_equal(scene_texel_row(&s.scene, SURFACE_HEIGHT - 1), SURFACE_ROWS - 1);
    s.scene.texel_offset.y = 0.25; // the centre shows a place higher up
    assert_int_equal(scene_texel_row(&s.scene, SURFACE_HEIGHT / 2), 1);
    assert_int_equal(scene_texel_row(&s.scene, 0), -1);
    surface_fini(&s);
}

static void darker_than_the_screens_own_reflection_is_flagged(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    memset(s.texels, 0, sizeof s.texels);
    struct pixel pixel = reference_pixel(&s.scene, 80, 50);
    assert_true(pixel.emitted.Y < 0);
    assert_false(pixel.inverse.in_gamut);
    assert_true(pixel.inverse.counts.r == 0);
    surface_fini(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_light_straight_above_gives_what_the_hand_computes),
        cmocka_unit_test(counts_sent_through_the_display_give_the_wanted_light),
        cmocka_unit_test(a_dimmed_lamp_dims_everything_by_the_same_share),
        cmocka_unit_test(what_is_sent_is_the_surface_within_a_code),
        cmocka_unit_test(outside_the_material_it_is_black_and_in_gamut),
        cmocka_unit_test(the_first_texel_is_at_the_top_left),
        cmocka_unit_test(darker_than_the_screens_own_reflection_is_flagged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
