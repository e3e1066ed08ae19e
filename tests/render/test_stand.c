// SPDX-License-Identifier: Apache-2.0
#include "tests/render/support.h"

#include "render/stand.h"

// Rounding of sin and cos near multiples of 90 degrees, on lengths below 1 m.
static const double ROUNDING_M = 1e-15;

static const struct stand STAND = {{0.1, 0.2, 0.3}, {0.01, 0.20, 0.03}};

static void assert_vec3(struct vec3 got, double x, double y, double z, double tolerance)
{
    assert_float_within(got.x, x, tolerance);
    assert_float_within(got.y, y, tolerance);
    assert_float_within(got.z, z, tolerance);
}

static struct vec3 turned(double tilt_deg, double x, double y, double z)
{
    return mat3_apply(stand_pose(&STAND, tilt_deg).rotation, (struct vec3){x, y, z});
}

static void at_tilt_0_the_screen_lies_face_up_with_its_top_away_from_the_observer(void **state)
{
    (void)state;
    assert_vec3(turned(0, 0, 0, 1), 0, 1, 0, ROUNDING_M);
    assert_vec3(turned(0, 0, 1, 0), 0, 0, -1, ROUNDING_M);
    assert_vec3(turned(0, 1, 0, 0), 1, 0, 0, ROUNDING_M);
    assert_vec3(stand_pose(&STAND, 0).translation, 0.11, 0.23, 0.10, ROUNDING_M);
}

static void at_tilt_90_the_screen_stands_upright_and_faces_the_observer(void **state)
{
    (void)state;
    assert_vec3(turned(90, 0, 0, 1), 0, 0, 1, ROUNDING_M);
    assert_vec3(turned(90, 0, 1, 0), 0, 1, 0, ROUNDING_M);
    assert_vec3(stand_pose(&STAND, 90).translation, 0.11, 0.40, 0.33, ROUNDING_M);
}

static void at_tilt_30_the_centre_is_where_the_drawing_says(void **state)
{
    (void)state;
    // 0.20 sin 30 + 0.03 cos 30 above, 0.20 cos 30 - 0.03 sin 30 behind the hinge.
    assert_vec3(stand_pose(&STAND, 30).translation, 0.11, 0.2 + 0.125980762113533,
                0.3 - 0.158205080756888, 1e-14);
}

static void the_pose_is_a_rotation_and_continuous_at_any_tilt(void **state)
{
    (void)state;
    const double step_deg = 1e-7;
    for (double tilt = -450; tilt <= 450; tilt += 7.5) {
        struct rigid a = stand_pose(&STAND, tilt), b = stand_pose(&STAND, tilt + step_deg);
        struct mat3 unit = mat3_mul(a.rotation, mat3_transpose(a.rotation));
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                assert_float_within(unit.m[i][j], i == j, ROUNDING_M);
                assert_float_within(a.rotation.m[i][j], b.rotation.m[i][j], 1e-8);
            }
        assert_vec3(a.translation, b.translation.x, b.translation.y, b.translation.z, 1e-8);
    }
}

static void the_hinge_stays_where_it_is(void **state)
{
    (void)state;
    struct vec3 hinge_on_screen = {-0.01, -0.20, -0.03};
    for (double tilt = -90; tilt <= 90; tilt += 15)
        assert_vec3(rigid_apply(stand_pose(&STAND, tilt), hinge_on_screen), 0.1, 0.2, 0.3,
                    ROUNDING_M);
}

static void pixels_lie_inside_the_screen_with_the_first_at_the_top_left(void **state)
{
    (void)state;
    struct screen screen = {0.520, 0.325, 1280, 800};
    double half_px = 0.520 / 1280 / 2;
    assert_vec3(screen_point(&screen, 0, 0), -0.260 + half_px, 0.1625 - half_px, 0, ROUNDING_M);
    assert_vec3(screen_point(&screen, 1279, 799), 0.260 - half_px, -0.1625 + half_px, 0,
                ROUNDING_M);
    assert_vec3(screen_point(&screen, 639.5, 399.5), 0, 0, 0, ROUNDING_M);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(at_tilt_0_the_screen_lies_face_up_with_its_top_away_from_the_observer),
        cmocka_unit_test(at_tilt_90_the_screen_stands_upright_and_faces_the_observer),
        cmocka_unit_test(at_tilt_30_the_centre_is_where_the_drawing_says),
        cmocka_unit_test(the_pose_is_a_rotation_and_continuous_at_any_tilt),
        cmocka_unit_test(the_hinge_stays_where_it_is),
        cmocka_unit_test(pixels_lie_inside_the_screen_with_the_first_at_the_top_left),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
