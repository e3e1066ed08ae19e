// SPDX-License-Identifier: Apache-2.0
// boothd measures with an emulated spotread, beside the emulated PR-655 that
// looks at the same place.
#include "tests/fakes/support.h"

#include <poll.h>

#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

// 0.1 % common noise of either, five sigma of the difference; slits of 5, 8 and
// 10 nm make more of narrow primaries.
static const double NEAR = 0.008, BROADLY = 0.03;
enum { MEASURE_S = 5, LINE_MS = 10000 };

static struct booth_here here;
static struct control_client *daemon_client, *booth_client;

static int open_with(const char *scenario, const char *arguments)
{
    char all[512];
    snprintf(all, sizeof all,
             "--set radiometer.driver=spotread --set radiometer.program=$run/spotread"
             " --set tracker.driver=none --set spectrometer.driver=none"
             " --set accelerometer.driver=none %s",
             arguments);
    if (!booth_open(&here, scenario, all))
        return -1;
    daemon_client = connect_to(folder_at(&here.folder, "run/boothd.sock"), here.booth);
    booth_client = connect_to(folder_at(&here.folder, "run/boothsim.sock"), here.booth);
    json_t *reply =
        control_call(daemon_client, json_pack("{ss,s[fff]}", "do", "patch", "rgb", 0.8, 0.7, 0.6),
                     BOOTH_CALL_MS, NULL);
    json_decref(reply);
    return reply && booth_client ? 0 : -1;
}

static int open_specbos(void **state)
{
    (void)state;
    return open_with("", "");
}

static int open_i1pro(void **state)
{
    (void)state;
    return open_with("[spotread]\nmodel = i1pro\n", "--set radiometer.calibrate=yes");
}

static int open_i1d3(void **state)
{
    (void)state;
    return open_with("[spotread]\nmodel = i1d3\n", "");
}

static int leave(void **state)
{
    (void)state;
    control_close(daemon_client);
    control_close(booth_client);
    return booth_close(&here);
}

static json_t *ask_to_measure(struct error *err)
{
    return control_call(daemon_client,
                        json_pack("{ss,si}", "do", "measure", "timeout_s", MEASURE_S),
                        BOOTH_CALL_MS, err);
}

static bool measure(double xyz[3], struct error *err)
{
    json_t *reply = ask_to_measure(err);
    const json_t *values = json_object_get(reply, "XYZ");
    for (size_t i = 0; i < 3; i++)
        xyz[i] = json_number_value(json_array_get(values, i));
    json_decref(reply);
    return reply;
}

static void tell(int fd, const char *command, const char *end, char *text, size_t most)
{
    size_t size = 0;
    struct pollfd wait = {.fd = fd, .events = POLLIN};
    assert_int_equal(write(fd, command, strlen(command)), (ssize_t)strlen(command));
    for (text[0] = 0; size < most - 1 && !strstr(text, end) && poll(&wait, 1, LINE_MS) > 0;) {
        ssize_t got = read(fd, text + size, most - 1 - size);
        size += got > 0 ? (size_t)got : 0;
        text[size] = 0;
    }
}

// "M2" over the serial line of the PR-655, as its manual has it.
static void measure_with_pr655(double xyz[3])
{
    char text[256];
    int units, fd = open(folder_at(&here.folder, "run/radiometer"), O_RDWR | O_NOCTTY);
    assert_true(fd >= 0);
    tell(fd, "PHOTO\r", "REMOTE MODE\r\n", text, sizeof text);
    tell(fd, "M2\r", "\r\n", text, sizeof text);
    close(fd);
    assert_int_equal(sscanf(text, "00000,%d,%lf,%lf,%lf", &units, &xyz[0], &xyz[1], &xyz[2]), 4);
}

static void expect_what_the_pr655_sees(double tolerance)
{
    double ours[3], theirs[3];
    struct error err = {0};
    if (!measure(ours, &err))
        print_error("%s\n", err.text);
    measure_with_pr655(theirs);
    print_message("%.2f %.2f %.2f, PR-655: %.2f %.2f %.2f cd/m2\n", ours[0], ours[1], ours[2],
                  theirs[0], theirs[1], theirs[2]);
    assert_true(ours[1] > 50);
    for (int i = 0; i < 3; i++)
        assert_near(ours[i] / theirs[i], 1, tolerance);
}

static void it_measures_what_the_pr655_does(void **state)
{
    (void)state;
    expect_what_the_pr655_sees(NEAR);
}

static void another_one_does_broadly(void **state)
{
    (void)state;
    expect_what_the_pr655_sees(BROADLY);
}

static void await_a_reading(void)
{
    double xyz[3];
    struct error err = {0};
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    while (!measure(xyz, &err)) {
        if (clock_now_ns() > until_ns)
            print_error("%s\n", err.text);
        assert_true(clock_now_ns() < until_ns);
        clock_sleep_until_ns(clock_now_ns() + 100 * NS_PER_MS);
    }
}

