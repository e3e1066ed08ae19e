// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "colorimetry/display.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

// The contract of display.h, in 8-bit codes, before and after rounding.
#define BEFORE_ROUNDING 0.01
#define AFTER_ROUNDING 0.5
// Curves hold nodes every quarter code; between them they are straight, which
// bends the sRGB curve by less than this part of full light.
#define STRAIGHT_SEGMENTS 1e-6
// Published to four decimals.
#define PUBLISHED 5e-5
// Sums of four products of numbers below 1000 in double.
#define ARITHMETIC 1e-9

static uint64_t seed;

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

static double srgb_light(double v)
{
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

// IEC 61966-2-1 with a 0.3 cd/m2 black.
static struct display_model srgb(void)
{
    struct display_model m = {.name = "sRGB",
                              .matrix = {{41.24, 35.76, 18.05, 0.3},
                                         {21.26, 71.52, 7.22, 0.3},
                                         {1.93, 11.92, 95.05, 0.4}}};
    for (int k = 0; k < DISPLAY_NODES; k++)
        m.curve[0][k] = m.curve[1][k] = m.curve[2][k] = srgb_light(k / 1020.0);
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

// A panel with a noisy toe and a clipped top, as measured curves are.
static struct display_model irregular(void)
{
    struct display_model m = srgb();
    seed = 5;
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < DISPLAY_NODES; k++)
            m.curve[c][k] = 1.02 * pow(k / 1020.0, 2 + 0.2 * c) + 0.002 * (uniform() - 0.5);
        assert_in_range(display_curve_repair(m.curve[c]), 1, DISPLAY_NODES);
    }
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static double worst_trip(const struct display_model *m, struct counts c, double *rounded)
{
    struct display_inverse back = display_invert(m, display_forward(m, c));
    const double in[3] = {c.r, c.g, c.b};
    const double out[3] = {back.counts.r, back.counts.g, back.counts.b};
    double worst = 0;
    for (int i = 0; i < 3; i++) {
        worst = fmax(worst, fabs(out[i] - in[i]) * 255);
        *rounded = fmax(*rounded, fabs(floor(out[i] * 255 + 0.5) - in[i] * 255));
    }
    assert_true(back.in_gamut);
    return worst;
}

static void check_round_trips(const struct display_model *m)
{
    double worst = 0;
    double rounded = 0;
    double ignored = 0;
    for (int g = 0; g < 256; g++)
        worst =
            fmax(worst, worst_trip(m, (struct counts){g / 255.0, g / 255.0, g / 255.0}, &rounded));
    seed = 1;
    for (int n = 0; n < 1000000; n++) {
        struct counts c = {floor(uniform() * 256) / 255, floor(uniform() * 256) / 255,
                           floor(uniform() * 256) / 255};
        worst = fmax(worst, worst_trip(m, c, &rounded));
    }
    for (int n = 0; n < 100000; n++)
        worst =
            fmax(worst, worst_trip(m, (struct counts){uniform(), uniform(), uniform()}, &ignored));
    assert_true(worst < BEFORE_ROUNDING);
    assert_true(rounded < AFTER_ROUNDING);
}

static void srgb_white_and_mid_grey_are_the_published_ones(void **state)
{
    (void)state;
    struct display_model m = srgb();
    struct xyz white = display_forward(&m, (struct counts){1, 1, 1});
    assert_near(white.X - 0.3, 95.05, ARITHMETIC);
    assert_near(white.Y - 0.3, 100.0, ARITHMETIC);
    assert_near(white.Z - 0.4, 108.90, ARITHMETIC);
    // 128/255 is linear 0.2159 (IEC 61966-2-1).
    struct xyz grey = display_forward(&m, (struct counts){128 / 255.0, 128 / 255.0, 128 / 255.0});
    assert_near((grey.Y - 0.3) / 100, 0.2159, PUBLISHED);
}

static void the_inverse_undoes_the_forward_model(void **state)
{
    (void)state;
    struct display_model m = srgb();
    check_round_trips(&m);
}

static void the_inverse_undoes_a_repaired_noisy_curve_too(void **state)
{
    (void)state;
    struct display_model m = irregular();
    check_round_trips(&m);
}

static void curves_are_straight_between_nodes(void **state)
{
    (void)state;
    struct display_model m = srgb();
    for (int n = 0; n < 1000; n++) {
        double v = n / 1000.0;
        double r = display_forward(&m, (struct counts){v, 0, 0}).Y - 0.3;
        assert_near(r / 21.26, srgb_light(v), STRAIGHT_SEGMENTS);
    }
}

static void light_is_additive_over_channels_and_black(void **state)
{
    (void)state;
    struct display_model m = irregular();
    struct xyz black = display_black(&m);
    struct xyz r = display_forward(&m, (struct counts){0.3, 0, 0});
    struct xyz gb = display_forward(&m, (struct counts){0, 0.7, 0.9});
    struct xyz all = display_forward(&m, (struct counts){0.3, 0.7, 0.9});
    assert_near(all.X, r.X + gb.X - black.X, ARITHMETIC);
    assert_near(all.Y, r.Y + gb.Y - black.Y, ARITHMETIC);
    assert_near(all.Z, r.Z + gb.Z - black.Z, ARITHMETIC);
}

static void out_of_gamut_is_flagged_before_it_is_clipped(void **state)
{
    (void)state;
    struct display_model m = srgb();
    struct xyz beyond = display_forward(&m, (struct counts){1, 1, 1});
    struct display_inverse at = display_invert(&m, beyond);
    assert_true(at.in_gamut);
    struct xyz red = {41.24 * DISPLAY_GAMUT_TOLERANCE, 21.26 * DISPLAY_GAMUT_TOLERANCE,
                      1.93 * DISPLAY_GAMUT_TOLERANCE};
    beyond = (struct xyz){beyond.X + 0.9 * red.X, beyond.Y + 0.9 * red.Y, beyond.Z + 0.9 * red.Z};
    assert_true(display_invert(&m, beyond).in_gamut);
    beyond = (struct xyz){beyond.X + 0.2 * red.X, beyond.Y + 0.2 * red.Y, beyond.Z + 0.2 * red.Z};
    at = display_invert(&m, beyond);
    assert_false(at.in_gamut);
    assert_near(at.linear.r, 1 + 1.1 * DISPLAY_GAMUT_TOLERANCE, ARITHMETIC);
    assert_near(at.counts.r, 1, 0);
    at = display_invert(&m, (struct xyz){0.1, 0.1, 0.1});
    assert_false(at.in_gamut);
    assert_near(at.counts.g, 0, 0);
}

static void negative_and_absurd_targets_stay_finite_and_flagged(void **state)
{
    (void)state;
    struct display_model m = srgb();
    const struct xyz targets[] = {
        {-5, -5, -5}, {1e12, 0, 0}, {0, 0, 0}, {NAN, 1, 1}, {1, INFINITY, 1}};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
        struct display_inverse at = display_invert(&m, targets[i]);
        assert_false(at.in_gamut);
        assert_true(at.counts.r >= 0 && at.counts.r <= 1);
        assert_true(at.counts.g >= 0 && at.counts.g <= 1);
        assert_true(at.counts.b >= 0 && at.counts.b <= 1);
    }
}

