// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/opentrack.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static const double arithmetic = 1e-12;
enum { BUDGET_MS = 2000, SHORT_MS = 60 };

static const uint8_t published[48] = {
    0, 0, 0, 0, 0, 0, 0xf8, 0x3f, 0, 0, 0, 0, 0, 0, 0x00, 0xc0, 0, 0, 0, 0, 0, 0, 0x4e, 0x40,
    0, 0, 0, 0, 0, 0, 0x24, 0x40, 0, 0, 0, 0, 0, 0, 0x14, 0xc0, 0, 0, 0, 0, 0, 0, 0xe0, 0x3f,
};

static struct tracker_options preset(void)
{
    struct tracker_options options;
    memset(&options, 0, sizeof options);
    settings_preset(tracker_settings, &options);
    return options;
}

// Those whose directions opentrack.md gives, without signs.
static struct tracker_options unsigned_preset(void)
{
    struct tracker_options options = preset();
    for (int i = 0; i < OPENTRACK_AXES; i++)
        options.signs[i] = 1;
    return options;
}

static void pack(const double pose[6], uint8_t bytes[48])
{
    for (int i = 0; i < 6; i++) {
        uint64_t bits;
        memcpy(&bits, &pose[i], 8);
        for (int k = 0; k < 8; k++)
            bytes[8 * i + k] = (uint8_t)(bits >> 8 * k);
    }
}

static void the_published_datagram_decodes(void **state)
{
    (void)state;
    const double wanted[6] = {1.5, -2, 60, 10, -5, 0.5};
    double pose[6];
    assert_true(opentrack_decode(published, sizeof published, pose, NULL));
    for (int i = 0; i < 6; i++)
        assert_near(pose[i], wanted[i], arithmetic);
}

// Half of all random doubles are within 500, so one in 64 of such poses.
static void random_bytes_are_no_pose(void **state)
{
    (void)state;
    uint64_t seed = 1;
    int taken = 0;
    for (int i = 0; i < 100000; i++) {
        uint8_t bytes[48];
        double pose[6];
        for (int k = 0; k < 48; k++)
            bytes[k] = (uint8_t)((seed = seed * 6364136223846793005u + 1442695040888963407u) >> 56);
        taken += opentrack_decode(bytes, sizeof bytes, pose, NULL);
    }
    assert_int_equal(taken, 0);
}

static void the_residue_of_rounding_is_a_pose(void **state)
{
    (void)state;
    const double residue[6] = {0, -0.0, 60, 1e-15, -3e-17, 0};
    uint8_t bytes[48];
    double pose[6];
    pack(residue, bytes);
    assert_true(opentrack_decode(bytes, sizeof bytes, pose, NULL));
}

static void another_length_is_refused(void **state)
{
    (void)state;
    uint8_t bytes[64] = {0};
    double pose[6] = {7};
    struct error err = {0};
    for (size_t count = 0; count <= sizeof bytes; count++)
        assert_int_equal(opentrack_decode(bytes, count, pose, &err), count == 48);
    assert_int_equal(err.code, ERROR_DATA);
}

static void what_is_no_number_or_out_of_range_is_refused(void **state)
{
    (void)state;
    const double bad[] = {NAN, INFINITY, -INFINITY, 1e300, 501, -501, 1e-58, -5e-324};
    for (int axis = 0; axis < 6; axis++)
        for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
            double pose[6] = {0}, out[6];
            uint8_t bytes[48];
            struct error err = {0};
            pose[axis] = bad[i];
            pack(pose, bytes);
            assert_false(opentrack_decode(bytes, sizeof bytes, out, &err));
            assert_int_equal(err.code, ERROR_DATA);
        }
}

static void a_head_at_rest_is_where_it_says(void **state)
{
    (void)state;
    struct tracker_options o = unsigned_preset();
    struct vec3 eye = opentrack_eye(&o, (const double[]){3, -4, 60, 0, 0, 0});
    assert_near(eye.x, 0.03, arithmetic);
    assert_near(eye.y, -0.04, arithmetic);
    assert_near(eye.z, 0.60, arithmetic);
}

static void turns_carry_the_eye_left_up_and_over(void **state)
{
    (void)state;
    struct tracker_options o = unsigned_preset();
    o.eye_from_marker_m[2] = -0.1; // in front of the tracked point
    struct vec3 left = opentrack_eye(&o, (const double[]){0, 0, 0, 30, 0, 0});
    assert_near(left.x, -0.05, arithmetic);
    struct vec3 up = opentrack_eye(&o, (const double[]){0, 0, 0, 0, 30, 0});
    assert_near(up.y, 0.05, arithmetic);
    o.eye_from_marker_m[1] = 0.1;
    o.eye_from_marker_m[2] = 0;
    struct vec3 over = opentrack_eye(&o, (const double[]){0, 0, 0, 0, 0, 30});
    assert_near(over.x, -0.05, arithmetic);
}

