// SPDX-License-Identifier: Apache-2.0
#include "simulator/panel.h"

#include "colorimetry/colour.h"
#include "simulator/chance.h"
#include "tests/simulator/cmocka_here.h"

#define SETTLED 1e-9  // relative: white and black are scaled to what was asked
#define D65_XY 1e-4   // the white point as CIE 15 rounds it
#define P3_XY 0.02    // "P3-like": beyond this another gamut's name would fit better
#define ANGLE 0.005   // the published figures have two digits
#define ADDITIVE 1e-9 // relative: with nothing to disturb them channels add up
#define FLARE 0.02    // relative: the coating is not quite neutral
#define ONE_GREY_LEVEL 1e-12

static struct panel panel;

static int a_panel(void **state)
{
    (void)state;
    struct scenario s;
    scenario_preset(&s);
    panel_init(&panel, &s.panel, 1);
    return 0;
}

static struct panel panel_with(double interaction, double dispersion)
{
    struct scenario s;
    struct panel p;
    scenario_preset(&s);
    s.panel.interaction = interaction;
    s.panel.dispersion = dispersion;
    panel_init(&p, &s.panel, 1);
    return p;
}

static struct xyz patch_of(const struct panel *p, double r, double g, double b)
{
    struct spectrum s;
    panel_patch(p, (double[3]){r, g, b}, &s);
    return xyz_absolute(&s, OBSERVER_1931_2);
}

static struct xyz patch(double r, double g, double b)
{
    return patch_of(&panel, r, g, b);
}

static void white_is_as_asked_and_d65(void **state)
{
    (void)state;
    struct xyz white = patch(1, 1, 1);
    assert_near(white.Y, 900, 900 * SETTLED);
    assert_near(xy_of(white).x, 0.3127, D65_XY);
    assert_near(xy_of(white).y, 0.3290, D65_XY);
}

static void black_leaks_light_of_another_colour_than_white(void **state)
{
    (void)state;
    struct xyz black = patch(0, 0, 0);
    assert_near(black.Y, 0.3, 0.3 * SETTLED);
    assert_true(xy_of(black).x < xy_of(patch(1, 1, 1)).x - 0.01);
}

static void primaries_are_near_p3(void **state)
{
    (void)state;
    static const double p3[3][2] = {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}};
    for (int c = 0; c < 3; c++) {
        struct xy at = xy_of(patch(c == 0, c == 1, c == 2));
        assert_near(at.x, p3[c][0], P3_XY);
        assert_near(at.y, p3[c][1], P3_XY);
    }
}

static double sum_over_white(const struct panel *p)
{
    double sum = patch_of(p, 1, 0, 0).Y + patch_of(p, 0, 1, 0).Y + patch_of(p, 0, 0, 1).Y;
    return (sum - 2 * patch_of(p, 0, 0, 0).Y) / patch_of(p, 1, 1, 1).Y;
}

static void channels_do_not_add_up(void **state)
{
    (void)state;
    double excess = sum_over_white(&panel) - 1;
    assert_true(excess > 0.01 && excess < 0.05);
}

static void without_interaction_channels_add_up_at_every_level(void **state)
{
    (void)state;
    struct panel ideal = panel_with(0, 1);
    for (int i = 1; i <= 4; i++) {
        double v = i * 51 / 255.0;
        double sum = patch_of(&ideal, v, 0, 0).Y + patch_of(&ideal, 0, v, 0).Y +
                     patch_of(&ideal, 0, 0, v).Y - 2 * patch_of(&ideal, 0, 0, 0).Y;
        double together = patch_of(&ideal, v, v, v).Y;
        assert_near(sum, together, ADDITIVE * together);
    }
}

static void a_primary_changes_its_colour_with_its_drive(void **state)
{
    (void)state;
    struct panel steady = panel_with(1, 0);
    for (int c = 0; c < 3; c++) {
        struct xyz black = patch(0, 0, 0), full = patch(c == 0, c == 1, c == 2);
        struct xyz half = patch(0.5 * (c == 0), 0.5 * (c == 1), 0.5 * (c == 2));
        struct uv a = uv_of((struct xyz){full.X - black.X, full.Y - black.Y, full.Z - black.Z});
        struct uv b = uv_of((struct xyz){half.X - black.X, half.Y - black.Y, half.Z - black.Z});
        assert_true(hypot(a.u - b.u, a.v - b.v) > 0.0003);
        full = patch_of(&steady, c == 0, c == 1, c == 2);
        half = patch_of(&steady, 0.5 * (c == 0), 0.5 * (c == 1), 0.5 * (c == 2));
        a = uv_of((struct xyz){full.X - black.X, full.Y - black.Y, full.Z - black.Z});
        b = uv_of((struct xyz){half.X - black.X, half.Y - black.Y, half.Z - black.Z});
        assert_near(hypot(a.u - b.u, a.v - b.v), 0, 1e-9);
    }
}

