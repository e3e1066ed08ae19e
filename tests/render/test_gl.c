// SPDX-License-Identifier: Apache-2.0
#include "tests/render/surface.h"

// Single precision through some thirty operations; the sum of lights and the
// difference to the screen's reflection cost two digits.
static const double XYZ_RELATIVE = 1e-4;
static const double XYZ_FLOOR = 1e-4; // cd/m2; of what flare subtraction leaves near 0
// Rounding to whole codes, and single precision at the half-way line.
static const double CODE = 0.5 + 2e-3;

// In linear light: the renderer's tolerance and as much again for its sums.
static const double GAMUT = 3e-6;

static struct renderer *renderer;

static int open_renderer(void **state)
{
    (void)state;
    struct error err = {0};
    struct renderer_options options = {.width = SURFACE_WIDTH, .height = SURFACE_HEIGHT};
    renderer = renderer_create(&options, &err);
    if (renderer)
        printf("%s\n", renderer_name(renderer));
    else
        printf("skipped: no OpenGL through EGL here: %s\n", err.text);
    return renderer || strncmp(err.text, "EGL: no ", 8) == 0 ? 0 : -1;
}

static int close_renderer(void **state)
{
    (void)state;
    renderer_destroy(renderer);
    return 0;
}

static void show(const struct scene *scene)
{
    struct error err = {0};
    if (!renderer)
        skip();
    assert_good(renderer_show(renderer, scene, false, NULL, &err), err);
}

static uint8_t *counts_shown(void)
{
    struct error err = {0};
    uint8_t *counts = renderer_counts(renderer, &err);
    assert_good(counts, err);
    return counts;
}

static float *xyz_shown(void)
{
    struct error err = {0};
    float *xyz = renderer_xyz(renderer, &err);
    assert_good(xyz, err);
    return xyz;
}

// Where single precision may decide otherwise than double.
static bool on_the_gamut_surface(const struct display_inverse *inverse)
{
    const double linear[3] = {inverse->linear.r, inverse->linear.g, inverse->linear.b};
    bool near = false;
    for (int c = 0; c < 3; c++)
        near = near || fabs(linear[c]) < GAMUT || fabs(linear[c] - 1) < GAMUT;
    return near;
}

// Every pixel of an undithered frame against the double reference; returns
// the greatest relative error of XYZ.
static double compare(const struct scene *scene)
{
    show(scene);
    uint8_t *counts = counts_shown();
    float *xyz = xyz_shown();
    double most = 0;
    long outside = 0, doubtful = 0;
    for (int y = 0; y < SURFACE_HEIGHT; y++)
        for (int x = 0; x < SURFACE_WIDTH; x++) {
            struct pixel want = reference_pixel(scene, x, y);
            double wanted[6] = {want.emitted.X,        want.emitted.Y,
                                want.emitted.Z,        want.inverse.counts.r,
                                want.inverse.counts.g, want.inverse.counts.b};
            for (int c = 0; c < 3; c++) {
                int i = 3 * (y * SURFACE_WIDTH + x) + c;
                double room = XYZ_RELATIVE * fabs(wanted[c]) + XYZ_FLOOR;
                if (!(fabs(xyz[i] - wanted[c]) <= room))
                    fail_msg("pixel %d, %d: %.9g cd/m2, wanted %.9g", x, y, xyz[i], wanted[c]);
                if (!(fabs(counts[i] - 255 * wanted[3 + c]) <= CODE))
                    fail_msg("pixel %d, %d: code %d, wanted %.4f", x, y, counts[i],
                             255 * wanted[3 + c]);
                if (fabs(wanted[c]) > 1)
                    most = fmax(most, fabs(xyz[i] / wanted[c] - 1));
            }
            outside += !want.inverse.in_gamut;
            doubtful += on_the_gamut_surface(&want.inverse);
        }
    double pixels = SURFACE_WIDTH * SURFACE_HEIGHT;
    assert_float_within(renderer_out_of_gamut(renderer), outside / pixels,
                        (doubtful + 0.5) / pixels);
    free(counts);
    free(xyz);
    return most;
}

