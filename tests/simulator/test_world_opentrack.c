// SPDX-License-Identifier: Apache-2.0
// Where opentrack sees the head of the emulated world.
#include "simulator/world.h"

#include "tests/simulator/cmocka_here.h"

#define CAST 1e-6 // m: places are far above it

static const struct vec3 eye_from_head = {0, -0.06, -0.02}; // of the shipped clip

static struct world *make(const struct scenario *scenario)
{
    struct error err = {0};
    struct world *made = world_create(scenario, 0, &err);
    if (!made)
        fail_msg("%s", err.text);
    return made;
}

static struct scenario booth_of(double x, double y, double z)
{
    struct scenario s;
    small_booth(&s);
    memcpy(s.head.eye_m, (double[]){x, y, z}, sizeof s.head.eye_m);
    return s;
}

static double apart(struct vec3 a, struct vec3 b)
{
    return vec3_length(vec3_sub(a, b));
}

static void beside_the_markers_camera_it_sees_the_same_head(void **state)
{
    (void)state;
    struct scenario s = booth_of(0.15, 0.5, 0.6);
    struct world *world = make(&s);
    struct around around = world_around(world);
    struct vec3 markers[3], top_of_clip = {0, 0.040, -0.030};
    around.markers(around.context, 0, markers);
    struct rigid head = around.head(around.context, 0);
    assert_near(apart(head.translation, markers[1]), 0, CAST);
    assert_near(apart(rigid_apply(head, top_of_clip), markers[0]), 0, CAST);
    world_destroy(world);
}

static void elsewhere_it_sees_the_eyes_where_they_are(void **state)
{
    (void)state;
    struct scenario s = booth_of(0.2, 0.55, 0.65);
    s.opentrack.yaw_deg = 90; // its axis points along the booth's x
    s.opentrack.pitch_deg = 0;
    memcpy(s.opentrack.place_m, (double[]){-1, 0.35, -0.2}, sizeof s.opentrack.place_m);
    struct world *world = make(&s);
    struct around around = world_around(world);
    struct rigid head = around.head(around.context, 0);
    struct vec3 eye = rigid_apply(head, eye_from_head);
    assert_near(eye.x, -(0.65 + 0.2), CAST);
    assert_near(eye.y, 0.55 - 0.35, CAST);
    assert_near(eye.z, 1.2, CAST);
    world_destroy(world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(beside_the_markers_camera_it_sees_the_same_head),
        cmocka_unit_test(elsewhere_it_sees_the_eyes_where_they_are),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