// The plainest model there is: ramps give the curves, primaries the matrix.
static double error_of_adding_up(int count)
{
    struct xyz white = patch(1, 1, 1), black = patch(0, 0, 0);
    struct chance chance = chance_start(11, "patches", 0);
    double sum = 0;
    for (int i = 0; i < count; i++) {
        double r = chance_uniform(&chance), g = chance_uniform(&chance),
               b = chance_uniform(&chance);
        struct xyz seen = patch(r, g, b), x = patch(r, 0, 0), y = patch(0, g, 0),
                   z = patch(0, 0, b);
        struct xyz added = {x.X + y.X + z.X - 2 * black.X, x.Y + y.Y + z.Y - 2 * black.Y,
                            x.Z + y.Z + z.Z - 2 * black.Z};
        struct lab one, other;
        assert_true(lab_of(seen, white, &one, NULL) && lab_of(added, white, &other, NULL));
        sum += delta_e_2000(one, other);
    }
    return sum / count;
}

static void adding_up_channels_misses_by_a_visible_but_modest_amount(void **state)
{
    (void)state;
    double error = error_of_adding_up(200);
    assert_true(error > 0.25 && error < 1.0);
}

static void every_curve_rises_strictly_at_both_depths(void **state)
{
    (void)state;
    for (int bits = 8; bits <= 10; bits += 2)
        for (int seed = 1; seed <= 20; seed++) {
            struct scenario s;
            struct panel p;
            scenario_preset(&s);
            s.panel.bits = bits;
            panel_init(&p, &s.panel, seed);
            for (int c = 0; c < 3; c++)
                for (int code = 1; code < 1 << bits; code++)
                    assert_true(p.curve[c][code] > p.curve[c][code - 1]);
        }
}

static void the_curves_differ_from_each_other_and_from_a_power(void **state)
{
    (void)state;
    double apart = 0, off = 0;
    for (int code = 64; code < 255; code++) {
        apart = fmax(apart, fabs(panel.curve[0][code] / panel.curve[2][code] - 1));
        double gamma = log(panel.curve[1][128]) / log(128 / 255.0);
        off = fmax(off, fabs(panel.curve[1][code] / pow(code / 255.0, gamma) - 1));
    }
    assert_true(apart > 0.02);
    assert_true(off > 0.003);
}

static double white_at(double deg)
{
    struct panel_light light = {0};
    struct spectrum s;
    double sine = sin(deg * M_PI / 180);
    panel_add(&panel, (double[3]){1, 1, 1}, &(struct panel_view){0, 0, sine * sine}, &light);
    panel_emission(&panel, &light, HUGE_VAL, &s);
    return xyz_absolute(&s, OBSERVER_1931_2).Y;
}

static void light_falls_off_with_the_angle_like_an_ips_panel(void **state)
{
    (void)state;
    double straight = white_at(0);
    assert_near(white_at(15) / straight, 0.90, ANGLE);
    assert_near(white_at(25) / straight, 0.75, ANGLE);
    for (int deg = 1; deg <= 89; deg++)
        assert_true(white_at(deg) < white_at(deg - 1) && white_at(deg) > 0);
}

static void the_panel_is_not_uniform_but_nearly(void **state)
{
    (void)state;
    double least = 1e9, most = 0;
    for (double y = -1; y <= 1; y += 0.25)
        for (double x = -1; x <= 1; x += 0.25) {
            struct panel_light light = {0};
            struct spectrum s;
            panel_add(&panel, (double[3]){1, 1, 1}, &(struct panel_view){x, y, 0}, &light);
            panel_emission(&panel, &light, HUGE_VAL, &s);
            double luminance = xyz_absolute(&s, OBSERVER_1931_2).Y;
            least = fmin(least, luminance);
            most = fmax(most, luminance);
        }
    assert_true(least / most > 0.93 && least / most < 0.99);
}

