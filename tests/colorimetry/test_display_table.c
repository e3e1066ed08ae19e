// SPDX-License-Identifier: Apache-2.0
// The GPU's table of a residual, against the inverse itself.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "colorimetry/display_table.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

#define real double
#define curve_handle const double *
#define curve_node(curve, index) ((curve)[index])
#include "colorimetry/display.glsl"

// Half an 8-bit code; below the fourth one DISPLAY_TABLE_LIGHT.
#define HALF_A_CODE (0.5 / 255)
#define FOURTH_CODE (4.0 / 255)
#define MEAN_CODES 0.005
// Quadratic forms of size 1 in double.
#define ARITHMETIC 1e-12

static uint64_t seed;

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

// Residuals like those of a panel whose channels disturb each other.
static struct display_model corrected(void)
{
    struct display_model m = {
        .kind = DISPLAY_RESIDUAL,
        .matrix = {{190, 120, 75, 0.15}, {98, 245, 28, 0.16}, {4, 22, 400, 0.3}},
        .residual = {.least = {-10, -105, -130}, .most = {110, 110, 110}}};
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < DISPLAY_NODES; k++)
            m.curve[c][k] = pow(k / 1020.0, 2.1 + 0.1 * c);
        display_curve_repair(m.curve[c]);
    }
    for (int k = 0; k < LATTICE_NODES; k++) {
        double x = k / 36 / 5.0, y = k / 6 % 6 / 5.0 - 0.5, z = k % 6 / 5.0 - 0.5;
        m.residual.node[k][0] = 4 * x - 3 * x * x + y;
        m.residual.node[k][1] = 8 * y * x - 6 * y * y + z;
        m.residual.node[k][2] = 6 * z - 5 * y * z;
    }
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static void the_corners_are_exact_for_quadratic_forms(void **state)
{
    (void)state;
    enum { SIDE = 7 };
    seed = 5;
    for (int n = 0; n < 10000; n++) {
        double x = 6 * uniform(), y = 6 * uniform(), z = 6 * uniform();
        if (n % 3 == 0)
            z = floor(z) + (y - floor(y)); // on the face between two tetrahedra
        struct display_corners at = display_find(x, y, z, SIDE);
        double sum = 0, got = 0, wanted = 0.2 * x * x + 0.1 * x * y - 0.3 * y * z + z - 2;
        for (int k = 0; k < 4; k++) {
            double i = at.node[k] / SIDE / SIDE, j = at.node[k] / SIDE % SIDE,
                   l = at.node[k] % SIDE;
            assert_true(at.value[k] > -ARITHMETIC && fabs(i - x) <= 1 && fabs(j - y) <= 1 &&
                        fabs(l - z) <= 1);
            sum += at.value[k];
            got += at.value[k] * (0.2 * i * i + 0.1 * i * j - 0.3 * j * l + l - 2) +
                   at.by_red[k] * (0.4 * i + 0.1 * j) + at.by_green[k] * (0.1 * i - 0.3 * l) +
                   at.by_blue[k] * (1 - 0.3 * j);
        }
        assert_near(sum, 1, ARITHMETIC);
        assert_near(got, wanted, 100 * ARITHMETIC);
    }
}

static void places_beyond_the_ends_are_at_the_ends(void **state)
{
    (void)state;
    assert_near(display_axis(0.125, 0, 10, 49), 5, ARITHMETIC);
    assert_near(display_axis(-0.125, -1, 10, 49), 5, ARITHMETIC);
    assert_near(display_axis(-5, -1, 10, 49), 0, 0);
    assert_near(display_axis(1e30, -1, 10, 49), 48, 0);
    assert_near(display_axis(NAN, -1, 10, 49), 0, 0);
    struct display_corners at = display_find(48, 48, 48, 49);
    for (int k = 0; k < 4; k++)
        assert_in_range(at.node[k], 0, 49 * 49 * 49 - 1);
    assert_near(at.value[3], 1, 0);
}

// How far a linear light is from that of a count, in counts; nothing below the
// fourth code.
static double off(const struct display_model *m, int c, double light, double count)
{
    if (count >= FOURTH_CODE)
        return fabs(display_count(m->curve[c], light) - count);
    assert_near(display_clamped(light), display_light(m->curve[c], count), DISPLAY_TABLE_LIGHT);
    return 0;
}

static void random_colours_are_found_to_half_a_code(void **state)
{
    (void)state;
    struct display_model m = corrected();
    struct error err = {0};
    struct display_table *t = display_table_create(&m, &err);
    assert_non_null(t);
    double worst = 0, sum = 0;
    const int colours = 50000;
    seed = 6;
    for (int n = 0; n < colours; n++) {
        struct counts c = {uniform(), uniform(), uniform()};
        if (n % 4 == 0)
            c.g = floor(c.g * 8) / 255; // a channel nearly dark
        struct counts l = display_table_linear(t, display_day_invert(&m, display_forward(&m, c)));
        double d[3] = {off(&m, 0, l.r, c.r), off(&m, 1, l.g, c.g), off(&m, 2, l.b, c.b)};
        for (int k = 0; k < 3; k++) {
            worst = fmax(worst, d[k]);
            sum += d[k] / colours / 3;
        }
    }
    print_message("off by %.3f codes at worst, %.5f on average; fold %.2f\n", 255 * worst,
                  255 * sum, display_fold(&m));
    assert_true(worst <= HALF_A_CODE);
    assert_true(255 * sum <= MEAN_CODES);
    free(t);
}

// What is out of gamut by more than the table's error is so by the table too.
static void the_table_sees_the_gamut_end(void **state)
{
    (void)state;
    struct display_model m = corrected();
    struct display_table *t = display_table_create(&m, NULL);
    assert_non_null(t);
    seed = 7;
    for (int n = 0; n < 20000; n++) {
        struct xyz target = {520 * uniform() - 20, 520 * uniform() - 20, 600 * uniform() - 20};
        struct display_inverse at = display_invert(&m, target);
        struct counts l = display_table_linear(t, display_day_invert(&m, target));
        const double got[3] = {l.r, l.g, l.b}, is[3] = {at.linear.r, at.linear.g, at.linear.b};
        bool outside = false, far = false;
        for (int c = 0; c < 3; c++) {
            outside = outside || got[c] < 0 || got[c] > 1;
            far = far || is[c] < -0.01 || is[c] > 1.01;
        }
        assert_true(!far || outside);
    }
    free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_corners_are_exact_for_quadratic_forms),
        cmocka_unit_test(places_beyond_the_ends_are_at_the_ends),
        cmocka_unit_test(random_colours_are_found_to_half_a_code),
        cmocka_unit_test(the_table_sees_the_gamut_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
