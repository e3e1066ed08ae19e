// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"
#include "simulator/model_witmotion.h"

#include <cmocka.h> // last: its fail() is a macro

#define ANGLE_DEG 0.12  // six sigma of 0.02 degrees
#define ACC_G 0.004     // six sigma of the same angle, and 1/2048 g of resolution

static struct vec3 field;
static struct witmotion device;

static struct vec3 gravity(void *context, int64_t at_ns)
{
    (void)context, (void)at_ns;
    return field;
}

static int fresh(void **state)
{
    (void)state;
    struct around around = {.gravity = gravity};
    field = (struct vec3){0, 0, 9.81};
    witmotion_init(&device, WITMOTION_STANDARD, &around, "EMUWT901-001", 5, 0);
    return 0;
}

static double signed_word(int address)
{
    return (int16_t)device.registers[address];
}

static void look(double x, double y, double z)
{
    field = (struct vec3){x, y, z};
    witmotion_refresh(&device, NS_PER_S);
}

static void flat_is_one_g_upwards_and_no_angle(void **state)
{
    (void)state;
    look(0, 0, 9.80665);
    assert_true(fabs(signed_word(0x36) / 32768 * 16 - 1) < ACC_G);
    assert_true(fabs(signed_word(0x3D) / 32768 * 180) < ANGLE_DEG);
    assert_true(fabs(signed_word(0x3E) / 32768 * 180) < ANGLE_DEG);
}

static void tilting_the_screen_is_roll(void **state)
{
    (void)state;
    for (int tilt = -180; tilt <= 180; tilt += 15) {
        look(0, 9.80665 * sin(tilt * M_PI / 180), 9.80665 * cos(tilt * M_PI / 180));
        double roll = signed_word(0x3D) / 32768 * 180;
        assert_true(fabs(remainder(roll - tilt, 360)) < ANGLE_DEG);
        assert_true(fabs(signed_word(0x35) / 32768 * 16 - sin(tilt * M_PI / 180)) < ACC_G);
    }
}

static void leaning_sideways_is_pitch(void **state)
{
    (void)state;
    look(9.80665 * sin(M_PI / 9), 0, 9.80665 * cos(M_PI / 9));
    assert_true(fabs(signed_word(0x3E) / 32768 * 180 + 20) < ANGLE_DEG);
}

static void settings_stay_locked_without_the_key(void **state)
{
    (void)state;
    witmotion_write(&device, 0x03, 9, 0);
    assert_int_equal(device.registers[0x03], 6);
    witmotion_write(&device, 0x69, 0xB588, 0);
    witmotion_write(&device, 0x03, 9, NS_PER_S);
    assert_int_equal(device.registers[0x03], 9);
    witmotion_write(&device, 0x03, 6, 11 * NS_PER_S); // locked again after 10 s
    assert_int_equal(device.registers[0x03], 9);
    witmotion_write(&device, 0x34, 1234, NS_PER_S); // a reading is no setting
    assert_int_not_equal(device.registers[0x34], 1234);
}

static void it_bears_its_serial_and_address(void **state)
{
    (void)state;
    assert_int_equal(device.registers[0x1A], 0x50);
    assert_int_equal(device.registers[0x7F], 'E' << 8 | 'M');
    assert_int_equal(device.registers[0x80], 'U' << 8 | 'W');
}

static void temperature_is_a_room_s(void **state)
{
    (void)state;
    witmotion_refresh(&device, 1000 * NS_PER_S);
    assert_in_range(device.registers[0x40], 2000, 3500);
}

static double precise(int address)
{
    const uint16_t *r = device.registers + address;
    return (int32_t)((uint32_t)r[1] << 16 | r[0]) / 1000.0;
}

static void the_precise_map_has_angles_of_32_bits_low_word_first(void **state)
{
    (void)state;
    struct around around = {.gravity = gravity};
    witmotion_init(&device, WITMOTION_PRECISE, &around, "EMUHWT9073", 5, 0);
    look(9.80665 * sin(M_PI / 9), 0, -9.80665 * cos(M_PI / 9)); // over the back, pitch -20
    assert_true(fabs(fabs(precise(0x3D)) - 180) < ANGLE_DEG);
    assert_true(fabs(precise(0x3F) + 20) < ANGLE_DEG);
    assert_true(fabs(precise(0x41)) < ANGLE_DEG);
    assert_int_equal(device.registers[0x40], 0xFFFF); // the high word of a small negative
    assert_in_range(device.registers[0x43], 2000, 3500);
    assert_true(fabs(signed_word(0x36) / 32768 * 16 + cos(M_PI / 9)) < ACC_G);
}

#define WITH(test) cmocka_unit_test_setup(test, fresh)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH(flat_is_one_g_upwards_and_no_angle), WITH(tilting_the_screen_is_roll),
        WITH(leaning_sideways_is_pitch),          WITH(settings_stay_locked_without_the_key),
        WITH(it_bears_its_serial_and_address),    WITH(temperature_is_a_room_s),
        WITH(the_precise_map_has_angles_of_32_bits_low_word_first),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
