// SPDX-License-Identifier: Apache-2.0
// What a display model adds to plain Day: channel interaction, a residual.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "colorimetry/display.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

// The contract of display.h, in 8-bit codes.
#define ROUND_TRIP 1e-5
// Sums of products of numbers below 1000 in double.
#define ARITHMETIC 1e-9
// Central differences over 1e-6 of linear light.
#define DIFFERENCES 1e-7
// Half an 8-bit code.
#define HALF_A_CODE (0.5 / 255)

static uint64_t seed;

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

static struct display_model day(void)
{
    struct display_model m = {
        .name = "panel", .matrix = {{190, 120, 75, 0.15}, {98, 245, 28, 0.16}, {4, 22, 400, 0.3}}};
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < DISPLAY_NODES; k++)
            m.curve[c][k] = pow(k / 1020.0, 2.1 + 0.1 * c);
        display_curve_repair(m.curve[c]);
    }
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

// Red, green and blue alone sum to 12 % more than white; primaries bend.
static struct display_model interacting(void)
{
    static const double terms[3][DISPLAY_TERMS] = {
        {-14, -6, -5, 4, -3, 2}, {-16, -12, -4, 3, 8, -1}, {-1, -14, -18, 0, 1, 9}};
    struct display_model m = day();
    m.kind = DISPLAY_INTERACTION;
    memcpy(m.interaction, terms, sizeof terms);
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

// A residual rougher than real panels have it: several units, changing over 30.
static struct display_model corrected(void)
{
    struct display_model m = day();
    m.kind = DISPLAY_RESIDUAL;
    m.residual.least = (struct vec3){0, -90, -115};
    m.residual.most = (struct vec3){100, 95, 95};
    seed = 8;
    for (int k = 0; k < LATTICE_NODES; k++)
        for (int n = 0; n < 3; n++)
            m.residual.node[k][n] = 20 * (2 * uniform() - 1);
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static double trip(const struct display_model *m, struct counts c)
{
    struct display_inverse back = display_invert(m, display_forward(m, c));
    assert_true(back.in_gamut);
    return 255 * fmax(fabs(back.counts.r - c.r),
                      fmax(fabs(back.counts.g - c.g), fabs(back.counts.b - c.b)));
}

static void check_round_trips(const struct display_model *m)
{
    double worst = 0;
    for (int k = 0; k < 256; k++) {
        double v = k / 255.0;
        worst = fmax(worst, trip(m, (struct counts){v, v, v}));
        worst = fmax(worst, trip(m, (struct counts){v, 0, 1}));
        worst = fmax(worst, trip(m, (struct counts){1, v, 0}));
        worst = fmax(worst, trip(m, (struct counts){0, 0, v}));
    }
    seed = 2;
    for (int n = 0; n < 20000; n++)
        worst = fmax(worst, trip(m, (struct counts){uniform(), uniform(), uniform()}));
    print_message("%s: worst round trip %.1e of a code\n", display_kind_names[m->kind], worst);
    assert_true(worst < ROUND_TRIP);
}

static void the_inverse_undoes_an_interaction(void **state)
{
    (void)state;
    struct display_model m = interacting();
    assert_true(display_fold(&m) > 0.1); // the case is not a trivial one
    check_round_trips(&m);
}

static void the_inverse_undoes_a_residual(void **state)
{
    (void)state;
    struct display_model m = corrected();
    assert_true(display_fold(&m) > 0.1);
    check_round_trips(&m);
}

static void channels_share_their_harmonic_mean(void **state)
{
    (void)state;
    double terms[DISPLAY_TERMS], by[DISPLAY_TERMS][3];
    display_terms((struct counts){1, 0.5, 0}, terms, by);
    // 2 1 0.5 / 1.501 and 0.5 (1 - 0.5), by hand
    assert_near(terms[0], 0.666222518, ARITHMETIC);
    assert_near(terms[1], 0, 0);
    assert_near(terms[2], 0, 0);
    assert_near(terms[3], 0, 0);
    assert_near(terms[4], 0.25, 0);
    assert_near(by[3][0], -1, 0);
    seed = 3;
    for (int n = 0; n < 1000; n++) {
        const double h = 1e-6;
        double low[DISPLAY_TERMS], high[DISPLAY_TERMS];
        struct counts l = {0.01 + 0.98 * uniform(), 0.01 + 0.98 * uniform(), 0.1};
        display_terms(l, terms, by);
        display_terms((struct counts){l.r, l.g - h, l.b}, low, NULL);
        display_terms((struct counts){l.r, l.g + h, l.b}, high, NULL);
        for (int t = 0; t < DISPLAY_TERMS; t++)
            assert_near(by[t][1], (high[t] - low[t]) / (2 * h), DIFFERENCES);
    }
}

static void one_channel_alone_is_not_interacted_with(void **state)
{
    (void)state;
    struct display_model plain = day(), m = day();
    m.kind = DISPLAY_INTERACTION;
    for (int i = 0; i < 3; i++)
        for (int t = 0; t < 3; t++)
            m.interaction[i][t] = -3 + i + t; // shared terms only
    assert_true(display_model_prepare(&m, NULL));
    for (int k = 0; k <= 10; k++) {
        struct xyz a = display_forward(&plain, (struct counts){0, k / 10.0, 0});
        struct xyz b = display_forward(&m, (struct counts){0, k / 10.0, 0});
        assert_near(a.X, b.X, ARITHMETIC);
        assert_near(a.Y, b.Y, ARITHMETIC);
        assert_near(a.Z, b.Z, ARITHMETIC);
    }
    struct counts yellow = {1, 1, 0};
    double shared = 2 / 2.001;
    assert_near(display_forward(&m, yellow).X, display_forward(&plain, yellow).X - 3 * shared,
                ARITHMETIC);
}

static void a_residual_of_one_unit_everywhere_moves_every_colour_by_that(void **state)
{
    (void)state;
    struct display_model plain = day(), m = day();
    m.kind = DISPLAY_RESIDUAL;
    m.residual.most = (struct vec3){100, 50, 50};
    m.residual.least = (struct vec3){0, -50, -50};
    for (int k = 0; k < LATTICE_NODES; k++)
        m.residual.node[k][1] = 1;
    assert_true(display_model_prepare(&m, NULL));
    seed = 4;
    for (int n = 0; n < 1000; n++) {
        struct counts c = {uniform(), uniform(), uniform()};
        struct lab a, b;
        assert_true(lab_of(display_forward(&plain, c), m.white, &a, NULL));
        assert_true(lab_of(display_forward(&m, c), m.white, &b, NULL));
        assert_near(delta_e_ab(a, b), 1, ARITHMETIC);
        assert_near(b.a - a.a, 1, ARITHMETIC);
    }
}

static void twice_the_light_is_twice_every_colour_and_inverts_alike(void **state)
{
    (void)state;
    struct display_model models[] = {day(), interacting(), corrected()};
    for (int i = 0; i < 3; i++) {
        struct display_model twice = models[i];
        struct counts c = {0.3, 0.7, 0.1};
        struct xyz once = display_forward(&models[i], c);
        display_model_scale(&twice, 2);
        struct xyz got = display_forward(&twice, c);
        assert_near(got.X, 2 * once.X, ARITHMETIC);
        assert_near(got.Z, 2 * once.Z, ARITHMETIC);
        assert_near(display_invert(&twice, got).counts.g, c.g, ARITHMETIC);
        assert_true(display_model_prepare(&twice, NULL));
        assert_near(display_invert(&twice, got).counts.b, c.b, ARITHMETIC);
    }
}

// From each corner outwards: what leaves the gamut is flagged at once, what is
// inside is not, and the clipped counts are the corner's.
static void the_gamut_ends_where_counts_end(void **state)
{
    (void)state;
    struct display_model models[] = {interacting(), corrected()};
    for (int i = 0; i < 2; i++) {
        struct display_model *m = &models[i];
        struct xyz white = display_forward(m, (struct counts){1, 1, 1});
        struct xyz black = display_black(m);
        assert_near(black.Y, display_forward(m, (struct counts){0, 0, 0}).Y, 0);
        struct display_inverse at = display_invert(m, white);
        assert_true(at.in_gamut && at.counts.r > 1 - 1e-8);
        at = display_invert(m, (struct xyz){white.X * 1.01, white.Y * 1.01, white.Z * 1.01});
        assert_false(at.in_gamut);
        assert_near(at.counts.g, 1, HALF_A_CODE);
        at = display_invert(m, (struct xyz){black.X / 2, black.Y / 2, black.Z / 2});
        assert_false(at.in_gamut);
        assert_near(at.counts.g, 0, HALF_A_CODE);
    }
}

static void beyond_the_gamut_the_inverse_is_continuous(void **state)
{
    (void)state;
    struct display_model models[] = {interacting(), corrected()};
    for (int i = 0; i < 2; i++) {
        struct counts last = {NAN, NAN, NAN};
        for (int k = 0; k <= 4000; k++) {
            double t = k / 1000.0 - 1; // from below black to thrice white, greenish
            struct xyz target = {200 * t, 330 * t, 250 * t};
            struct display_inverse at = display_invert(&models[i], target);
            if (k > 0) {
                assert_near(at.linear.r, last.r, 0.01);
                assert_near(at.linear.g, last.g, 0.01);
                assert_near(at.linear.b, last.b, 0.01);
            }
            last = at.linear;
        }
    }
}

static void absurd_targets_stay_finite_and_flagged(void **state)
{
    (void)state;
    struct display_model models[] = {interacting(), corrected()};
    const struct xyz targets[] = {{-5, -5, -5},     {1e12, 0, 0},    {NAN, 1, 1},
                                  {1, INFINITY, 1}, {NAN, NAN, NAN}, {-1e300, 1e300, 0}};
    for (int i = 0; i < 2; i++)
        for (size_t k = 0; k < sizeof targets / sizeof *targets; k++) {
            struct display_inverse at = display_invert(&models[i], targets[k]);
            assert_false(at.in_gamut);
            assert_true(at.counts.r >= 0 && at.counts.r <= 1);
            assert_true(at.counts.g >= 0 && at.counts.g <= 1);
            assert_true(at.counts.b >= 0 && at.counts.b <= 1);
        }
}

static void refused(struct display_model *m, const char *says)
{
    struct error err = {0};
    assert_false(display_model_prepare(m, &err));
    assert_int_equal(err.code, ERROR_DATA);
    if (!strstr(err.text, says))
        fail_msg("\"%s\" does not say \"%s\"", err.text, says);
}

static void what_folds_is_refused(void **state)
{
    (void)state;
    struct display_model m = interacting();
    for (int i = 0; i < 3; i++)
        m.interaction[i][1] *= 15; // green and blue together darker than green alone
    refused(&m, "two inputs may give one colour");
    m = corrected();
    for (int k = 0; k < LATTICE_NODES; k++)
        m.residual.node[k][0] *= 15;
    refused(&m, "two inputs may give one colour");
}

static void what_is_not_a_number_is_refused(void **state)
{
    (void)state;
    struct display_model m = interacting();
    m.interaction[2][5] = NAN;
    refused(&m, "interaction");
    m = corrected();
    m.residual.node[215][2] = INFINITY;
    refused(&m, "coefficient 215");
    m = corrected();
    m.residual.most.y = m.residual.least.y;
    refused(&m, "no volume");
    m = day();
    m.kind = (enum display_kind)3;
    refused(&m, "number 3");
}

static void what_the_kind_does_not_use_is_not_used(void **state)
{
    (void)state;
    struct display_model plain = day(), m = day();
    m.interaction[0][0] = NAN;
    m.residual.node[7][1] = 1e9;
    assert_true(display_model_prepare(&m, NULL));
    struct counts c = {0.2, 0.4, 0.9};
    assert_near(display_forward(&m, c).X, display_forward(&plain, c).X, 0);
    assert_near(display_fold(&m), 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_inverse_undoes_an_interaction),
        cmocka_unit_test(the_inverse_undoes_a_residual),
        cmocka_unit_test(channels_share_their_harmonic_mean),
        cmocka_unit_test(one_channel_alone_is_not_interacted_with),
        cmocka_unit_test(a_residual_of_one_unit_everywhere_moves_every_colour_by_that),
        cmocka_unit_test(twice_the_light_is_twice_every_colour_and_inverts_alike),
        cmocka_unit_test(the_gamut_ends_where_counts_end),
        cmocka_unit_test(beyond_the_gamut_the_inverse_is_continuous),
        cmocka_unit_test(absurd_targets_stay_finite_and_flagged),
        cmocka_unit_test(what_folds_is_refused),
        cmocka_unit_test(what_is_not_a_number_is_refused),
        cmocka_unit_test(what_the_kind_does_not_use_is_not_used),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
