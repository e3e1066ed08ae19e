// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/clock.h"
#include "simulator/model_wiimote.h"

#include <cmocka.h> // last: its fail() is a macro

#define MS NS_PER_MS
#define BLOB_PX 3.5 // noise of 0.5 px and rounding, seven sigma

static struct vec3 places[3];
static struct wiimote *device;
static struct hid_model model;
static int64_t now_ns;

static void show(void *context, int64_t at_ns, struct vec3 out[3])
{
    (void)context, (void)at_ns;
    memcpy(out, places, sizeof(places));
}

static struct vec3 fourth;
static bool has_fourth;

static bool show_fourth(void *context, int64_t at_ns, struct vec3 *out)
{
    (void)context, (void)at_ns;
    *out = fourth;
    return has_fourth;
}

static int fresh(void **state)
{
    (void)state;
    has_fourth = false;
    struct wiimote_options options = {
        .around = {.markers = show, .fourth_marker = show_fourth}, .serial = "EMU:WII:01", .seed = 3};
    places[0] = (struct vec3){0, 0.04, 0.8};
    places[1] = (struct vec3){0.1, 0, 0.8};
    places[2] = (struct vec3){0, -0.07, 0.8};
    now_ns = 0;
    device = wiimote_create(&options);
    assert_non_null(device);
    model = wiimote_model(device);
    return 0;
}

static int gone(void **state)
{
    (void)state;
    wiimote_destroy(device);
    return 0;
}

static void send(const char *bytes, size_t size)
{
    assert_int_equal(model.out(model.context, now_ns, (const uint8_t *)bytes, size), 0);
}

static int next(uint8_t report[HID_REPORT_MOST])
{
    int64_t again_ns;
    return model.in(model.context, now_ns, report, &again_ns);
}

// The next data report; its size.
static int after(int64_t wait_ns, uint8_t report[HID_REPORT_MOST])
{
    now_ns += wait_ns;
    return next(report);
}

static void expect_ack(uint8_t of, uint8_t error)
{
    uint8_t report[HID_REPORT_MOST];
    assert_int_equal(next(report), 5);
    assert_int_equal(report[0], 0x22);
    assert_int_equal(report[3], of);
    assert_int_equal(report[4], error);
}

static void write_camera(uint8_t address, const char *bytes, uint8_t size)
{
    char frame[22] = {0x16, 0x04, (char)0xB0, 0x00, (char)address, (char)size};
    memcpy(frame + 6, bytes, size);
    send(frame, sizeof(frame));
    expect_ack(0x16, 0);
}

static void switch_camera_on(const char *mode)
{
    send("\x13\x04", 2);
    send("\x1A\x04", 2);
    write_camera(0x30, "\x08", 1);
    write_camera(0x00, "\x02\x00\x00\x71\x01\x00\xAA\x00\x64", 9);
    write_camera(0x1A, "\x63\x03", 2);
    write_camera(0x33, mode, 1);
    write_camera(0x30, "\x08", 1);
}

struct point {
    int x, y, size;
};

static struct point extended(const uint8_t *at)
{
    return (struct point){at[0] | (at[2] >> 4 & 3) << 8, at[1] | (at[2] >> 6) << 8, at[2] & 15};
}

static void expect_point(struct point p, double x, double y)
{
    assert_true(fabs(p.x - x) < BLOB_PX);
    assert_true(fabs(p.y - y) < BLOB_PX);
}

static void the_camera_is_blind_until_initialised(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST], nothing[12];
    memset(nothing, 0xFF, sizeof(nothing));
    send("\x12\x04\x33", 3);
    assert_int_equal(after(10 * MS, report), 18);
    assert_int_equal(report[0], 0x33);
    assert_memory_equal(report + 6, nothing, 12);
}