static void every_pixel_agrees_with_the_reference_over_tilts_lamps_and_levels(void **state)
{
    (void)state;
    struct surface s;
    double (*const patterns[])(double, double) = {tubes, spots, uniform_light};
    static const double tilts[] = {-90, -30, 0, 30, 60, 80, 90, 100, 180};
    double most = 0;
    surface_init(&s);
    for (size_t k = 0; k < 3; k++) {
        surface_light(&s, patterns[k], 32);
        surface_paint(&s, k == 1);
        for (size_t t = 0; t < sizeof tilts / sizeof tilts[0]; t++) {
            surface_tilt(&s, tilts[t]);
            s.scene.level = 0.2 + 0.3 * (t % 4);
            most = fmax(most, compare(&s.scene));
        }
    }
    print_message("greatest relative error of XYZ above 1 cd/m2: %.1e\n", most);
    surface_fini(&s);
}

static void every_pixel_agrees_with_the_reference_from_every_eye(void **state)
{
    (void)state;
    static const struct vec3 eyes[] = {{0, 0.55, 0.65}, {-0.4, 0.5, 0.6}, {0.3, 0.9, 0.2},
                                       {1.5, 0.3, 0.1}, {0, -0.5, 0.4}}; // the last two beyond all
    static const double tilts[] = {0, 30, 75};
    struct surface s;
    surface_init(&s);
    for (size_t e = 0; e < sizeof eyes / sizeof *eyes; e++) {
        surface_view(&s, eyes[e]);
        for (size_t t = 0; t < sizeof tilts / sizeof *tilts; t++) {
            surface_tilt(&s, tilts[t]);
            compare(&s.scene);
        }
    }
    surface_fini(&s);
}

static void an_eye_that_moves_is_drawn_for_only_where_the_angle_counts(void **state)
{
    (void)state;
    struct surface s;
    struct error err = {0};
    bool drawn = false;
    if (!renderer)
        skip();
    surface_init(&s);
    show(&s.scene);
    s.scene.eye.x += 0.1;
    assert_good(renderer_show(renderer, &s.scene, false, &drawn, &err), err);
    assert_false(drawn);
    surface_view(&s, s.scene.eye);
    show(&s.scene);
    s.scene.eye.x += 0.1;
    assert_good(renderer_show(renderer, &s.scene, false, &drawn, &err), err);
    assert_true(drawn);
    surface_fini(&s);
}

static void from_one_to_4096_lights_agree_with_the_reference(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    for (int most = 1; most <= 4096; most *= 16) {
        surface_light(&s, tubes, most);
        assert_int_equal(s.lights.count, most);
        compare(&s.scene);
    }
    surface_light(&s, no_light, 32);
    compare(&s.scene);
    s.scene.lights = NULL;
    compare(&s.scene);
    surface_fini(&s);
}

static void a_screen_through_the_ceiling_is_dark_above_it_and_finite_everywhere(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    surface_tilt(&s, 90);
    s.scene.booth_from_screen.translation = (struct vec3){0, 0.75, -0.05};
    show(&s.scene);
    float *xyz = xyz_shown();
    for (int i = 0; i < 3 * SURFACE_WIDTH * SURFACE_HEIGHT; i++) {
        assert_true(isfinite(xyz[i]));
        if (i < 3 * SURFACE_WIDTH * SURFACE_HEIGHT / 2)
            assert_true(xyz[i] == 0);
    }
    free(xyz);
    surface_fini(&s);
}

static void a_lifted_screen_face_down_or_above_the_lamp_is_black(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    surface_tilt(&s, 0);
    s.scene.booth_from_screen.translation.y = 1.5;
    compare(&s.scene);
    surface_tilt(&s, 180);
    compare(&s.scene);
    surface_fini(&s);
}

static void what_is_not_finite_never_reaches_the_display(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    for (int i = 0; i < 24; i++)
        s.texels[i][i % 3] = i % 2 ? NAN : INFINITY;
    s.scene.texels_generation++;
    show(&s.scene);
    float *xyz = xyz_shown();
    for (int i = 0; i < 3 * SURFACE_WIDTH * SURFACE_HEIGHT; i++)
        assert_true(isfinite(xyz[i]));
    free(xyz);
    struct scene patch = {.kind = SCENE_PATCH, .patch = {NAN, INFINITY, -1}, .bits = 8};
    show(&patch);
    uint8_t *counts = counts_shown();
    assert_true(counts[0] == 0 && counts[1] == 255 && counts[2] == 0);
    free(counts);
    surface_fini(&s);
}

