// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "drivers/wiimote.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static const double focal_px = 1e-6; // arithmetic

static void the_published_extended_blob_decodes(void **state)
{
    (void)state;
    struct wiimote_blob b = wiimote_decode((const uint8_t[]){0x00, 0x80, 0x65});
    assert_true(b.seen);
    assert_int_equal(b.x, 512);
    assert_int_equal(b.y, 384);
    assert_int_equal(b.size, 5);
}

static void the_corners_of_the_sensor_decode(void **state)
{
    (void)state;
    struct wiimote_blob low = wiimote_decode((const uint8_t[]){0, 0, 0x02});
    struct wiimote_blob high = wiimote_decode((const uint8_t[]){0xff, 0xff, 0xb1});
    assert_true(low.seen && low.x == 0 && low.y == 0);
    assert_true(high.seen && high.x == 1023 && high.y == 767);
}

static void all_ones_are_no_blob(void **state)
{
    (void)state;
    assert_false(wiimote_decode((const uint8_t[]){0xff, 0xff, 0xff}).seen);
}

static void a_report_gives_its_four_blobs(void **state)
{
    (void)state;
    uint8_t report[18] = {0x33, 0, 0, 128, 128, 154};
    struct wiimote_frame frame = {0};
    struct error err;
    bool whole;
    memset(report + 6, 0xff, 12);
    memcpy(report + 9, (const uint8_t[]){0x00, 0x80, 0x65}, 3);
    assert_true(wiimote_report(WIIMOTE_EXTENDED, report, sizeof report, &frame, &whole, &err));
    assert_true(whole);
    for (int i = 0; i < WIIMOTE_BLOBS; i++)
        assert_int_equal(frame.blobs[i].seen, i == 1);
}

static void the_published_basic_pair_decodes(void **state)
{
    (void)state;
    struct wiimote_blob pair[2];
    wiimote_decode_basic((const uint8_t[]){0x00, 0x80, 0x6f, 0xff, 0xff}, pair);
    assert_true(pair[0].seen && pair[0].x == 512 && pair[0].y == 384);
    assert_false(pair[1].seen);
    wiimote_decode_basic((const uint8_t[]){0xff, 0xff, 0xff, 0x34, 0x12}, pair);
    assert_false(pair[0].seen || pair[1].seen); // y 0x312 lies below the sensor
    wiimote_decode_basic((const uint8_t[]){0xff, 0xff, 0xfa, 0x34, 0x12}, pair);
    assert_true(pair[1].seen && pair[1].x == 0x234 && pair[1].y == 0x212);
}

static void basic_and_full_reports_give_four_blobs(void **state)
{
    (void)state;
    uint8_t basic[22] = {0x37}, first[22] = {0x3e}, second[22] = {0x3f};
    struct wiimote_frame frame = {0};
    bool whole;
    memset(basic + 6, 0xff, 10);
    memcpy(basic + 11, (const uint8_t[]){0x00, 0x80, 0x6f}, 3);
    assert_true(wiimote_report(WIIMOTE_BASIC, basic, sizeof basic, &frame, &whole, NULL));
    for (int i = 0; i < WIIMOTE_BLOBS; i++)
        assert_int_equal(frame.blobs[i].seen, i == 2);
    memset(first + 4, 0xff, 18);
    memset(second + 4, 0xff, 18);
    memcpy(first + 13, (const uint8_t[]){0x00, 0x80, 0x65, 1, 2, 3, 4, 0, 200}, 9);
    memcpy(second + 4, (const uint8_t[]){0x10, 0x20, 0x02, 1, 2, 3, 4, 0, 200}, 9);
    memset(&frame, 0, sizeof frame);
    assert_true(wiimote_report(WIIMOTE_FULL, second, sizeof second, &frame, &whole, NULL));
    assert_false(whole); // half of a frame whose first half is not known
    assert_true(wiimote_report(WIIMOTE_FULL, first, sizeof first, &frame, &whole, NULL));
    assert_false(whole);
    assert_true(wiimote_report(WIIMOTE_FULL, second, sizeof second, &frame, &whole, NULL));
    assert_true(whole);
    assert_true(!frame.blobs[0].seen && frame.blobs[1].x == 512 && frame.blobs[1].size == 5);
    assert_true(frame.blobs[2].x == 16 && frame.blobs[2].y == 32 && !frame.blobs[3].seen);
}

static void another_report_or_a_short_one_is_refused(void **state)
{
    (void)state;
    uint8_t report[22] = {0x37};
    struct wiimote_frame frame = {0};
    struct error err = {0};
    bool whole;
    assert_false(wiimote_report(WIIMOTE_EXTENDED, report, sizeof report, &frame, &whole, &err));
    assert_int_equal(err.code, ERROR_DATA);
    report[0] = 0x33;
    assert_false(wiimote_report(WIIMOTE_EXTENDED, report, 17, &frame, &whole, &err));
    assert_false(wiimote_report(WIIMOTE_EXTENDED, report, 0, &frame, &whole, &err));
    assert_false(wiimote_report(WIIMOTE_FULL, report, sizeof report, &frame, &whole, &err));
    report[0] = 0x3f;
    assert_false(wiimote_report(WIIMOTE_FULL, report, 21, &frame, &whole, &err));
    assert_false(wiimote_report(WIIMOTE_BASIC, report, sizeof report, &frame, &whole, &err));
}

static void a_field_of_42_degrees_is_a_focal_length_of_1334_pixels(void **state)
{
    (void)state;
    assert_near(wiimote_focal_px(42), 512 / 0.38386403503541578, focal_px);
}

static void the_observers_right_is_the_cameras_left(void **state)
{
    (void)state;
    double d[2];
    wiimote_direction((struct wiimote_blob){true, 412, 484, 1}, 1000, d);
    assert_near(d[0], 0.1, 1e-12);
    assert_near(d[1], 0.1, 1e-12);
}

static void a_remote_that_is_not_there_is_gone(void **state)
{
    (void)state;
    struct tracker_options options;
    struct error err = {0};
    memset(&options, 0, sizeof options);
    settings_preset(tracker_settings, &options);
    strcpy(options.serial, "no such remote");
    assert_null(tracker_drivers[0]->open(&options, clock_now_ns() + NS_PER_S, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "no such remote"));
    tracker_drivers[0]->close(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_published_extended_blob_decodes),
        cmocka_unit_test(the_corners_of_the_sensor_decode),
        cmocka_unit_test(all_ones_are_no_blob),
        cmocka_unit_test(a_report_gives_its_four_blobs),
        cmocka_unit_test(the_published_basic_pair_decodes),
        cmocka_unit_test(basic_and_full_reports_give_four_blobs),
        cmocka_unit_test(another_report_or_a_short_one_is_refused),
        cmocka_unit_test(a_field_of_42_degrees_is_a_focal_length_of_1334_pixels),
        cmocka_unit_test(the_observers_right_is_the_cameras_left),
        cmocka_unit_test(a_remote_that_is_not_there_is_gone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