// Each reading fails with its cause; after the fault has gone the next one works.
static void fails_and_recovers(const char *kind, const char *cause)
{
    double xyz[3];
    struct error err = {0};
    assert_true(booth_fault(booth_client, "spotread", kind));
    for (int i = 0; i < 2; i++) {
        assert_false(measure(xyz, &err));
        if (!strstr(err.text, cause))
            print_error("%s: %s\n", kind, err.text);
        assert_non_null(strstr(err.text, cause));
    }
    assert_true(booth_fault(booth_client, "spotread", "fine"));
}

static void too_little_and_too_much_light_are_named_and_the_next_reading_works(void **state)
{
    (void)state;
    fails_and_recovers("weak-light", "Underexposure");
    expect_what_the_pr655_sees(NEAR);
    fails_and_recovers("overload", "Overexposure");
    expect_what_the_pr655_sees(NEAR);
}

static void a_misread_is_named_and_the_next_reading_works(void **state)
{
    (void)state;
    double xyz[3];
    int failed = 0;
    struct error err = {0};
    assert_true(booth_fault(booth_client, "spotread", "misread"));
    for (int i = 0; i < 9; i++) // every third is false: by turns too high, failed, far too high
        if (!measure(xyz, &err)) {
            assert_non_null(strstr(err.text, "misread"));
            failed++;
        }
    assert_int_equal(failed, 1);
    assert_true(booth_fault(booth_client, "spotread", "fine"));
    expect_what_the_pr655_sees(NEAR);
}

static void a_pulled_cable_is_named_and_spotread_is_started_again(void **state)
{
    (void)state;
    double xyz[3];
    struct error err = {0};
    assert_true(booth_fault(booth_client, "spotread", "unplugged"));
    assert_false(measure(xyz, &err));
    assert_non_null(strstr(err.text, "communication problem"));
    assert_false(measure(xyz, &err)); // started without its instrument
    assert_non_null(strstr(err.text, "spotread"));
    assert_null(strstr(err.text, "says nothing"));
    assert_true(booth_fault(booth_client, "spotread", "fine"));
    await_a_reading();
    expect_what_the_pr655_sees(NEAR);
}

static void a_silent_one_is_waited_for_until_it_speaks(void **state)
{
    (void)state;
    double xyz[3];
    struct error err = {0};
    assert_true(booth_fault(booth_client, "spotread", "silent"));
    assert_false(measure(xyz, &err));
    assert_true(booth_fault(booth_client, "spotread", "fine"));
    await_a_reading();
    expect_what_the_pr655_sees(NEAR);
}

static void a_fatal_error_ends_the_reading_and_spotread_is_started_again(void **state)
{
    (void)state;
    fails_and_recovers("stall", "fatal error");
    await_a_reading();
    expect_what_the_pr655_sees(NEAR);
}

static void a_colorimeter_measures_without_a_spectrum(void **state)
{
    (void)state;
    struct error err = {0};
    json_t *reply = ask_to_measure(&err);
    if (!reply)
        print_error("%s\n", err.text);
    assert_non_null(reply);
    assert_int_equal(json_array_size(json_object_get(reply, "values")), 0);
    assert_non_null(strstr(dig_text(reply, "instrument"), "(no spectra)"));
    json_decref(reply);
    expect_what_the_pr655_sees(BROADLY);
}

static void a_colorimeter_that_was_away_measures_again(void **state)
{
    (void)state;
    double xyz[3];
    struct error err = {0};
    assert_true(booth_fault(booth_client, "spotread", "unplugged"));
    assert_false(measure(xyz, &err));
    assert_non_null(strstr(err.text, "communication problem"));
    assert_true(booth_fault(booth_client, "spotread", "fine"));
    await_a_reading();
    expect_what_the_pr655_sees(BROADLY);
}

int main(void)
{
    const struct CMUnitTest specbos[] = {
        cmocka_unit_test(it_measures_what_the_pr655_does),
        cmocka_unit_test(too_little_and_too_much_light_are_named_and_the_next_reading_works),
        cmocka_unit_test(a_misread_is_named_and_the_next_reading_works),
        cmocka_unit_test(a_pulled_cable_is_named_and_spotread_is_started_again),
        cmocka_unit_test(a_silent_one_is_waited_for_until_it_speaks),
        cmocka_unit_test(a_fatal_error_ends_the_reading_and_spotread_is_started_again),
    };
    const struct CMUnitTest i1pro[] = {
        cmocka_unit_test(another_one_does_broadly),
    };
    const struct CMUnitTest i1d3[] = {
        cmocka_unit_test(a_colorimeter_measures_without_a_spectrum),
        cmocka_unit_test(a_colorimeter_that_was_away_measures_again),
    };
    return cmocka_run_group_tests(specbos, open_specbos, leave) +
           cmocka_run_group_tests(i1pro, open_i1pro, leave) +
           cmocka_run_group_tests(i1d3, open_i1d3, leave);
}