static void primaries_too_much_alike_are_refused(void **state)
{
    (void)state;
    struct display_model m = srgb();
    struct error err = {0};
    for (int i = 0; i < 3; i++)
        m.matrix[i][2] = 0.9 * m.matrix[i][1] + 0.1 * m.matrix[i][0] + (i == 2);
    assert_false(display_model_prepare(&m, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "condition"));
    for (int i = 0; i < 3; i++)
        m.matrix[i][2] = m.matrix[i][1];
    assert_false(display_model_prepare(&m, &err));
}

static void a_primary_that_takes_light_away_is_refused(void **state)
{
    (void)state;
    struct display_model m = srgb();
    struct error err = {0};
    m.matrix[2][0] = -0.049 * m.matrix[1][0];
    assert_true(display_model_prepare(&m, &err));
    m.matrix[2][0] = -0.051 * m.matrix[1][0];
    assert_false(display_model_prepare(&m, &err));
    assert_non_null(strstr(err.text, "column 1: red"));
    m = srgb();
    m.matrix[1][2] = 0;
    assert_false(display_model_prepare(&m, &err));
    assert_non_null(strstr(err.text, "column 3: blue"));
}

static void the_condition_is_that_of_the_columns_as_they_are(void **state)
{
    (void)state;
    struct display_model m = srgb();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m.matrix[i][j] = i == j ? 1 + 3 * (i == 2) : i == 1 ? 1e-13 : 0; // every Y above 0
    assert_true(display_model_prepare(&m, NULL));
    assert_near(m.condition, 4, ARITHMETIC);
}