static void dither_keeps_the_mean_and_moves_no_pixel_by_a_whole_code(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    s.scene.dither = true;
    // One texel over the whole screen, lit evenly enough to compare means of
    // a tile of 64 x 64 with the mean of the reference over it.
    s.scene.texels_width = s.scene.texels_height = 1;
    surface_light(&s, uniform_light, 32);
    for (int grey = 2; grey <= 90; grey += 22) {
        for (int c = 0; c < 3; c++)
            s.texels[0][c] = grey / 100.0f;
        s.scene.texels_generation++;
        show(&s.scene);
        uint8_t *counts = counts_shown();
        double got[3] = {0}, wanted[3] = {0};
        for (int i = 0; i < 64 * 64; i++) {
            int x = 16 + i % 64, y = 16 + i / 64;
            struct pixel p = reference_pixel(&s.scene, x, y);
            double count[3] = {p.inverse.counts.r, p.inverse.counts.g, p.inverse.counts.b};
            for (int c = 0; c < 3; c++) {
                int code = counts[3 * (y * SURFACE_WIDTH + x) + c];
                assert_true(fabs(code - 255 * count[c]) < 1 + 2e-3);
                got[c] += code / 4096.0;
                wanted[c] += 255 * count[c] / 4096;
            }
        }
        for (int c = 0; c < 3; c++)
            assert_float_within(got[c], wanted[c], 0.02); // 1/100 code, and the shading's slope
        free(counts);
    }
    surface_fini(&s);
}

static void the_channels_do_not_share_their_dither(void **state)
{
    (void)state;
    struct surface s;
    int alike = 0, differ[2] = {0};
    surface_init(&s);
    s.scene.dither = true;
    show(&s.scene);
    uint8_t *counts = counts_shown();
    for (int i = 0; i < SURFACE_WIDTH * SURFACE_HEIGHT; i++) {
        struct pixel p = reference_pixel(&s.scene, i % SURFACE_WIDTH, i / SURFACE_WIDTH);
        double count[3] = {p.inverse.counts.r, p.inverse.counts.g, p.inverse.counts.b};
        bool up[3], half = true;
        for (int c = 0; c < 3; c++) {
            double code = 255 * count[c];
            up[c] = counts[3 * i + c] > floor(code);
            half = half && fabs(code - floor(code) - 0.5) < 0.2;
        }
        // With one pattern for all, codes whose fractions are near 1/2 would
        // go up together but for the fractions' differences.
        alike += half;
        differ[0] += half && up[1] != up[0];
        differ[1] += half && up[2] != up[0];
    }
    assert_true(alike > 200);
    assert_true(differ[0] > 0.35 * alike && differ[1] > 0.35 * alike);
    free(counts);
    surface_fini(&s);
}

static void a_patch_shows_exactly_its_code_and_half_goes_up(void **state)
{
    (void)state;
    for (int code = 0; code <= 255; code++) {
        struct scene patch = {.kind = SCENE_PATCH, .bits = 8, .dither = true};
        patch.patch = (struct counts){code / 255.0, (code - 0.4999) / 255, (code + 0.5) / 255};
        show(&patch);
        uint8_t *counts = counts_shown();
        for (int i = 0; i < SURFACE_WIDTH * SURFACE_HEIGHT; i += 997) {
            assert_int_equal(counts[3 * i], code);
            assert_int_equal(counts[3 * i + 1], code);
            assert_int_equal(counts[3 * i + 2], code < 255 ? code + 1 : 255);
        }
        free(counts);
    }
}

static void dark_is_black_and_keeps_the_last_surface(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    show(&s.scene);
    float *before = xyz_shown();
    struct scene dark = {.kind = SCENE_DARK};
    show(&dark);
    uint8_t *counts = counts_shown();
    float *after = xyz_shown();
    for (int i = 0; i < 3 * SURFACE_WIDTH * SURFACE_HEIGHT; i++)
        assert_true(counts[i] == 0 && after[i] == before[i]);
    free(before);
    free(after);
    free(counts);
    surface_fini(&s);
}

static void ten_bits_are_four_times_finer(void **state)
{
    (void)state;
    struct surface s;
    struct error err = {0};
    surface_init(&s);
    s.scene.bits = 10;
    show(&s.scene);
    // Read back as 8 bits, a 10-bit code is off by its own half and by the 8-bit half.
    uint8_t *counts = counts_shown();
    for (int y = 0; y < SURFACE_HEIGHT; y += 7)
        for (int x = 0; x < SURFACE_WIDTH; x += 7) {
            struct pixel p = reference_pixel(&s.scene, x, y);
            assert_float_within(counts[3 * (y * SURFACE_WIDTH + x) + 1], 255 * p.inverse.counts.g,
                                0.5 + 0.125 + 2e-3);
        }
    free(counts);
    s.scene.bits = 8;
    assert_good(renderer_show(renderer, &s.scene, false, NULL, &err), err);
    compare(&s.scene);
    surface_fini(&s);
}