static void origin_and_signs_are_the_users(void **state)
{
    (void)state;
    struct tracker_options o = unsigned_preset();
    o.origin_m[2] = 0.7;
    o.signs[0] = -1;
    o.signs[3] = 0;
    o.eye_from_marker_m[2] = -0.1;
    struct vec3 eye = opentrack_eye(&o, (const double[]){5, 0, 0, 90, 0, 0});
    assert_near(eye.x, -0.05, arithmetic);
    assert_near(eye.z, 0.6, arithmetic);
}

// What its own trackers send of a head, as their sources' formulas have it, from
// a camera's picture as it is and from a mirrored one.
static void the_preset_is_for_a_plain_picture(void **state)
{
    (void)state;
    const double head[OPENTRACK_AXES] = {11, -7, 60, 25, 10, 15};
    const double mirrored[OPENTRACK_AXES] = {11, -7, 60, 25, 10, -15};
    const double plain[OPENTRACK_AXES] = {-11, -7, 60, -25, 10, 15};
    struct tracker_options as_meant = unsigned_preset(), of_mirror = preset(), by_preset = preset();
    as_meant.eye_from_marker_m[0] = of_mirror.eye_from_marker_m[0] = 0.03;
    as_meant.eye_from_marker_m[1] = of_mirror.eye_from_marker_m[1] = -0.05;
    as_meant.eye_from_marker_m[2] = of_mirror.eye_from_marker_m[2] = -0.1;
    memcpy(by_preset.eye_from_marker_m, as_meant.eye_from_marker_m,
           sizeof as_meant.eye_from_marker_m);
    memcpy(of_mirror.signs, (const double[]){1, 1, 1, 1, 1, -1}, sizeof of_mirror.signs);
    struct vec3 eye = opentrack_eye(&as_meant, head);
    struct vec3 one = opentrack_eye(&by_preset, plain), other = opentrack_eye(&of_mirror, mirrored);
    assert_near(one.x, eye.x, arithmetic);
    assert_near(one.y, eye.y, arithmetic);
    assert_near(one.z, eye.z, arithmetic);
    assert_near(other.x, eye.x, arithmetic);
    assert_near(other.y, eye.y, arithmetic);
    assert_near(other.z, eye.z, arithmetic);
}

static void a_mirror_only_swaps_left_and_right(void **state)
{
    (void)state;
    const double plain[OPENTRACK_AXES] = {-11, -7, 60, -25, 10, 15};
    const double turned_round[OPENTRACK_AXES] = {11, -7, 60, 25, 10, -15};
    struct tracker_options o = preset();
    o.eye_from_marker_m[1] = -0.05;
    o.eye_from_marker_m[2] = -0.1;
    struct vec3 eye = opentrack_eye(&o, plain), seen = opentrack_eye(&o, turned_round);
    assert_near(seen.x, -eye.x, arithmetic);
    assert_near(seen.y, eye.y, arithmetic);
    assert_near(seen.z, eye.z, arithmetic);
}

// The driver at a free port, and a sender connected to it.
struct link {
    struct tracker *tracker;
    int sender;
};

