// SPDX-License-Identifier: Apache-2.0
// A display's dependence on direction and place: round trips, invariants, and
// what may not be loaded.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#undef fail // ours is a function

#include "colorimetry/display_view.h"

// Sums and products of some ten numbers in double.
static const double ARITHMETIC = 1e-12;
// A dense grid of 33 x 33, linear in between, against the polynomial itself:
// half a step's square times the second derivative over 2.
static const double DENSE = 1e-4;

static struct display_model srgb(void)
{
    struct display_model m = {.name = "sRGB",
                              .matrix = {{412.4, 357.6, 180.5, 0.3},
                                         {212.6, 715.2, 72.2, 0.3},
                                         {19.3, 119.2, 950.5, 0.4}}};
    for (int k = 0; k < DISPLAY_NODES; k++)
        for (int c = 0; c < 3; c++)
            m.curve[c][k] = pow(k / 1020.0, 2.2);
    for (int k = 1; k < DISPLAY_NODES; k++)
        for (int c = 0; c < 3; c++)
            m.curve[c][k] = fmax(m.curve[c][k], m.curve[c][k - 1] + 1e-12);
    for (int c = 0; c < 3; c++)
        display_curve_repair(m.curve[c]);
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static double place_formula(int c, double x, double y)
{
    return 1 - 0.02 * (c + 1) * (pow(x - 0.5, 2) + pow(y - 0.5, 4)) + 0.01 * (x - 0.5) * (y - 0.5);
}

static struct display_view some_view(void)
{
    struct display_view v;
    struct error err;
    display_view_none(&v);
    v.sine_most = 0.7;
    for (int c = 0; c < VIEW_CHANNELS; c++) {
        const double a[VIEW_TERMS] = {0.04, -0.02, -1.5 - 0.1 * c, 0.2, -1.4, -0.3, 0.1};
        memcpy(v.angle[c], a, sizeof a);
        for (int i = 0; i < VIEW_GRID; i++)
            for (int j = 0; j < VIEW_GRID; j++)
                v.place[c][i][j] = place_formula(c, VIEW_PLACES[j], VIEW_PLACES[i]);
    }
    assert_true(display_view_prepare(&v, &err));
    return v;
}

static void along_the_normal_at_the_centre_nothing_changes(void **state)
{
    (void)state;
    struct display_view v = some_view();
    struct view_gains g = display_view_gains(&v, 0, 0, 0.5, 0.5);
    for (int c = 0; c < VIEW_CHANNELS; c++)
        assert_float_equal(g.c[c], 1, ARITHMETIC);
}

static void what_is_asked_leaves_as_it_was_wanted(void **state)
{
    (void)state;
    struct display_view v = some_view();
    struct display_model m = srgb();
    for (int i = 0; i < 2000; i++) {
        double u = 0.9 * sin(i), w = 0.4 * cos(3 * i), x = fmod(i * 0.618, 1),
               y = fmod(i * 0.414, 1);
        struct view_gains g = display_view_gains(&v, u, w, x, y);
        struct xyz target = {300 + 250 * sin(7 * i), 300 + 290 * sin(5 * i), 300 + 299 * cos(i)};
        struct xyz back = display_view_leaves(&m, g, display_view_ask(&m, g, target));
        assert_float_equal(back.X, target.X, 1e3 * ARITHMETIC);
        assert_float_equal(back.Y, target.Y, 1e3 * ARITHMETIC);
        assert_float_equal(back.Z, target.Z, 1e3 * ARITHMETIC);
    }
}

// Half the red light at a gain of one half, and nothing else: by hand.
static void one_channel_at_half_its_gain_is_asked_for_twice(void **state)
{
    (void)state;
    struct display_model m = srgb();
    struct view_gains g = {{0.5, 1, 1, 1}};
    struct xyz asked = display_view_ask(&m, g, (struct xyz){206.2 + 0.3, 106.3 + 0.3, 9.65 + 0.4});
    assert_float_equal(asked.X, 412.4 + 0.3, 1e-9);
    assert_float_equal(asked.Y, 212.6 + 0.3, 1e-9);
    assert_float_equal(asked.Z, 19.3 + 0.4, 1e-9);
}

static void black_that_glows_aside_is_taken_off(void **state)
{
    (void)state;
    struct display_model m = srgb();
    struct view_gains g = {{1, 1, 1, 3}};
    struct xyz asked = display_view_ask(&m, g, (struct xyz){0.9, 0.9, 1.2});
    assert_float_equal(asked.Y, 0.3, 1e-12); // the model's own black: no light at all
}

static void places_lie_on_the_polynomial_that_they_were_taken_from(void **state)
{
    (void)state;
    struct display_view v = some_view();
    for (int i = 0; i <= 100; i++)
        for (int j = 0; j <= 100; j++)
            for (int c = 0; c < VIEW_CHANNELS; c++)
                assert_float_equal(display_view_gains(&v, 0, 0, j / 100.0, i / 100.0).c[c],
                                   place_formula(c, j / 100.0, i / 100.0), DENSE);
}

static void beyond_what_was_measured_the_gain_is_held(void **state)
{
    (void)state;
    struct display_view v = some_view();
    struct view_gains edge = display_view_gains(&v, 0.7 * 0.6, 0.7 * 0.8, 0.5, 0.5);
    struct view_gains beyond = display_view_gains(&v, 0.6, 0.8, 0.5, 0.5);
    struct view_gains corner = display_view_gains(&v, 0, 0, 1, 0);
    struct view_gains outside = display_view_gains(&v, 0, 0, 7, -3);
    for (int c = 0; c < VIEW_CHANNELS; c++) {
        assert_float_equal(beyond.c[c], edge.c[c], 1e-12);
        assert_float_equal(outside.c[c], corner.c[c], 1e-12);
    }
}

static void gains_are_finite_in_every_direction_and_from_nowhere(void **state)
{
    (void)state;
    struct display_view v = some_view();
    for (int i = 0; i < 360; i++) {
        struct view_gains g = display_view_gains(&v, cos(i), sin(i), 0.5, 0.5);
        for (int c = 0; c < VIEW_CHANNELS; c++)
            assert_true(g.c[c] > 0.05 && g.c[c] < 20);
    }
    struct display_view none;
    display_view_none(&none);
    struct view_gains g = display_view_gains(&none, 1, 0, 0.2, 0.9);
    for (int c = 0; c < VIEW_CHANNELS; c++)
        assert_float_equal(g.c[c], 1, 0);
}

static void refuse(void (*spoil)(struct display_view *), const char *word)
{
    struct display_view v = some_view();
    struct error err;
    spoil(&v);
    assert_false(display_view_prepare(&v, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, word));
}

static void steep(struct display_view *v)
{
    v->angle[1][2] = -9;
}
static void not_finite(struct display_view *v)
{
    v->angle[2][5] = NAN;
}
static void off_centre(struct display_view *v)
{
    v->place[0][2][2] = 1.01;
}
static void hole(struct display_view *v)
{
    v->place[3][0][4] = 0;
}
static void edgeways(struct display_view *v)
{
    v->sine_most = 1;
}

static void what_cannot_be_is_refused_by_name(void **state)
{
    (void)state;
    refuse(steep, "green");
    refuse(not_finite, "blue");
    refuse(off_centre, "red");
    refuse(hole, "black");
    refuse(edgeways, "angle");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(along_the_normal_at_the_centre_nothing_changes),
        cmocka_unit_test(what_is_asked_leaves_as_it_was_wanted),
        cmocka_unit_test(one_channel_at_half_its_gain_is_asked_for_twice),
        cmocka_unit_test(black_that_glows_aside_is_taken_off),
        cmocka_unit_test(places_lie_on_the_polynomial_that_they_were_taken_from),
        cmocka_unit_test(beyond_what_was_measured_the_gain_is_held),
        cmocka_unit_test(gains_are_finite_in_every_direction_and_from_nowhere),
        cmocka_unit_test(what_cannot_be_is_refused_by_name),
    };
    return cmocka_run_group_tests_name("display view", tests, NULL, NULL);
}