static bool drawn_again(const struct scene *scene, bool force)
{
    struct error err = {0};
    bool drawn;
    assert_good(renderer_show(renderer, scene, force, &drawn, &err), err);
    return drawn;
}

static void only_a_changed_scene_is_drawn_again(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    show(&s.scene);
    assert_false(drawn_again(&s.scene, false));
    assert_true(drawn_again(&s.scene, true));
    s.scene.eye.x += 0.1; // nothing here is glossy
    assert_false(drawn_again(&s.scene, false));
    s.scene.level = 0.9;
    assert_true(drawn_again(&s.scene, false));
    s.scene.lights_generation++;
    assert_true(drawn_again(&s.scene, false));
    s.scene.texels_generation++;
    assert_true(drawn_again(&s.scene, false));
    s.scene.display_generation++;
    assert_true(drawn_again(&s.scene, false));
    s.scene.texel_offset.x = 0.4;
    assert_true(drawn_again(&s.scene, false));
    surface_tilt(&s, 31);
    assert_true(drawn_again(&s.scene, false));
    assert_false(drawn_again(&s.scene, false));
    compare(&s.scene);
    surface_fini(&s);
}

static void stages_follow_when_inputs_change_between_other_scenes(void **state)
{
    (void)state;
    struct surface s;
    surface_init(&s);
    compare(&s.scene);
    show(&(struct scene){.kind = SCENE_PATCH, .patch = {1, 1, 1}, .bits = 8});
    surface_light(&s, spots, 16);
    surface_paint(&s, true);
    surface_tilt(&s, 50);
    compare(&s.scene);
    surface_fini(&s);
}

static void a_scene_of_another_size_or_without_material_is_refused(void **state)
{
    (void)state;
    struct surface s;
    struct error err = {0};
    surface_init(&s);
    show(&s.scene);
    s.scene.screen.width_px++;
    assert_false(renderer_show(renderer, &s.scene, false, NULL, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    s.scene.screen.width_px--;
    s.scene.texels = NULL;
    assert_false(renderer_show(renderer, &s.scene, false, NULL, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    s.scene.texels = s.texels[0];
    compare(&s.scene);
    surface_fini(&s);
}

static void two_renderers_live_side_by_side(void **state)
{
    (void)state;
    struct surface s;
    struct error err = {0};
    struct renderer_options options = {.width = 32, .height = 16};
    surface_init(&s);
    show(&s.scene);
    struct renderer *other = renderer_create(&options, &err);
    assert_good(other, err);
    struct scene patch = {.kind = SCENE_PATCH, .patch = {0.2, 0.4, 0.6}, .bits = 8};
    assert_good(renderer_show(other, &patch, false, NULL, &err), err);
    compare(&s.scene);
    uint8_t *counts = renderer_counts(other, &err);
    assert_good(counts, err);
    assert_true(counts[0] == 51 && counts[1] == 102 && counts[2] == 153);
    free(counts);
    renderer_destroy(other);
    s.scene.level = 0.5;
    compare(&s.scene);
    surface_fini(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pixel_agrees_with_the_reference_over_tilts_lamps_and_levels),
        cmocka_unit_test(every_pixel_agrees_with_the_reference_from_every_eye),
        cmocka_unit_test(an_eye_that_moves_is_drawn_for_only_where_the_angle_counts),
        cmocka_unit_test(from_one_to_4096_lights_agree_with_the_reference),
        cmocka_unit_test(a_screen_through_the_ceiling_is_dark_above_it_and_finite_everywhere),
        cmocka_unit_test(a_lifted_screen_face_down_or_above_the_lamp_is_black),
        cmocka_unit_test(what_is_not_finite_never_reaches_the_display),
        cmocka_unit_test(dither_keeps_the_mean_and_moves_no_pixel_by_a_whole_code),
        cmocka_unit_test(the_channels_do_not_share_their_dither),
        cmocka_unit_test(a_patch_shows_exactly_its_code_and_half_goes_up),
        cmocka_unit_test(dark_is_black_and_keeps_the_last_surface),
        cmocka_unit_test(ten_bits_are_four_times_finer),
        cmocka_unit_test(only_a_changed_scene_is_drawn_again),
        cmocka_unit_test(stages_follow_when_inputs_change_between_other_scenes),
        cmocka_unit_test(a_scene_of_another_size_or_without_material_is_refused),
        cmocka_unit_test(two_renderers_live_side_by_side),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
