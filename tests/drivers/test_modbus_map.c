// SPDX-License-Identifier: Apache-2.0
#include <modbus.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/modbus_map.h"
#include "drivers/witmotion.h"

#include <cmocka.h>

#include "tests/fakes/near.h"
#include "tests/fakes/pty.h"

static const double arithmetic = 1e-9;
static const double single = 1e-5;      // a float's rounding of tens of degrees
static const double rounding_deg = 0.1; // of gravity to whole mm/s2, and of the angle to 0.01
enum { BUDGET_MS = 3000, GENERIC = 2 };

static double value_of(enum modbus_format format, bool low_first, uint16_t a, uint16_t b)
{
    const struct modbus_field field = {0, 1, format, low_first, 0.001, 0, NAN};
    const uint16_t words[] = {a, b};
    double value = NAN;
    modbus_field_value(&field, words, 0, &value);
    return value;
}

static void every_width_sign_and_word_order_reads(void **state)
{
    (void)state;
    assert_near(value_of(MODBUS_S16, false, 0xf63c, 0), -2.5, arithmetic);
    assert_near(value_of(MODBUS_U16, false, 0xf63c, 0), 63.036, arithmetic);
    assert_near(value_of(MODBUS_S32, true, 0xf63c, 0xffff), -2.5,
                arithmetic); // WitMotion's example
    assert_near(value_of(MODBUS_S32, false, 0x0001, 0x5f90), 90, arithmetic);
    assert_near(value_of(MODBUS_U32, false, 0xffff, 0xfffe), 4294967.294, arithmetic);
    assert_near(value_of(MODBUS_FLOAT, false, 0x42b4, 0x0000), 0.09, single); // 90.0
    assert_near(value_of(MODBUS_FLOAT, true, 0x0000, 0xc2b4), -0.09, single);
}

static void values_follow_each_other(void **state)
{
    (void)state;
    const struct modbus_field field = {7, 3, MODBUS_S32, false, 1, 0, NAN};
    const uint16_t words[] = {0, 1, 0, 2, 0xffff, 0xfffd};
    double value;
    const double wanted[] = {1, 2, -3};
    assert_int_equal(modbus_field_words(&field), 6);
    for (int i = 0; i < 3; i++) {
        assert_true(modbus_field_value(&field, words, i, &value));
        assert_near(value, wanted[i], arithmetic);
    }
}

static void the_sentinel_and_nan_are_no_values(void **state)
{
    (void)state;
    const struct modbus_field balluff = {0, 1, MODBUS_U16, false, 0.01, 0, 55555};
    const struct modbus_field real = {0, 1, MODBUS_FLOAT, false, 1, 0, NAN};
    double value;
    assert_false(modbus_field_value(&balluff, (const uint16_t[]){55555}, 0, &value));
    assert_true(modbus_field_value(&balluff, (const uint16_t[]){9000}, 0, &value));
    assert_near(value, 90, arithmetic);
    assert_false(modbus_field_value(&real, (const uint16_t[]){0x7fc0, 0}, 0, &value));
    assert_false(modbus_field_value(&real, (const uint16_t[]){0x7f80, 0}, 0, &value));
}

static struct accelerometer_options generic(void)
{
    struct accelerometer_options options;
    memset(&options, 0, sizeof options);
    settings_preset(accelerometer_settings, &options);
    options.model = GENERIC;
    return options;
}

static void a_map_without_registers_or_axes_is_refused(void **state)
{
    (void)state;
    struct accelerometer_options o = generic();
    struct modbus_map map;
    struct error err = {0};
    assert_false(modbus_map_generic(&o, &map, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "angle_register"));
    o.angle_register = 65535;
    assert_true(modbus_map_generic(&o, &map, &err));
    o.angle_format = MODBUS_S32;
    assert_false(modbus_map_generic(&o, &map, &err));
    assert_non_null(strstr(err.text, "65535"));
    o.angle_register = 0;
    const double bad[][3] = {{1, 2, 2}, {0, 1, 2}, {1, 2.5, 3}, {-1, 1, 2}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        memcpy(o.accel_axes, bad[i], sizeof bad[i]);
        assert_false(modbus_map_generic(&o, &map, &err));
        assert_non_null(strstr(err.text, "accel_axes"));
    }
}

static void the_axes_turn_the_sensor_into_the_screen(void **state)
{
    (void)state;
    struct accelerometer_options o = generic();
    struct modbus_map map;
    struct tilt_sample s = {0};
    o.accel_register = 0;
    o.accel_scale = 0.001;
    memcpy(o.accel_axes, (const double[]){3, -1, 2}, sizeof o.accel_axes);
    assert_true(modbus_map_generic(&o, &map, NULL));
    // The sensor's -x is the screen's up: upright.
    const uint16_t words[] = {(uint16_t)-9810, 0, 20};
    modbus_decode(&map, words, NULL, 0, &s);
    assert_near(s.gravity.x, 0.02, arithmetic);
    assert_near(s.gravity.y, 9.81, arithmetic);
    assert_near(s.tilt_deg, 90, arithmetic);
    assert_true(isnan(s.angle_deg));
    assert_true(s.plausible);
}

