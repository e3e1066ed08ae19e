// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/linear.h"
#include "tests/fakes/near.h"

// A handful of roundings of numbers near 1.
static const double ROUNDING = 1e-14;
// The condition of a matrix moves by up to cond^2 roundings with its last bits.
static const double HILBERT_ROUNDING = 1e-9;
// The conditions of real primaries are known to two digits.
static const double TWO_DIGITS = 0.05;

static void assert_same(struct mat3 a, struct mat3 b, double tolerance)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            assert_near(a.m[i][j], b.m[i][j], tolerance);
}

static void assert_vector(struct vec3 v, double x, double y, double z)
{
    assert_near(v.x, x, ROUNDING);
    assert_near(v.y, y, ROUNDING);
    assert_near(v.z, z, ROUNDING);
}

// A deterministic number in -1..1.
static double wander(uint32_t *seed)
{
    *seed = *seed * 1664525 + 1013904223;
    return *seed / 2147483648.0 - 1;
}

static struct mat3 some_matrix(uint32_t *seed)
{
    struct mat3 a;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            a.m[i][j] = wander(seed);
    return a;
}

static void rotations_are_right_handed(void **state)
{
    (void)state;
    assert_vector(mat3_apply(mat3_rotation(0, M_PI_2), (struct vec3){0, 1, 0}), 0, 0, 1);
    assert_vector(mat3_apply(mat3_rotation(1, M_PI_2), (struct vec3){0, 0, 1}), 1, 0, 0);
    assert_vector(mat3_apply(mat3_rotation(2, M_PI_2), (struct vec3){1, 0, 0}), 0, 1, 0);
}

static void rotations_about_one_axis_add_up(void **state)
{
    (void)state;
    for (int axis = 0; axis < 3; axis++)
        assert_same(mat3_mul(mat3_rotation(axis, 0.3), mat3_rotation(axis, 1.1)),
                    mat3_rotation(axis, 1.4), ROUNDING);
}