static void a_curve_that_does_not_rise_is_refused_by_name(void **state)
{
    (void)state;
    struct error err = {0};
    struct display_model m = srgb();
    m.curve[1][500] = m.curve[1][499];
    assert_false(display_model_prepare(&m, &err));
    assert_non_null(strstr(err.text, "green curve does not rise at node 500"));
    m = srgb();
    m.curve[2][7] = NAN;
    assert_false(display_model_prepare(&m, &err));
    m = srgb();
    m.matrix[1][3] = INFINITY;
    assert_false(display_model_prepare(&m, &err));
}

static void repair_pools_violators_and_leaves_the_rest(void **state)
{
    (void)state;
    struct display_model m = srgb();
    double curve[DISPLAY_NODES];
    memcpy(curve, m.curve[0], sizeof curve);
    assert_int_equal(display_curve_repair(curve), 0);
    for (int k = 200; k < DISPLAY_NODES; k++)
        assert_near(curve[k], m.curve[0][k], 0);
    double a = curve[600];
    curve[600] = curve[601];
    curve[601] = a;
    assert_int_equal(display_curve_repair(curve), 2);
    for (int k = 1; k < DISPLAY_NODES; k++)
        assert_true(curve[k] - curve[k - 1] > 0.99e-6);
    assert_near(curve[0], 0, 0);
    assert_near(curve[DISPLAY_NODES - 1], 1, 0);
}

static void repair_makes_a_model_of_any_curve(void **state)
{
    (void)state;
    struct display_model m = srgb();
    for (int k = 0; k < DISPLAY_NODES; k++) {
        m.curve[0][k] = 1 - k / 1020.0;
        m.curve[1][k] = k % 2 ? NAN : 7;
        m.curve[2][k] = -1;
    }
    for (int c = 0; c < 3; c++)
        display_curve_repair(m.curve[c]);
    assert_true(display_model_prepare(&m, NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(srgb_white_and_mid_grey_are_the_published_ones),
        cmocka_unit_test(the_inverse_undoes_the_forward_model),
        cmocka_unit_test(the_inverse_undoes_a_repaired_noisy_curve_too),
        cmocka_unit_test(curves_are_straight_between_nodes),
        cmocka_unit_test(light_is_additive_over_channels_and_black),
        cmocka_unit_test(out_of_gamut_is_flagged_before_it_is_clipped),
        cmocka_unit_test(negative_and_absurd_targets_stay_finite_and_flagged),
        cmocka_unit_test(primaries_too_much_alike_are_refused),
        cmocka_unit_test(a_primary_that_takes_light_away_is_refused),
        cmocka_unit_test(the_condition_is_that_of_the_columns_as_they_are),
        cmocka_unit_test(a_curve_that_does_not_rise_is_refused_by_name),
        cmocka_unit_test(repair_pools_violators_and_leaves_the_rest),
        cmocka_unit_test(repair_makes_a_model_of_any_curve),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