static void registers_refuse_while_the_camera_is_off(void **state)
{
    (void)state;
    send("\x16\x04\xB0\x00\x30\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 22);
    expect_ack(0x16, 7);
}

static void switching_asks_for_an_acknowledgement_when_told(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    send("\x13\x06", 2);
    expect_ack(0x13, 0);
    send("\x1A\x04", 2);
    assert_int_equal(next(report), -EAGAIN);
}

static void registers_read_back(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    switch_camera_on("\x03");
    send("\x17\x04\xB0\x00\x00\x00\x09", 7);
    assert_int_equal(next(report), 22);
    assert_memory_equal(report, "\x21\0\0\x80\0\0\x02\x00\x00\x71\x01\x00\xAA\x00\x64", 15);
}

static void markers_appear_where_a_pinhole_of_42_degrees_puts_them(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    switch_camera_on("\x03");
    send("\x12\x04\x33", 3);
    assert_int_equal(after(10 * MS, report), 18);
    double f = 512 / tan(21 * M_PI / 180);
    expect_point(extended(report + 6), 512, 384 + f * 0.05);
    expect_point(extended(report + 9), 512 - f * 0.125, 384);
    expect_point(extended(report + 12), 512, 384 - f * 0.0875);
    assert_memory_equal(report + 15, "\xFF\xFF\xFF", 3);
    assert_in_range(extended(report + 6).size, 1, 15);
}

static void the_basic_format_carries_the_same_places(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    switch_camera_on("\x01");
    send("\x12\x04\x36", 3);
    assert_int_equal(after(10 * MS, report), 22);
    const uint8_t *b = report + 3;
    double f = 512 / tan(21 * M_PI / 180);
    expect_point((struct point){b[0] | (b[2] >> 4 & 3) << 8, b[1] | (b[2] >> 6) << 8, 0}, 512,
                 384 + f * 0.05);
    expect_point((struct point){b[3] | (b[2] & 3) << 8, b[4] | (b[2] >> 2 & 3) << 8, 0},
                 512 - f * 0.125, 384);
    assert_memory_equal(b + 8, "\xFF\xFF", 2);
    send("\x12\x04\x37", 3);
    assert_int_equal(after(10 * MS, report), 22);
    assert_int_equal(report[0], 0x37);
    b = report + 6;
    expect_point((struct point){b[0] | (b[2] >> 4 & 3) << 8, b[1] | (b[2] >> 6) << 8, 0}, 512,
                 384 + f * 0.05);
}

// The two halves take turns; each holds two blobs of nine bytes.
static void the_full_format_comes_in_two_halves_with_boxes_and_brightness(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    switch_camera_on("\x05");
    send("\x12\x04\x3E", 3);
    for (int i = 0; i < 4; i++) {
        assert_int_equal(after(10 * MS, report), 22);
        assert_int_equal(report[0], i % 2 ? 0x3F : 0x3E);
        const uint8_t *at = report + 4;
        if (i % 2 == 0) {
            expect_point(extended(at), 512, 384 + 1334 * 0.04 / 0.8);
            expect_point(extended(at + 9), 512 - 1334 * 0.1 / 0.8, 384);
            assert_true(8 * at[3] <= 512 && 8 * at[5] + 8 >= 512);
            assert_true(at[3] < 128 && at[5] < 128 && at[4] < at[6]);
            assert_int_equal(at[7], 0);
            assert_true(at[8] > 0);
        } else {
            expect_point(extended(at), 512, 384 - 1334 * 0.07 / 0.8);
            assert_memory_equal(at + 9, "\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 9);
        }
    }
}

// Upright z is 1 g: its eight bits are spread over the buttons' spare ones.
static void the_full_format_spreads_the_acceleration_over_both_halves(void **state)
{
    (void)state;
    uint8_t first[HID_REPORT_MOST], second[HID_REPORT_MOST];
    switch_camera_on("\x05");
    send("\x12\x04\x3F", 3);
    assert_int_equal(after(10 * MS, first), 22);
    assert_int_equal(after(10 * MS, second), 22);
    int z = (first[1] >> 5 & 3) << 4 | (first[2] >> 5 & 3) << 6 | (second[1] >> 5 & 3) |
            (second[2] >> 5 & 3) << 2;
    assert_in_range(first[3], 0x80 - 4, 0x80 + 4);
    assert_in_range(second[3], 0x80 - 4, 0x80 + 4);
    // The halves are of two moments: a carry between them is worth 16 units.
    assert_in_range(z, 0x80 + 26 - 20, 0x80 + 26 + 20);
}

static void a_fourth_marker_is_the_fourth_blob(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    has_fourth = true;
    fourth = (struct vec3){-0.06, 0.03, 0.8};
    switch_camera_on("\x03");
    send("\x12\x04\x33", 3);
    assert_int_equal(after(10 * MS, report), 18);
    expect_point(extended(report + 15), 512 + 1334 * 0.06 / 0.8, 384 + 1334 * 0.03 / 0.8);
}

static void the_wrong_camera_mode_gives_no_points(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST], nothing[12];
    memset(nothing, 0xFF, sizeof(nothing));
    switch_camera_on("\x01");
    send("\x12\x04\x33", 3);
    after(10 * MS, report);
    assert_memory_equal(report + 6, nothing, 12);
}

static void what_is_behind_or_outside_is_not_seen(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    places[0].z = -0.8;
    places[2].x = 0.7;
    switch_camera_on("\x03");
    send("\x12\x04\x33", 3);
    after(10 * MS, report);
    double f = 512 / tan(21 * M_PI / 180);
    expect_point(extended(report + 6), 512 - f * 0.125, 384);
    assert_memory_equal(report + 9, "\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 9);
}

static void a_hundred_reports_come_in_a_second(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    send("\x12\x04\x31", 3);
    int count = 0;
    for (int i = 0; i < 1000; i++)
        if (after(MS, report) == 6)
            count++;
    assert_in_range(count, 99, 101);
}

static void a_status_request_is_answered(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    send("\x11\x10", 2);
    send("\x15\x00", 2);
    assert_int_equal(next(report), 7);
    assert_int_equal(report[0], 0x20);
    assert_int_equal(report[3], 0x10);
}

static void upset_it_goes_blind_and_silent_until_set_up_again(void **state)
{
    (void)state;
    uint8_t report[HID_REPORT_MOST];
    switch_camera_on("\x03");
    send("\x12\x04\x33", 3);
    wiimote_upset(device);
    assert_int_equal(next(report), 7);
    assert_int_equal(report[0], 0x20);
    assert_int_equal(after(10 * MS, report), -EAGAIN);
    send("\x12\x04\x33", 3);
    assert_int_equal(after(10 * MS, report), 18);
    assert_memory_equal(report + 6, "\xFF\xFF\xFF", 3);
    switch_camera_on("\x03");
    after(10 * MS, report);
    assert_true(report[6] != 0xFF || report[7] != 0xFF);
}

#define WITH(test) cmocka_unit_test_setup_teardown(test, fresh, gone)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH(the_camera_is_blind_until_initialised),
        WITH(registers_refuse_while_the_camera_is_off),
        WITH(switching_asks_for_an_acknowledgement_when_told),
        WITH(registers_read_back),
        WITH(markers_appear_where_a_pinhole_of_42_degrees_puts_them),
        WITH(the_basic_format_carries_the_same_places),
        WITH(the_full_format_comes_in_two_halves_with_boxes_and_brightness),
        WITH(the_full_format_spreads_the_acceleration_over_both_halves),
        WITH(a_fourth_marker_is_the_fourth_blob),
        WITH(the_wrong_camera_mode_gives_no_points),
        WITH(what_is_behind_or_outside_is_not_seen),
        WITH(a_hundred_reports_come_in_a_second),
        WITH(a_status_request_is_answered),
        WITH(upset_it_goes_blind_and_silent_until_set_up_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