static void pixels_average_as_light_not_as_codes(void **state)
{
    (void)state;
    struct panel_light light = {0};
    struct spectrum s;
    struct panel_view centre = {0};
    for (int i = 0; i < 10; i++)
        panel_add(&panel, (double[3]){i % 2, i % 2, i % 2}, &centre, &light);
    panel_emission(&panel, &light, HUGE_VAL, &s);
    assert_near(xyz_absolute(&s, OBSERVER_1931_2).Y, (900 + 0.3) / 2, 900 * SETTLED);
}

static void codes_are_rounded_to_the_panels_depth(void **state)
{
    (void)state;
    double least = patch(100 / 255.0, 0, 0).Y;
    assert_near(patch(100.4 / 255, 0, 0).Y, least, ONE_GREY_LEVEL);
    assert_true(patch(100.6 / 255, 0, 0).Y > least);
    assert_near(patch(7, 7, 7).Y, patch(1, 1, 1).Y, ONE_GREY_LEVEL);
    assert_near(patch(-7, -7, -7).Y, patch(0, 0, 0).Y, ONE_GREY_LEVEL);
}

static void a_cold_panel_is_darker_and_warms_up(void **state)
{
    (void)state;
    struct panel_light light = {0};
    struct spectrum s;
    double before = 0;
    panel_add(&panel, (double[3]){1, 1, 1}, &(struct panel_view){0}, &light);
    for (double on_s = 0; on_s <= 7200; on_s += 600) {
        panel_emission(&panel, &light, on_s, &s);
        double luminance = xyz_absolute(&s, OBSERVER_1931_2).Y;
        assert_true(luminance > before);
        if (on_s == 0)
            assert_true(luminance < 0.96 * 900);
        before = luminance;
    }
    assert_true(before > 0.999 * 900);
}

static void the_front_surface_reflects_a_five_hundredth_of_the_light(void **state)
{
    (void)state;
    struct spectrum light, seen;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        light.v[i] = 1;
    panel_reflection(&panel, &light, &seen);
    double expected = 0.002 * xyz_absolute(&light, OBSERVER_1931_2).Y / M_PI;
    assert_near(xyz_absolute(&seen, OBSERVER_1931_2).Y, expected, FLARE * expected);
}

static void a_seed_is_a_panel_of_its_own(void **state)
{
    (void)state;
    struct scenario s;
    struct panel same, other;
    scenario_preset(&s);
    panel_init(&same, &s.panel, 1);
    panel_init(&other, &s.panel, 2);
    assert_memory_equal(same.curve, panel.curve, sizeof same.curve);
    assert_memory_not_equal(other.curve, panel.curve, sizeof other.curve);
}

static void no_pixel_gives_no_light(void **state)
{
    (void)state;
    struct spectrum s;
    panel_emission(&panel, &(struct panel_light){0}, 0, &s);
    assert_true(spectrum_sum(&s) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_is_as_asked_and_d65),
        cmocka_unit_test(black_leaks_light_of_another_colour_than_white),
        cmocka_unit_test(primaries_are_near_p3),
        cmocka_unit_test(channels_do_not_add_up),
        cmocka_unit_test(without_interaction_channels_add_up_at_every_level),
        cmocka_unit_test(a_primary_changes_its_colour_with_its_drive),
        cmocka_unit_test(adding_up_channels_misses_by_a_visible_but_modest_amount),
        cmocka_unit_test(every_curve_rises_strictly_at_both_depths),
        cmocka_unit_test(the_curves_differ_from_each_other_and_from_a_power),
        cmocka_unit_test(light_falls_off_with_the_angle_like_an_ips_panel),
        cmocka_unit_test(the_panel_is_not_uniform_but_nearly),
        cmocka_unit_test(pixels_average_as_light_not_as_codes),
        cmocka_unit_test(codes_are_rounded_to_the_panels_depth),
        cmocka_unit_test(a_cold_panel_is_darker_and_warms_up),
        cmocka_unit_test(the_front_surface_reflects_a_five_hundredth_of_the_light),
        cmocka_unit_test(a_seed_is_a_panel_of_its_own),
        cmocka_unit_test(no_pixel_gives_no_light),
    };
    return cmocka_run_group_tests(tests, a_panel, NULL);
}
