// SPDX-License-Identifier: Apache-2.0
// Tilt by a sensor that is turned on the screen.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/accelerometer.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

#define ROUNDING 1e-9 // degrees

static double reading(double tilt, double a, double b, double c)
{
    return tilt_of_gravity(tilt_gravity_turned(tilt, (double[]){a, b, c}));
}

static void a_flush_sensor_reads_the_tilt(void **state)
{
    (void)state;
    const double flush[3] = {0};
    for (double tilt = -175; tilt <= 180; tilt += 12.5) {
        assert_near(tilt_wrap(reading(tilt, 0, 0, 0) - tilt), 0, ROUNDING);
        assert_near(tilt_of_turned(tilt, flush), tilt, ROUNDING);
    }
}

// By hand: turned about the screen's right it reads that much more; about its up by
// 60 degrees, tan r = tan t / cos 60.
static void known_turns_give_known_readings(void **state)
{
    (void)state;
    assert_near(reading(30, 4, 0, 0), 34, ROUNDING);
    assert_near(reading(45, 0, 60, 0), atan(2) * 180 / M_PI, ROUNDING);
    assert_near(reading(45, 0, 0, 60), atan(0.5) * 180 / M_PI, ROUNDING);
    struct vec3 flat = tilt_gravity_turned(0, (double[]){0, 30, 0});
    assert_near(flat.x, -0.5, ROUNDING); // its right points down
    assert_near(flat.z, sqrt(0.75), ROUNDING);
    struct vec3 upright = tilt_gravity_turned(90, (double[]){0, 0, 30});
    assert_near(upright.x, 0.5, ROUNDING); // its right points up
    assert_near(upright.y, sqrt(0.75), ROUNDING);
}

static void the_tilt_comes_back_whatever_the_turn(void **state)
{
    (void)state;
    for (double tilt = -178; tilt < 180; tilt += 9.3)
        for (double a = -80; a <= 80; a += 40)
            for (double b = -79; b <= 80; b += 26)
                for (double c = -79; c <= 80; c += 26) {
                    const double turned[3] = {a, b, c};
                    double r = reading(tilt, a, b, c);
                    assert_near(tilt_wrap(tilt_of_turned(r, turned) - tilt), 0, ROUNDING);
                    assert_near(vec3_length(tilt_gravity_turned(tilt, turned)), 1, ROUNDING);
                }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flush_sensor_reads_the_tilt),
        cmocka_unit_test(known_turns_give_known_readings),
        cmocka_unit_test(the_tilt_comes_back_whatever_the_turn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
