// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/clock.h"
#include "simulator/model_opentrack.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/fakes/near.h"

#define ROUNDING 1e-9
#define CM 0.3  // noise 0.05 cm, six sigma
#define DEG 0.6 // noise 0.1 degrees, six sigma

static struct rigid pose;
static struct opentrack *source;
static int64_t now_ns;
static uint8_t datagram[OPENTRACK_MOST];

static struct rigid head(void *context, int64_t at_ns)
{
    (void)context, (void)at_ns;
    return pose;
}

static void make(bool mirrored)
{
    struct opentrack_options options = {.around = {.head = head},
                                        .rate_hz = 60,
                                        .zero = {0.1, 0.2, 0.3},
                                        .mirrored = mirrored,
                                        .seed = 5};
    opentrack_destroy(source);
    source = opentrack_create(&options);
    assert_non_null(source);
}

static int fresh(void **state)
{
    (void)state;
    pose = (struct rigid){mat3_identity(), {0.115, 0.18, 0.9}};
    now_ns = NS_PER_S;
    make(true);
    return 0;
}

static int gone(void **state)
{
    (void)state;
    opentrack_destroy(source);
    source = NULL;
    return 0;
}

static int next(void)
{
    int64_t again_ns;
    int size = opentrack_out(source, now_ns, datagram, &again_ns);
    now_ns = again_ns;
    return size;
}

// Of the little-endian bytes, without relying on this machine's order.
static double value(int which)
{
    uint64_t bits = 0;
    double v;
    for (int i = 7; i >= 0; i--)
        bits = bits << 8 | datagram[8 * which + i];
    memcpy(&v, &bits, sizeof v);
    return v;
}

static void a_datagram_is_place_in_cm_then_turn_in_degrees(void **state)
{
    (void)state;
    pose.rotation = mat3_rotation(1, 0.2);
    assert_int_equal(next(), 48);
    const double expected[6] = {1.5, -2, 60, 0.2 * 180 / M_PI, 0, 0};
    for (int i = 0; i < 6; i++)
        assert_near(value(i), expected[i], i < 3 ? CM : DEG);
}

static void a_plain_picture_turns_right_and_left_round(void **state)
{
    (void)state;
    double mirrored[6];
    const double signs[6] = {-1, 1, 1, -1, 1, -1};
    pose.rotation =
        mat3_mul(mat3_rotation(1, 0.2), mat3_mul(mat3_rotation(0, 0.3), mat3_rotation(2, 0.4)));
    next();
    for (int i = 0; i < 6; i++)
        mirrored[i] = value(i);
    make(false);
    next();
    for (int i = 0; i < 6; i++)
        assert_near(value(i), signs[i] * mirrored[i], i < 3 ? 2 * CM : 2 * DEG);
}

// The bytes that opentrack's own source makes of these values.
static void a_published_pose_has_its_published_bytes(void **state)
{
    (void)state;
    const double values[] = {1.5, -2, 60, 10, -5, 0.5};
    const uint8_t last_two[6][2] = {{0xf8, 0x3f}, {0x00, 0xc0}, {0x4e, 0x40},
                                    {0x24, 0x40}, {0x14, 0xc0}, {0xe0, 0x3f}};
    uint8_t expected[48] = {0};
    for (int i = 0; i < 6; i++)
        memcpy(expected + 8 * i + 6, last_two[i], 2);
    opentrack_bytes(values, datagram);
    assert_memory_equal(datagram, expected, sizeof expected);
}

static void left_up_and_left_ear_up_are_positive(void **state)
{
    (void)state;
    struct mat3 left = mat3_rotation(1, 0.3), up = mat3_rotation(0, 0.2);
    struct mat3 ear_up = mat3_rotation(2, -0.1);
    assert_near(opentrack_angles(&left).yaw_deg, 0.3 * 180 / M_PI, ROUNDING);
    assert_near(opentrack_angles(&up).pitch_deg, 0.2 * 180 / M_PI, ROUNDING);
    assert_near(opentrack_angles(&ear_up).roll_deg, 0.1 * 180 / M_PI, ROUNDING);
}

