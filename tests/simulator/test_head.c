// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "simulator/head.h"

#include <cmocka.h> // last: its fail() is a macro

#define ROUNDING_M 1e-12

static const struct vec3 eye = {0, 0.55, 0.65};
static const struct vec3 straight = {0, 0.55, -1};

static struct scenario_head wearing(int markers)
{
    return (struct scenario_head){.clip_from_eye_m = {0, 0.06, 0.02},
                                  .turn_most_deg = 10,
                                  .markers = markers,
                                  .fourth_m = {0.06, 0.03, -0.02}};
}

static void expect_at(struct vec3 p, double x, double y, double z)
{
    assert_true(fabs(p.x - x) < ROUNDING_M);
    assert_true(fabs(p.y - y) < ROUNDING_M);
    assert_true(fabs(p.z - z) < ROUNDING_M);
}

static void a_clip_has_its_markers_in_one_upright_plane(void **state)
{
    (void)state;
    struct scenario_head head = wearing(HEAD_CLIP);
    struct vec3 places[3];
    clip_markers(&head, eye, straight, places);
    expect_at(places[0], 0, 0.61 + 0.040, 0.67 - 0.030);
    expect_at(places[1], 0, 0.61, 0.67);
    expect_at(places[2], 0, 0.61 - 0.070, 0.67 - 0.080);
}

static void a_cap_has_one_on_top_and_two_below_it_at_the_sides(void **state)
{
    (void)state;
    struct scenario_head head = wearing(HEAD_CAP);
    struct vec3 places[3];
    clip_markers(&head, eye, straight, places);
    expect_at(places[0], 0, 0.61, 0.67);
    expect_at(places[1], -0.040, 0.61 - 0.060, 0.67 - 0.100);
    expect_at(places[2], 0.040, 0.61 - 0.060, 0.67 - 0.100);
}

static void a_fourth_marker_is_there_when_worn_and_turns_with_the_head(void **state)
{
    (void)state;
    struct scenario_head head = wearing(HEAD_CLIP);
    struct vec3 place, places[3], aside = {1, 0.55, -1};
    assert_false(head_fourth_marker(&head, eye, straight, &place));
    head.fourth = true;
    assert_true(head_fourth_marker(&head, eye, straight, &place));
    expect_at(place, 0.06, 0.61 + 0.03, 0.67 - 0.02);
    assert_true(head_fourth_marker(&head, eye, aside, &place));
    clip_markers(&head, eye, aside, places);
    struct vec3 apart = vec3_sub(place, places[1]);
    assert_true(fabs(apart.x * apart.x + apart.y * apart.y + apart.z * apart.z - 0.0049) < 1e-9);
    assert_true(fabs(apart.x - 0.06) > 1e-4);
}

static void a_rolled_camera_has_its_right_up(void **state)
{
    (void)state;
    struct scenario_camera camera = {.place_m = {0, 0.3, -0.2}, .roll_deg = 90};
    expect_at(rigid_apply(camera_pose(&camera), (struct vec3){0, 1.3, -0.2}), 1, 0, 0);
    camera = (struct scenario_camera){.pitch_deg = 30, .roll_deg = 90};
    expect_at(rigid_apply(camera_pose(&camera), (struct vec3){0, 0.5, sqrt(0.75)}), 0, 0, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_clip_has_its_markers_in_one_upright_plane),
        cmocka_unit_test(a_cap_has_one_on_top_and_two_below_it_at_the_sides),
        cmocka_unit_test(a_rolled_camera_has_its_right_up),
        cmocka_unit_test(a_fourth_marker_is_there_when_worn_and_turns_with_the_head),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
