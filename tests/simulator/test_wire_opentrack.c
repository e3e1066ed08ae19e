// SPDX-License-Identifier: Apache-2.0
// opentrack's datagrams as any program receives them. Runs itself again under
// umockdev-wrapper.
#include <arpa/inet.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>

#include "base/error.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/simulator/wire_here.h"

#define CM 0.3          // noise 0.05 cm, six sigma
#define LOOKS 400       // times SILENCE_MS bounds a hang
#define UNTIL_SEEN 4000 // datagrams: some are from before the fault

static int listener;
static _Atomic double place_m = 0.1;

static struct rigid head(void *context, int64_t at_ns)
{
    (void)context, (void)at_ns;
    return (struct rigid){mat3_identity(), {place_m, 0, 0.6}};
}

static int start_here(void **state)
{
    (void)state;
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof(at);
    listener = socket(AF_INET, SOCK_DGRAM, 0);
    assert_int_equal(bind(listener, (struct sockaddr *)&at, sizeof(at)), 0);
    assert_int_equal(getsockname(listener, (struct sockaddr *)&at, &size), 0);
    struct wire_options options = usual();
    options.around.head = head;
    options.opentrack_port = ntohs(at.sin_port);
    options.opentrack_rate_hz = 200;
    options.opentrack_mirrored = true;
    return start_with(&options);
}

static int stop_here(void **state)
{
    close(listener);
    return stop(state);
}

// Size of the next datagram, or -1 when none comes.
static int receive_within(unsigned char bytes[128], int timeout_ms)
{
    struct pollfd wait = {.fd = listener, .events = POLLIN};
    if (poll(&wait, 1, timeout_ms) <= 0)
        return -1;
    return (int)recv(listener, bytes, 128, 0);
}

static double value(const unsigned char *bytes, int which)
{
    double v;
    memcpy(&v, bytes + 8 * which, sizeof(v)); // tests run on little-endian machines
    return v;
}

static void a_pose_arrives_again_and_again(void **state)
{
    (void)state;
    unsigned char bytes[128];
    for (int i = 0; i < 5; i++) {
        assert_int_equal(receive_within(bytes, REPLY_MS), 48);
        assert_true(fabs(value(bytes, 0) - 10) < CM);
        assert_true(fabs(value(bytes, 2) - 60) < CM);
    }
}

static bool has_no_number(const unsigned char *bytes, int size)
{
    for (int i = 0; size == 48 && i < 6; i++)
        if (!isfinite(value(bytes, i)))
            return true;
    return false;
}

static bool is_impossible(const unsigned char *bytes, int size)
{
    return size == 48 && fabs(value(bytes, 0)) > 1e5;
}

static bool is_of_another_size(const unsigned char *bytes, int size)
{
    (void)bytes;
    return size != 48;
}

static bool is_half(const unsigned char *bytes, int size)
{
    (void)bytes;
    return size == 24;
}

static bool is_well(const unsigned char *bytes, int size)
{
    return size == 48 && fabs(value(bytes, 0) - 10) < CM && fabs(value(bytes, 2) - 60) < CM;
}

static void expect(bool (*shows)(const unsigned char *, int))
{
    unsigned char bytes[128];
    for (int i = 0; i < UNTIL_SEEN; i++) {
        int size = receive_within(bytes, REPLY_MS);
        assert_true(size >= 0);
        if (shows(bytes, size))
            return;
    }
    fail_msg("never seen");
}

static void its_faults_show_and_pass(void **state)
{
    (void)state;
    const struct {
        enum wire_fault fault;
        bool (*shows)(const unsigned char *, int);
    } rows[] = {{WIRE_NOT_A_NUMBER, has_no_number},
                {WIRE_OUT_OF_RANGE, is_impossible},
                {WIRE_WRONG_SIZE, is_of_another_size},
                {WIRE_SHORT, is_half}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        set_fault(WIRE_OPENTRACK, rows[i].fault);
        expect(rows[i].shows);
        set_fault(WIRE_OPENTRACK, WIRE_FINE);
        expect(is_well);
    }
}

static void silent_it_sends_nothing(void **state)
{
    (void)state;
    unsigned char bytes[128];
    bool silent = false;
    set_fault(WIRE_OPENTRACK, WIRE_SILENT);
    for (int i = 0; i < LOOKS && !silent; i++)
        silent = receive_within(bytes, SILENCE_MS) < 0;
    assert_true(silent);
    set_fault(WIRE_OPENTRACK, WIRE_FINE);
    expect(is_well);
}

static void frozen_it_does_not_follow_the_head(void **state)
{
    (void)state;
    unsigned char before[128], bytes[128];
    expect(is_well);
    set_fault(WIRE_OPENTRACK, WIRE_FROZEN);
    place_m = 0.3;
    receive_within(before, REPLY_MS);
    int same = 0;
    for (int i = 0; i < 100 && same < 5; i++) { // the first may be from before
        receive_within(bytes, REPLY_MS);
        same = memcmp(bytes, before, 48) ? 0 : same + 1;
        memcpy(before, bytes, 48);
    }
    assert_int_equal(same, 5);
    assert_true(fabs(value(bytes, 0) - 10) < CM);
    set_fault(WIRE_OPENTRACK, WIRE_FINE);
    place_m = 0.1;
    expect(is_well);
}

static void a_flood_repeats_each_many_times(void **state)
{
    (void)state;
    unsigned char before[128], bytes[128];
    set_fault(WIRE_OPENTRACK, WIRE_FLOOD);
    int same = 0;
    for (int i = 0; i < UNTIL_SEEN && same < 20; i++) {
        receive_within(bytes, REPLY_MS);
        same = memcmp(bytes, before, 48) ? 0 : same + 1;
        memcpy(before, bytes, 48);
    }
    assert_int_equal(same, 20);
    set_fault(WIRE_OPENTRACK, WIRE_FINE);
}

static void faults_of_other_wires_are_not_its_own(void **state)
{
    (void)state;
    assert_true(wire_fault_suits(WIRE_OPENTRACK, WIRE_FROZEN));
    assert_false(wire_fault_suits(WIRE_OPENTRACK, WIRE_STALL));
    assert_false(wire_fault_suits(WIRE_CAMERA, WIRE_FROZEN));
}

int main(int argc, char **argv)
{
    (void)argc;
    if (under_umockdev(argv[0]))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pose_arrives_again_and_again),
        cmocka_unit_test(its_faults_show_and_pass),
        cmocka_unit_test(silent_it_sends_nothing),
        cmocka_unit_test(frozen_it_does_not_follow_the_head),
        cmocka_unit_test(a_flood_repeats_each_many_times),
        cmocka_unit_test(faults_of_other_wires_are_not_its_own),
    };
    return cmocka_run_group_tests(tests, start_here, stop_here);
}