static void an_angle_alone_is_the_tilt(void **state)
{
    (void)state;
    struct accelerometer_options o = generic();
    struct modbus_map map;
    struct tilt_sample s = {0};
    o.angle_register = 0;
    o.angle_format = MODBUS_U16;
    o.sentinel = 55555;
    assert_true(modbus_map_generic(&o, &map, NULL));
    modbus_decode(&map, NULL, (const uint16_t[]){33000}, 5, &s);
    assert_near(s.tilt_deg, -25, arithmetic);
    assert_near(s.gravity.z, 0, 0);
    assert_true(s.plausible);
    modbus_decode(&map, NULL, (const uint16_t[]){55555}, 5, &s);
    assert_false(s.plausible);
    assert_int_equal(s.doubt, TILT_NO_READING);
}

static void a_wrong_map_is_said(void **state)
{
    (void)state;
    struct accelerometer_options o = generic();
    struct modbus_map map;
    struct tilt_sample s = {0};
    o.accel_register = 0;
    o.angle_register = 3;
    o.accel_scale = 0.001;
    assert_true(modbus_map_generic(&o, &map, NULL));
    const uint16_t flat[] = {0, 0, 9810};
    modbus_decode(&map, flat, (const uint16_t[]){3000}, 0, &s);
    assert_false(s.plausible);
    assert_string_equal(tilt_doubt_text(s.doubt),
                        "angle and acceleration disagree: is the map right?");
    modbus_decode(&map, flat, (const uint16_t[]){100}, 0, &s);
    assert_true(s.plausible);
    modbus_decode(&map, (const uint16_t[]){0, 0, 12000}, (const uint16_t[]){0}, 0, &s);
    assert_int_equal(s.doubt, TILT_GRAVITY);
}

// A sensor of another make: gravity in mm/s2 in input registers 100.., the
// angle as s32 high word first in thousandths at 0.
static void serve(struct pty *pty, void *context)
{
    modbus_mapping_t *registers = context;
    modbus_t *bus = modbus_new_rtu("/dev/null", 9600, 'N', 8, 1);
    uint8_t query[MODBUS_MAX_ADU_LENGTH];
    modbus_set_slave(bus, 7);
    modbus_set_socket(bus, pty->master);
    modbus_set_indication_timeout(bus, 0, 20000);
    while (!pty->stop) {
        int count = modbus_receive(bus, query);
        if (count > 0)
            modbus_reply(bus, query, count, registers);
        else if (count < 0)
            usleep(2000);
    }
    modbus_free(bus);
}

static int64_t soon(void)
{
    return clock_now_ns() + BUDGET_MS * NS_PER_MS;
}

static void a_sensor_described_in_the_settings_is_read(void **state)
{
    (void)state;
    modbus_mapping_t *registers = modbus_mapping_new(0, 0, 0, 200);
    struct accelerometer_options o = generic();
    struct instrument_identity who;
    struct tilt_sample s;
    struct error err = {0};
    struct pty pty;
    registers->tab_input_registers[0] = 0;
    registers->tab_input_registers[1] = 60000;
    registers->tab_input_registers[101] = 8496; // 9.81 sin 60
    registers->tab_input_registers[102] = 4905;
    assert_true(pty_start(&pty, serve, registers));
    strcpy(o.port, pty.path);
    o.unit = 7;
    o.function = 4;
    o.accel_register = 100;
    o.accel_scale = 0.001;
    o.angle_format = MODBUS_S32;
    o.angle_register = 0;
    o.angle_scale = 0.001;
    struct accelerometer *a = witmotion_driver.open(&o, soon(), &err);
    if (!a)
        print_error("%s\n", err.text);
    assert_non_null(a);
    witmotion_driver.identify(a, &who);
    assert_string_equal(who.model, "generic");
    assert_true(witmotion_driver.read(a, soon(), &s, &err));
    assert_near(s.angle_deg, 60, arithmetic);
    assert_near(s.tilt_deg, 60, rounding_deg);
    assert_true(s.plausible);
    witmotion_driver.close(a);
    o.angle_register = 500; // the sensor has no such register
    assert_null(witmotion_driver.open(&o, soon(), &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "is the map right?"));
    pty_stop(&pty);
    modbus_mapping_free(registers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_sign_and_word_order_reads),
        cmocka_unit_test(values_follow_each_other),
        cmocka_unit_test(the_sentinel_and_nan_are_no_values),
        cmocka_unit_test(a_map_without_registers_or_axes_is_refused),
        cmocka_unit_test(the_axes_turn_the_sensor_into_the_screen),
        cmocka_unit_test(an_angle_alone_is_the_tilt),
        cmocka_unit_test(a_wrong_map_is_said),
        cmocka_unit_test(a_sensor_described_in_the_settings_is_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