static void link_open(struct link *l)
{
    struct tracker_options o = unsigned_preset();
    struct instrument_identity who;
    struct error err = {0};
    o.port = 0;
    l->tracker = opentrack_driver.open(&o, clock_now_ns() + NS_PER_S, &err);
    if (!l->tracker)
        print_error("%s\n", err.text);
    assert_non_null(l->tracker);
    opentrack_driver.identify(l->tracker, &who);
    assert_int_equal(strncmp(who.serial, "127.0.0.1:", 10), 0);
    struct sockaddr_in to = {.sin_family = AF_INET,
                             .sin_port = htons((uint16_t)atoi(who.serial + 10)),
                             .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    l->sender = socket(AF_INET, SOCK_DGRAM, 0);
    assert_int_equal(connect(l->sender, (struct sockaddr *)&to, sizeof to), 0);
}

static void link_close(struct link *l)
{
    close(l->sender);
    opentrack_driver.close(l->tracker);
}

static void send_x(struct link *l, double x_cm)
{
    uint8_t bytes[48];
    pack((const double[]){x_cm, 0, 60, 0, 0, 0}, bytes);
    assert_int_equal(send(l->sender, bytes, sizeof bytes, 0), sizeof bytes);
}

static bool read_within(struct link *l, int ms, struct head_sample *s, struct error *err)
{
    return opentrack_driver.read(l->tracker, clock_now_ns() + ms * NS_PER_MS, s, err);
}

static void of_many_datagrams_the_last_counts(void **state)
{
    (void)state;
    struct link l;
    struct head_sample s;
    link_open(&l);
    for (int i = 1; i <= 20; i++)
        send_x(&l, i);
    assert_true(read_within(&l, BUDGET_MS, &s, NULL));
    assert_near(s.eye.x, 0.20, arithmetic);
    assert_int_equal(s.status, TRACKER_SEEN);
    assert_true(s.taken.earliest_ns < s.taken.latest_ns && s.taken.latest_ns <= clock_now_ns());
    struct error err = {0};
    assert_false(read_within(&l, SHORT_MS, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    link_close(&l);
}

static void garbage_between_poses_is_passed_over(void **state)
{
    (void)state;
    struct link l;
    struct head_sample s;
    link_open(&l);
    send_x(&l, 1);
    send(l.sender, "short", 5, 0);
    send(l.sender, "", 0, 0);
    send_x(&l, NAN);
    send_x(&l, 1e9);
    uint8_t longer[49] = {0};
    send(l.sender, longer, sizeof longer, 0);
    assert_true(read_within(&l, BUDGET_MS, &s, NULL));
    assert_near(s.eye.x, 0.01, arithmetic);
    link_close(&l);
}

static void garbage_alone_is_named_and_leaves_the_sample(void **state)
{
    (void)state;
    struct link l;
    struct head_sample s = {.markers = 99};
    struct error err = {0};
    link_open(&l);
    send_x(&l, NAN);
    assert_false(read_within(&l, SHORT_MS, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_non_null(strstr(err.text, "x is"));
    assert_int_equal(s.markers, 99);
    link_close(&l);
}

static void a_pose_that_waited_too_long_is_stale(void **state)
{
    (void)state;
    struct link l;
    struct head_sample s;
    struct error err = {0};
    link_open(&l);
    send_x(&l, 1);
    usleep(400 * 1000);
    assert_false(read_within(&l, SHORT_MS, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_non_null(strstr(err.text, "old"));
    send_x(&l, 2);
    assert_true(read_within(&l, BUDGET_MS, &s, NULL));
    assert_near(s.eye.x, 0.02, arithmetic);
    link_close(&l);
}

static void a_port_in_use_and_a_wrong_address_are_named(void **state)
{
    (void)state;
    struct link l;
    struct instrument_identity who;
    struct tracker_options o = preset();
    struct error err = {0};
    link_open(&l);
    opentrack_driver.identify(l.tracker, &who);
    o.port = atoi(who.serial + 10);
    assert_null(opentrack_driver.open(&o, clock_now_ns() + NS_PER_S, &err));
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_non_null(strstr(err.text, "in use"));
    strcpy(o.address, "localhost");
    assert_null(opentrack_driver.open(&o, clock_now_ns() + NS_PER_S, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    strcpy(o.address, "192.0.2.1"); // RFC 5737: nobody's
    assert_null(opentrack_driver.open(&o, clock_now_ns() + NS_PER_S, &err));
    assert_int_equal(err.code, ERROR_GONE);
    opentrack_driver.close(NULL);
    link_close(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_published_datagram_decodes),
        cmocka_unit_test(another_length_is_refused),
        cmocka_unit_test(random_bytes_are_no_pose),
        cmocka_unit_test(the_residue_of_rounding_is_a_pose),
        cmocka_unit_test(what_is_no_number_or_out_of_range_is_refused),
        cmocka_unit_test(a_head_at_rest_is_where_it_says),
        cmocka_unit_test(turns_carry_the_eye_left_up_and_over),
        cmocka_unit_test(origin_and_signs_are_the_users),
        cmocka_unit_test(the_preset_is_for_a_plain_picture),
        cmocka_unit_test(a_mirror_only_swaps_left_and_right),
        cmocka_unit_test(of_many_datagrams_the_last_counts),
        cmocka_unit_test(garbage_between_poses_is_passed_over),
        cmocka_unit_test(garbage_alone_is_named_and_leaves_the_sample),
        cmocka_unit_test(a_pose_that_waited_too_long_is_stale),
        cmocka_unit_test(a_port_in_use_and_a_wrong_address_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