static void the_inverse_of_a_published_matrix_is_the_published_inverse(void **state)
{
    (void)state;
    // IEC 61966-2-1 gives sRGB's matrix and its inverse to four decimals.
    const double FOUR_DECIMALS = 5e-4;
    struct mat3 srgb = {
        {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
    struct mat3 back = {
        {{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};
    struct mat3 inverse;
    assert_true(mat3_invert(srgb, &inverse));
    assert_same(inverse, back, FOUR_DECIMALS);
}

static void a_matrix_times_its_inverse_is_one(void **state)
{
    (void)state;
    uint32_t seed = 1;
    for (int i = 0; i < 200; i++) {
        struct mat3 a = some_matrix(&seed), inverse;
        assert_true(mat3_invert(a, &inverse));
        // Cofactors lose up to cond squared roundings.
        double k = mat3_condition(a);
        assert_same(mat3_mul(a, inverse), mat3_identity(), 1e-15 * (10 + k * k));
    }
}

static void a_singular_matrix_has_no_inverse_and_leaves_the_result_alone(void **state)
{
    (void)state;
    struct mat3 out = mat3_identity();
    struct mat3 flat = {{{1, 2, 3}, {2, 4, 6}, {1, 0, 1}}};
    struct mat3 bad = {{{NAN, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    struct mat3 zero = {{{0}}};
    assert_false(mat3_invert(flat, &out));
    assert_false(mat3_invert(bad, &out));
    assert_false(mat3_invert(zero, &out));
    assert_same(out, mat3_identity(), 0);
    assert_true(mat3_condition(zero) == INFINITY);
}

static void the_hilbert_matrix_has_its_published_condition(void **state)
{
    (void)state;
    // Todd 1954; the 3x3 Hilbert matrix, 2-norm.
    struct mat3 hilbert = {
        {{1, 1.0 / 2, 1.0 / 3}, {1.0 / 2, 1.0 / 3, 1.0 / 4}, {1.0 / 3, 1.0 / 4, 1.0 / 5}}};
    assert_near(mat3_condition(hilbert), 524.0567775860608, HILBERT_ROUNDING * 524);
}

static void real_primaries_have_their_known_condition(void **state)
{
    (void)state;
    struct mat3 srgb = {{{0.4123908, 0.3575843, 0.1804808},
                         {0.2126390, 0.7151687, 0.0721923},
                         {0.0193308, 0.1191948, 0.9505322}}};
    struct mat3 p3 = {{{0.4865709, 0.2656677, 0.1982173},
                       {0.2289746, 0.6917385, 0.0792869},
                       {0.0000000, 0.0451134, 1.0439444}}};
    struct mat3 rec2020 = {{{0.6369580, 0.1446169, 0.1688810},
                            {0.2627002, 0.6779981, 0.0593017},
                            {0.0000000, 0.0280727, 1.0609851}}};
    assert_near(mat3_condition(srgb), 4.3, TWO_DIGITS);
    assert_in_range((int)(1000 * mat3_condition(p3)), 2350, 4350);
    assert_near(mat3_condition(rec2020), 2.4, TWO_DIGITS);
}

static void near_collinear_primaries_are_told_from_sound_ones(void **state)
{
    (void)state;
    struct mat3 a = {{{1, 1, 0.3}, {1, 1.001, 0.2}, {0.2, 0.2, 1}}};
    assert_true(mat3_condition(a) > 1000);
    double exact = 0;
    for (double e = 1; e > 1e-12; e /= 10) {
        struct mat3 thin = {{{1, 0, 0}, {0, 1, 0}, {0, 0, e}}};
        struct mat3 turned = mat3_mul(mat3_mul(mat3_rotation(0, 0.7), thin), mat3_rotation(2, 1.9));
        exact = 1 / e;
        // Rounding of the entries themselves moves the smallest singular value by 1e-16.
        assert_near(mat3_condition(turned) / exact, 1, ROUNDING + 1e-15 * exact);
    }
}

static void the_condition_does_not_change_by_rotation_or_scale(void **state)
{
    (void)state;
    uint32_t seed = 7;
    for (int i = 0; i < 100; i++) {
        struct mat3 a = some_matrix(&seed), b = a;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                b.m[r][c] *= 1024;
        double k = mat3_condition(a);
        assert_true(k >= 1 - ROUNDING);
        assert_near(mat3_condition(b) / k, 1, ROUNDING);
        struct mat3 turned = mat3_mul(mat3_rotation(i % 3, wander(&seed)), a);
        assert_near(mat3_condition(turned) / k, 1, ROUNDING * (1 + k));
        assert_near(mat3_condition(mat3_transpose(a)) / k, 1, ROUNDING * (1 + k));
    }
}

static void a_rigid_transform_and_its_inverse_cancel(void **state)
{
    (void)state;
    struct rigid t = {mat3_mul(mat3_rotation(0, 0.4), mat3_rotation(1, -1.2)), {0.1, -2, 3}};
    struct vec3 p = {0.5, 0.25, -4};
    assert_vector(rigid_apply(rigid_inverse(t), rigid_apply(t, p)), p.x, p.y, p.z);
    struct rigid none = rigid_mul(rigid_inverse(t), t);
    assert_same(none.rotation, mat3_identity(), ROUNDING);
    assert_vector(none.translation, 0, 0, 0);
}

static void a_product_of_transforms_applies_the_right_one_first(void **state)
{
    (void)state;
    struct rigid turn = {mat3_rotation(2, M_PI_2), {0, 0, 0}};
    struct rigid move = {mat3_identity(), {1, 0, 0}};
    assert_vector(rigid_apply(rigid_mul(turn, move), (struct vec3){0, 0, 0}), 0, 1, 0);
    assert_vector(rigid_apply(rigid_mul(move, turn), (struct vec3){0, 0, 0}), 1, 0, 0);
}

static void vectors_keep_their_identities(void **state)
{
    (void)state;
    struct vec3 x = {1, 0, 0}, y = {0, 1, 0}, zero = {0, 0, 0}, v = {3, 4, 12};
    assert_vector(vec3_cross(x, y), 0, 0, 1);
    assert_vector(vec3_unit(zero), 0, 0, 0);
    assert_near(vec3_length(v), 13, ROUNDING);
    assert_near(vec3_length(vec3_unit(v)), 1, ROUNDING);
    assert_near(vec3_dot(vec3_cross(v, x), v), 0, ROUNDING);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rotations_are_right_handed),
        cmocka_unit_test(rotations_about_one_axis_add_up),
        cmocka_unit_test(the_inverse_of_a_published_matrix_is_the_published_inverse),
        cmocka_unit_test(a_matrix_times_its_inverse_is_one),
        cmocka_unit_test(a_singular_matrix_has_no_inverse_and_leaves_the_result_alone),
        cmocka_unit_test(the_hilbert_matrix_has_its_published_condition),
        cmocka_unit_test(real_primaries_have_their_known_condition),
        cmocka_unit_test(near_collinear_primaries_are_told_from_sound_ones),
        cmocka_unit_test(the_condition_does_not_change_by_rotation_or_scale),
        cmocka_unit_test(a_rigid_transform_and_its_inverse_cancel),
        cmocka_unit_test(a_product_of_transforms_applies_the_right_one_first),
        cmocka_unit_test(vectors_keep_their_identities),
    };
    return cmocka_run_group_tests_name("linear", tests, NULL, NULL);
}
