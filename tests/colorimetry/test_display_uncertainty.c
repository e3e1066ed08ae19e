// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "colorimetry/display_uncertainty.h"
#include "colorimetry/metric.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

// Products of 3x3 matrices of numbers near 1 in double.
#define ARITHMETIC 1e-9
// First-order propagation of 0.01 CIELAB units against the transformation itself.
#define LINEAR 2e-3

enum { MANY = 6 };

static const struct counts colours[MANY] = {{1, 1, 1},       {0.5, 0.5, 0.5}, {0.5, 0.5, 0.52},
                                            {1, 0.25, 0.05}, {0.5, 0.5, 0.5}, {0.02, 0.02, 0.02}};

static struct display_model panel(void)
{
    struct display_model m = {
        .matrix = {{190, 120, 75, 0.15}, {98, 245, 28, 0.16}, {4, 22, 400, 0.3}}};
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < DISPLAY_NODES; k++)
            m.curve[c][k] = pow(k / 1020.0, 2.2);
        display_curve_repair(m.curve[c]);
    }
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static void a_deviation_on_three_axes_is_root_three_of_it(void **state)
{
    (void)state;
    struct display_model m = panel();
    struct display_uncertainty u = {.local_de00 = 0.1};
    for (int i = 0; i < MANY; i++)
        assert_near(display_uncertainty_de00(&u, &m, colours[i]), 0.1 * sqrt(3), ARITHMETIC);
    u.smooth_de00 = 0.2;
    u.length_lab = 10;
    assert_near(display_uncertainty_de00(&u, &m, colours[3]), sqrt(3 * 0.05), ARITHMETIC);
    u.neutral_de00 = 0.3; // counts for neutral colours alone
    assert_true(display_uncertainty_de00(&u, &m, colours[1]) > 0.9 * sqrt(3 * 0.14));
    assert_near(display_uncertainty_de00(&u, &m, colours[3]), sqrt(3 * 0.05), 5e-3);
}

static void neighbours_share_what_is_smooth_and_nothing_local(void **state)
{
    (void)state;
    struct display_model m = panel();
    struct display_uncertainty u = {.smooth_de00 = 0.2, .length_lab = 10, .local_de00 = 0.1};
    double c[9 * MANY * MANY];
    struct lab at[MANY];
    for (int i = 0; i < MANY; i++)
        assert_true(lab_of(display_forward(&m, colours[i]), m.white, &at[i], NULL));
    display_uncertainty_lab(&u, &m, colours, MANY, c);
    for (int i = 0; i < 3 * MANY; i++)
        for (int j = 0; j < 3 * MANY; j++)
            assert_near(c[i * 3 * MANY + j], c[j * 3 * MANY + i], ARITHMETIC);
    // L* of the two greys: the metric hardly differs between them.
    double variance = c[3 * (3 * MANY) + 3], shared = c[3 * (3 * MANY) + 6];
    double wanted = 0.04 * exp(-delta_e_ab(at[1], at[2]) / 10) / 0.05;
    assert_near(shared / variance, wanted, 0.02);
    // Equal counts, equal errors.
    for (int n = 0; n < 3; n++)
        assert_near(c[(3 + n) * 3 * MANY + 12 + n], c[(3 + n) * 3 * MANY + 3 + n], ARITHMETIC);
}

static void modes_are_linear_between_their_places(void **state)
{
    (void)state;
    struct display_model m = panel();
    struct display_uncertainty u = {.modes = 1};
    for (int p = 0; p < UNCERTAINTY_PLACES; p++)
        u.mode[0][p][0] = 1 + p / 16 / 3.0 - 2 * (p / 4 % 4) / 3.0 + 0.5 * (p % 4) / 3.0;
    for (int i = 0; i < MANY; i++) {
        double c[9];
        double wanted = 1 + colours[i].r - 2 * colours[i].g + 0.5 * colours[i].b;
        display_uncertainty_lab(&u, &m, &colours[i], 1, c);
        assert_near(c[0], wanted * wanted, ARITHMETIC);
        assert_near(c[4], 0, 0);
    }
}

static void cielab_and_xyz_tell_the_same(void **state)
{
    (void)state;
    struct display_model m = panel();
    struct display_uncertainty u = {.modes = 1};
    for (int p = 0; p < UNCERTAINTY_PLACES; p++) {
        u.mode[0][p][0] = 0.01;
        u.mode[0][p][1] = -0.02;
        u.mode[0][p][2] = 0.015;
    }
    for (int i = 0; i < MANY; i++) {
        double c[9];
        struct lab lab;
        struct xyz is = display_forward(&m, colours[i]);
        display_uncertainty_xyz(&u, &m, &colours[i], 1, c);
        assert_true(lab_of(is, m.white, &lab, NULL));
        struct xyz moved =
            xyz_of_lab((struct lab){lab.L + 0.01, lab.a - 0.02, lab.b + 0.015}, m.white);
        assert_near(sqrt(c[0]) / fabs(moved.X - is.X), 1, LINEAR);
        assert_near(sqrt(c[4]) / fabs(moved.Y - is.Y), 1, LINEAR);
        assert_near(sqrt(c[8]) / fabs(moved.Z - is.Z), 1, LINEAR);
        assert_near(c[1] / sqrt(c[0] * c[4]), copysign(1, (moved.X - is.X) * (moved.Y - is.Y)),
                    LINEAR);
    }
}

static void nothing_known_to_be_uncertain_is_none(void **state)
{
    (void)state;
    struct display_model m = panel();
    struct display_uncertainty u = {0};
    for (int i = 0; i < MANY; i++)
        assert_near(display_uncertainty_de00(&u, &m, colours[i]), 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_deviation_on_three_axes_is_root_three_of_it),
        cmocka_unit_test(neighbours_share_what_is_smooth_and_nothing_local),
        cmocka_unit_test(modes_are_linear_between_their_places),
        cmocka_unit_test(cielab_and_xyz_tell_the_same),
        cmocka_unit_test(nothing_known_to_be_uncertain_is_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