static void angles_make_the_rotation_again(void **state)
{
    (void)state;
    struct mat3 turn =
        mat3_mul(mat3_rotation(1, -0.7), mat3_mul(mat3_rotation(0, 0.4), mat3_rotation(2, 0.3)));
    struct opentrack_angles a = opentrack_angles(&turn);
    assert_near(a.yaw_deg, -0.7 * 180 / M_PI, ROUNDING);
    assert_near(a.pitch_deg, 0.4 * 180 / M_PI, ROUNDING);
    assert_near(a.roll_deg, -0.3 * 180 / M_PI, ROUNDING);
}

static void they_come_at_its_rate(void **state)
{
    (void)state;
    int64_t again_ns, from_ns = now_ns;
    for (int i = 0; i < 60; i++) {
        assert_int_equal(next(), 48);
        assert_int_equal(opentrack_out(source, now_ns - 1, datagram, &again_ns), -EAGAIN);
        assert_int_equal(again_ns, now_ns);
    }
    assert_near((double)(now_ns - from_ns) / NS_PER_S, 1, 1e-6); // periods in whole ns
}

static void what_was_missed_is_not_made_up_for(void **state)
{
    (void)state;
    int64_t again_ns;
    next();
    now_ns += 10 * NS_PER_S;
    assert_int_equal(opentrack_out(source, now_ns, datagram, &again_ns), 48);
    assert_true(again_ns > now_ns);
    assert_int_equal(opentrack_out(source, now_ns, datagram, &again_ns), -EAGAIN);
}

static void every_upset_is_what_it_says(void **state)
{
    (void)state;
    const int sizes[] = {0, 47, 49, 96};
    opentrack_upset(source, OPENTRACK_NOT_A_NUMBER);
    for (int i = 0; i < 6; i++) {
        assert_int_equal(next(), 48);
        for (int k = 0; k < 6; k++)
            assert_int_equal(isfinite(value(k)) != 0, k != i);
    }
    opentrack_upset(source, OPENTRACK_OUT_OF_RANGE);
    for (int i = 0; i < 6; i++) {
        assert_int_equal(next(), 48);
        assert_true(fabs(value(i)) >= 1e5);
    }
    opentrack_upset(source, OPENTRACK_WRONG_SIZE);
    for (int i = 0; i < 8; i++)
        assert_int_equal(next(), sizes[i % 4]);
    opentrack_upset(source, OPENTRACK_WELL);
    assert_int_equal(next(), 48);
    assert_near(value(2), 60, CM);
}

static void frozen_it_repeats_the_last_one_while_the_head_moves(void **state)
{
    (void)state;
    uint8_t before[48];
    next();
    memcpy(before, datagram, sizeof before);
    opentrack_upset(source, OPENTRACK_FROZEN);
    pose.translation.x += 0.5;
    for (int i = 0; i < 5; i++) {
        assert_int_equal(next(), 48);
        assert_memory_equal(datagram, before, sizeof before);
    }
    opentrack_upset(source, OPENTRACK_WELL);
    next();
    assert_near(value(0), 51.5, CM);
}

#define WITH(test) cmocka_unit_test_setup_teardown(test, fresh, gone)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH(a_datagram_is_place_in_cm_then_turn_in_degrees),
        WITH(a_plain_picture_turns_right_and_left_round),
        WITH(a_published_pose_has_its_published_bytes),
        WITH(left_up_and_left_ear_up_are_positive),
        WITH(angles_make_the_rotation_again),
        WITH(they_come_at_its_rate),
        WITH(what_was_missed_is_not_made_up_for),
        WITH(every_upset_is_what_it_says),
        WITH(frozen_it_repeats_the_last_one_while_the_head_moves),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
