// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "colorimetry/lattice.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

// Sums of 64 products of numbers near 1 in double.
#define ARITHMETIC 1e-13
// Central differences over 1e-5 of a box of size 1..200: rounding and curvature.
#define DIFFERENCES 1e-7

// The largest slope is looked for at places a quarter of an interval apart.
#define BETWEEN_PLACES 1.05

static uint64_t seed = 1;

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

static struct lattice box(void)
{
    return (struct lattice){.least = {0, -80, -110}, .most = {100, 90, 95}};
}

static struct lattice rough(void)
{
    struct lattice l = box();
    for (int k = 0; k < LATTICE_NODES; k++)
        for (int n = 0; n < 3; n++)
            l.node[k][n] = 2 * uniform() - 1;
    return l;
}

static struct vec3 within(const struct lattice *l, double x, double y, double z)
{
    return (struct vec3){l->least.x + x * (l->most.x - l->least.x),
                         l->least.y + y * (l->most.y - l->least.y),
                         l->least.z + z * (l->most.z - l->least.z)};
}

static void at_a_knot_the_weights_are_one_four_one_sixths(void **state)
{
    (void)state;
    // de Boor 1978: the cubic B-spline of equal knots.
    struct lattice l = {.least = {0, 0, 0}, .most = {3, 3, 3}};
    struct lattice_place p = lattice_find(&l, (struct vec3){1, 0, 3});
    assert_int_equal(p.first[0], 1);
    assert_int_equal(p.first[2], LATTICE_SIDE - 4);
    const double knot[4] = {1.0 / 6, 4.0 / 6, 1.0 / 6, 0};
    for (int i = 0; i < 4; i++) {
        assert_near(p.weight[0][i], knot[i], ARITHMETIC);
        assert_near(p.weight[1][i], knot[i], ARITHMETIC);
        assert_near(p.weight[2][i], knot[3 - i], ARITHMETIC);
    }
}

static void weights_sum_to_one_and_their_slopes_to_nothing(void **state)
{
    (void)state;
    struct lattice l = box();
    for (int n = 0; n < 1000; n++) {
        struct lattice_place p = lattice_find(&l, within(&l, uniform(), uniform(), uniform()));
        for (int axis = 0; axis < 3; axis++) {
            double sum = 0, slope = 0;
            for (int i = 0; i < 4; i++) {
                assert_true(p.weight[axis][i] >= 0);
                sum += p.weight[axis][i];
                slope += p.slope[axis][i];
            }
            assert_near(sum, 1, ARITHMETIC);
            assert_near(slope, 0, ARITHMETIC);
        }
    }
}

static void coefficients_on_a_plane_give_that_plane(void **state)
{
    (void)state;
    struct lattice l = box();
    for (int i = 0; i < LATTICE_SIDE; i++)
        for (int j = 0; j < LATTICE_SIDE; j++)
            for (int k = 0; k < LATTICE_SIDE; k++) {
                double x = lattice_abscissa(&l, 0, i), y = lattice_abscissa(&l, 1, j),
                       z = lattice_abscissa(&l, 2, k);
                double *node = l.node[lattice_node(i, j, k)];
                node[0] = x;
                node[1] = 3 - 0.5 * y + 0.25 * z;
                node[2] = 7;
            }
    for (int n = 0; n < 1000; n++) {
        struct vec3 at = within(&l, uniform(), uniform(), uniform());
        struct mat3 slopes;
        struct vec3 v = lattice_at(&l, at, &slopes);
        assert_near(v.x, at.x, 200 * ARITHMETIC);
        assert_near(v.y, 3 - 0.5 * at.y + 0.25 * at.z, 200 * ARITHMETIC);
        assert_near(v.z, 7, 200 * ARITHMETIC);
        assert_near(slopes.m[0][0], 1, 200 * ARITHMETIC);
        assert_near(slopes.m[1][2], 0.25, 200 * ARITHMETIC);
        assert_near(slopes.m[2][0], 0, 200 * ARITHMETIC);
    }
}

static void slopes_are_those_of_the_values_and_stay_below_the_bound(void **state)
{
    (void)state;
    struct lattice l = rough();
    const double h = 1e-3;
    double bound = lattice_slope_most(&l);
    for (int n = 0; n < 2000; n++) {
        struct vec3 at = within(&l, 0.01 + 0.98 * uniform(), 0.01 + 0.98 * uniform(), uniform());
        struct mat3 slopes;
        lattice_at(&l, at, &slopes);
        struct vec3 low = lattice_at(&l, (struct vec3){at.x, at.y - h, at.z}, NULL);
        struct vec3 high = lattice_at(&l, (struct vec3){at.x, at.y + h, at.z}, NULL);
        assert_near(slopes.m[0][1], (high.x - low.x) / (2 * h), DIFFERENCES);
        assert_near(slopes.m[2][1], (high.z - low.z) / (2 * h), DIFFERENCES);
        for (int i = 0; i < 3; i++)
            assert_true(fabs(slopes.m[i][0]) + fabs(slopes.m[i][1]) + fabs(slopes.m[i][2]) <=
                        BETWEEN_PLACES * bound);
    }
    l.node[100][1] = NAN;
    assert_true(lattice_slope_most(&l) > 1e300);
}

static void beyond_the_box_it_is_constant_and_never_undefined(void **state)
{
    (void)state;
    struct lattice l = rough();
    struct mat3 slopes;
    struct vec3 edge = lattice_at(&l, within(&l, 1, 0.3, 0), NULL);
    struct vec3 beyond = lattice_at(&l, within(&l, 1e9, 0.3, -INFINITY), &slopes);
    assert_near(beyond.x, edge.x, ARITHMETIC);
    assert_near(beyond.y, edge.y, ARITHMETIC);
    assert_near(slopes.m[0][0], 0, 0);
    assert_near(slopes.m[1][2], 0, 0);
    assert_true(fabs(slopes.m[0][1]) > 0);
    struct vec3 none = lattice_at(&l, (struct vec3){NAN, NAN, NAN}, &slopes);
    struct vec3 least = lattice_at(&l, l.least, NULL);
    assert_near(none.x, least.x, 0);
    assert_near(slopes.m[1][1], 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(at_a_knot_the_weights_are_one_four_one_sixths),
        cmocka_unit_test(weights_sum_to_one_and_their_slopes_to_nothing),
        cmocka_unit_test(coefficients_on_a_plane_give_that_plane),
        cmocka_unit_test(slopes_are_those_of_the_values_and_stay_below_the_bound),
        cmocka_unit_test(beyond_the_box_it_is_constant_and_never_undefined),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
