// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/pr655.h"
#include "drivers/udev.h"

#include <cmocka.h>

#include "tests/fakes/near.h"
#include "tests/fakes/pty.h"

static const double arithmetic = 1e-9;
static const double sent_digits = 2e-4; // relative: %.3e on the wire, interpolation of a slope
// PHOTO, D110 and D111 with their ends, 10 ms after each character.
enum { BUDGET_MS = 4000, OPENING_MS = 4000, OPENING_CHARACTERS = 16, LEAST_GAP_MS = 9 };

static const struct radiometer_driver *driver(void)
{
    return radiometer_drivers[0];
}

static void a_status_begins_every_reply(void **state)
{
    (void)state;
    int status;
    const char *rest;
    assert_true(pr655_status("00000,0,1.865e+01,0.4035,0.4202", &status, &rest));
    assert_int_equal(status, 0);
    assert_string_equal(rest, "0,1.865e+01,0.4035,0.4202");
    assert_true(pr655_status("-0008", &status, &rest));
    assert_int_equal(status, -8);
    assert_string_equal(rest, "");
    assert_false(pr655_status("REMOTE MODE", &status, &rest));
    assert_false(pr655_status("", &status, &rest));
    assert_false(pr655_status("12.5,1", &status, &rest));
}

static void a_status_names_its_remedy(void **state)
{
    (void)state;
    const struct {
        int status;
        enum error_code code;
        const char *text;
    } rows[] = {{-1, ERROR_RETRY, "-1"},        {-2, ERROR_RANGE, "overload"},
                {-8, ERROR_RETRY, "weak"},      {-12, ERROR_RETRY, "timed out"},
                {-1000, ERROR_DATA, "illegal"}, {-7, ERROR_RETRY, "-7"},
                {-1035, ERROR_DATA, "-1035"}};
    struct error err = {0};
    assert_true(pr655_check(0, &err));
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        assert_false(pr655_check(rows[i].status, &err));
        assert_int_equal(err.code, rows[i].code);
        assert_non_null(strstr(err.text, rows[i].text));
    }
}

static void a_point_is_two_numbers_and_nothing_else(void **state)
{
    (void)state;
    double nm, value;
    assert_true(pr655_point("380,1.234e-05", &nm, &value));
    assert_near(nm, 380, 0);
    assert_near(value, 1.234e-05, arithmetic);
    assert_true(pr655_point("0780.0, -1e-7 ", &nm, &value));
    const char *const not_points[] = {
        "00000,0", "00000,0,560,1.2,3.4", "380", "380,", "380,abc", "380,1,2", "", "nm,W"};
    for (size_t i = 0; i < sizeof not_points / sizeof *not_points; i++)
        assert_false(pr655_point(not_points[i], &nm, &value));
}

static void xyz_comes_in_si_units_or_not_at_all(void **state)
{
    (void)state;
    struct xyz xyz;
    struct error err = {0};
    assert_true(pr655_xyz("0,9.505e+01,1.000e+02,1.089e+02", &xyz, &err));
    assert_near(xyz.Y, 100, arithmetic);
    assert_false(pr655_xyz("1,9.505e+01,1.000e+02,1.089e+02", &xyz, &err));
    assert_non_null(strstr(err.text, "SI"));
    assert_false(pr655_xyz("0,1,2", &xyz, &err));
    assert_false(pr655_xyz("", &xyz, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

static void a_spectrum_is_checked_by_its_content(void **state)
{
    (void)state;
    double nm[101];
    struct error err = {0};
    for (int i = 0; i < 101; i++)
        nm[i] = 380 + 4 * i;
    assert_true(pr655_spectrum_check(nm, 101, true, &err));
    assert_true(pr655_spectrum_check(nm, 60, false, &err));
    assert_false(pr655_spectrum_check(nm, 60, true, &err));
    assert_false(pr655_spectrum_check(nm, 0, true, &err));
    nm[50] += 4;
    assert_false(pr655_spectrum_check(nm, 101, true, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

// What the far end does. One letter of mood per measurement: '.' good,
// 'w' weak light, 'o' overload, 's' silence, 'c' cut short, 'j' junk, 'm' misread.
struct peer {
    const char *moods;
    int step_nm;       // 4 as PR-655, 2 as PR-670
    bool header_apart; // status on a line of its own
    int measured, commands, left_remote, remote;
    double misread;
    double scale;  // of the radiance, grows with each measurement
    double growth; // from the second one on; 0 = 1
};

static void say(struct pty *pty, const char *text)
{
    pty_write(pty, text, (int)strlen(text));
}

static double radiance_at(double nm)
{
    return 1e-3 * (1 + (nm - 380) / 400);
}

static void send_spectrum(struct pty *pty, const struct peer *peer, bool cut)
{
    char text[64];
    say(pty,
        peer->header_apart ? "00000\r\n0,560,1.2e-1,3.4e17\r\n" : "00000,0,560,1.2e-1,3.4e17\r\n");
    for (int nm = 380; nm <= (cut ? 500 : 780); nm += peer->step_nm) {
        snprintf(text, sizeof text, "%d,%.5e\r\n", nm, peer->scale * radiance_at(nm));
        say(pty, text);
    }
}

static void measure(struct pty *pty, struct peer *peer)
{
    char mood = peer->measured < (int)strlen(peer->moods) ? peer->moods[peer->measured] : '.';
    peer->measured++;
    peer->scale += peer->growth > 0 && peer->measured > 1 ? peer->growth : 1;
    peer->misread = mood == 'm' ? 1.1 : 1;
    if (mood == 'w')
        say(pty, "-0008\r\n");
    else if (mood == 'o')
        say(pty, "-0002\r\n");
    else if (mood == 'j')
        say(pty, "\x03\x7f~~\r\n");
    else if (mood != 's')
        send_spectrum(pty, peer, mood == 'c');
}

static void answer(struct pty *pty, struct peer *peer, const char *command)
{
    char text[96];
    peer->commands++;
    if (!strcmp(command, "PHOTO")) {
        peer->remote = 1;
        say(pty, "REMOTE MODE\r\n");
    } else if (!peer->remote) {
        return;
    } else if (!strcmp(command, "Q")) {
        peer->left_remote++;
    } else if (!strcmp(command, "D110")) {
        say(pty, "00000,EMU65512345\r\n");
    } else if (!strcmp(command, "D111")) {
        say(pty, peer->step_nm == 4 ? "00000,PR-655\r\n" : "00000,PR-670\r\n");
    } else if (!strcmp(command, "M5")) {
        measure(pty, peer);
    } else if (!strcmp(command, "D2")) {
        double scale = peer->scale * peer->misread;
        snprintf(text, sizeof text, "00000,0,%.3e,%.3e,%.3e\r\n", 90 * scale, 100 * scale,
                 80 * scale);
        say(pty, text);
    } else {
        say(pty, "-1000\r\n");
    }
}

static void play(struct pty *pty, void *context)
{
    struct peer *peer = context;
    char command[32];
    size_t used = 0;
    while (!pty->stop) {
        int byte = pty_byte(pty);
        if (byte < 0)
            continue;
        if (byte != '\r') {
            command[used < sizeof command - 1 ? used++ : used] = (char)byte;
            continue;
        }
        command[used] = 0;
        used = 0;
        answer(pty, peer, command);
    }
}

static struct radiometer *open_at(const char *port, int average, struct error *err)
{
    struct radiometer_options options;
    memset(&options, 0, sizeof options);
    settings_preset(radiometer_settings, &options);
    snprintf(options.port, sizeof options.port, "%s", port);
    options.average = average;
    return driver()->open(&options, clock_now_ns() + OPENING_MS * NS_PER_MS, err);
}

static int64_t soon(void)
{
    return clock_now_ns() + BUDGET_MS * NS_PER_MS;
}

static void a_measurement_gives_spectrum_and_xyz(void **state)
{
    (void)state;
    for (int step = 2; step <= 4; step += 2) {
        struct peer peer = {.moods = "", .step_nm = step, .header_apart = step == 2};
        struct pty pty;
        struct error err = {0};
        struct radiance_sample s;
        struct instrument_identity who;
        assert_true(pty_start(&pty, play, &peer));
        struct radiometer *r = open_at(pty.path, 1, &err);
        assert_string_equal(err.text, "");
        assert_non_null(r);
        driver()->identify(r, &who);
        assert_string_equal(who.model, step == 4 ? "PR-655" : "PR-670");
        assert_string_equal(who.serial, "EMU65512345");
        assert_true(who.emulated);
        assert_true(driver()->read(r, soon(), &s, &err));
        assert_int_equal(s.count, 400 / step + 1);
        assert_near(s.first_nm, 380, 0);
        assert_near(s.step_nm, step, 0);
        assert_near(s.xyz.Y, 100, arithmetic);
        assert_near(s.raw[s.count - 1], radiance_at(780), sent_digits * radiance_at(780));
        assert_near(s.radiance.v[601 - 360], radiance_at(601), sent_digits * radiance_at(601));
        assert_true(s.taken.latest_ns > s.taken.earliest_ns);
        driver()->close(r);
        pty_stop(&pty);
        assert_int_equal(peer.left_remote, 1);
    }
}

static void averaging_takes_the_mean_of_several_measurements(void **state)
{
    (void)state;
    struct peer peer = {.moods = "", .step_nm = 4, .growth = 0.02};
    struct pty pty;
    struct error err = {0};
    struct radiance_sample s;
    assert_true(pty_start(&pty, play, &peer));
    struct radiometer *r = open_at(pty.path, 3, &err);
    assert_non_null(r);
    bool ok = driver()->read(r, soon(), &s, &err);
    assert_string_equal(err.text, "");
    assert_true(ok);
    assert_int_equal(peer.measured, 3);
    assert_near(s.xyz.Y, 102, arithmetic);
    assert_near(s.raw[0], 1.02 * radiance_at(380), sent_digits * radiance_at(380));
    driver()->close(r);
    pty_stop(&pty);
}

static void measurements_that_do_not_agree_make_no_sample(void **state)
{
    (void)state;
    struct peer peer = {.moods = ".m", .step_nm = 4, .growth = 0.02};
    struct pty pty;
    struct error err = {0};
    struct radiance_sample s;
    assert_true(pty_start(&pty, play, &peer));
    struct radiometer *r = open_at(pty.path, 2, &err);
    assert_non_null(r);
    assert_false(driver()->read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_non_null(strstr(err.text, "2 readings of 100 to 112.2 cd/m2 do not agree"));
    assert_true(driver()->read(r, soon(), &s, &err));
    assert_near(s.xyz.Y, 105, arithmetic);
    driver()->close(r);
    pty_stop(&pty);
}

static void the_least_light_may_scatter_more(void **state)
{
    (void)state;
    assert_true(radiometer_agree((double[]){0.08, 0.1}, 2, NULL));
    assert_false(radiometer_agree((double[]){0.8, 1.0}, 2, NULL));
    assert_true(radiometer_agree((double[]){0.98, 1.02, 1}, 3, NULL));
    assert_true(radiometer_agree((double[]){-0.01}, 1, NULL));
}

static void after_every_mishap_the_next_measurement_is_good(void **state)
{
    (void)state;
    const struct {
        const char *mood;
        enum error_code code;
    } rows[] = {{"w", ERROR_RETRY}, {"o", ERROR_RANGE}, {"c", ERROR_RETRY}, {"j", ERROR_DATA}};
    for (int i = 0; i < 4; i++) {
        struct peer peer = {.moods = rows[i].mood, .step_nm = 4};
        struct pty pty;
        struct error err = {0};
        struct radiance_sample s;
        assert_true(pty_start(&pty, play, &peer));
        struct radiometer *r = open_at(pty.path, 1, &err);
        assert_string_equal(err.text, "");
        assert_non_null(r);
        assert_false(driver()->read(r, soon(), &s, &err));
        assert_int_equal(err.code, rows[i].code);
        assert_true(driver()->read(r, soon(), &s, &err));
        assert_near(s.xyz.Y, 200, arithmetic);
        driver()->close(r);
        pty_stop(&pty);
    }
}

static void silence_ends_at_the_deadline(void **state)
{
    (void)state;
    struct peer peer = {.moods = "s", .step_nm = 4};
    struct pty pty;
    struct error err = {0};
    struct radiance_sample s;
    assert_true(pty_start(&pty, play, &peer));
    struct radiometer *r = open_at(pty.path, 1, &err);
    assert_non_null(r);
    assert_false(driver()->read(r, clock_now_ns() + 300 * NS_PER_MS, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    pty_unplug(&pty);
    assert_false(driver()->read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    driver()->close(r);
    pty_stop(&pty);
}

static void characters_are_sent_one_by_one_with_gaps(void **state)
{
    (void)state;
    struct peer peer = {.moods = "", .step_nm = 4};
    struct pty pty;
    struct error err = {0};
    assert_true(pty_start(&pty, play, &peer));
    int64_t start = clock_now_ns();
    struct radiometer *r = open_at(pty.path, 1, &err);
    assert_true(clock_now_ns() - start >= OPENING_CHARACTERS * LEAST_GAP_MS * NS_PER_MS);
    assert_non_null(r);
    driver()->close(r);
    pty_stop(&pty);
}

static void what_cannot_be_opened_says_why(void **state)
{
    (void)state;
    struct error err = {0};
    assert_null(open_at("", 1, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_null(open_at("/dev/no-such-line", 1, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_null(open_at("/dev/null", 1, &err));
    assert_int_equal(err.code, ERROR_SYSTEM);
    driver()->close(NULL);
}

// A node that root alone may open, looked at by nobody.
static void what_may_not_be_opened_names_the_udev_rules(void **state)
{
    (void)state;
    char path[] = "/tmp/boothd-test-XXXXXX";
    struct error err = {0};
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    assert_int_equal(chmod(path, 0), 0);
    bool root = geteuid() == 0;
    if (root)
        assert_int_equal(seteuid(65534), 0);
    void *opened = open_at(path, 1, &err);
    if (root)
        assert_int_equal(seteuid(0), 0);
    unlink(path);
    assert_null(opened);
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_non_null(strstr(err.text, UDEV_RULES_FILE));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_status_begins_every_reply),
        cmocka_unit_test(a_status_names_its_remedy),
        cmocka_unit_test(a_point_is_two_numbers_and_nothing_else),
        cmocka_unit_test(xyz_comes_in_si_units_or_not_at_all),
        cmocka_unit_test(a_spectrum_is_checked_by_its_content),
        cmocka_unit_test(a_measurement_gives_spectrum_and_xyz),
        cmocka_unit_test(averaging_takes_the_mean_of_several_measurements),
        cmocka_unit_test(measurements_that_do_not_agree_make_no_sample),
        cmocka_unit_test(the_least_light_may_scatter_more),
        cmocka_unit_test(after_every_mishap_the_next_measurement_is_good),
        cmocka_unit_test(silence_ends_at_the_deadline),
        cmocka_unit_test(characters_are_sent_one_by_one_with_gaps),
        cmocka_unit_test(what_cannot_be_opened_says_why),
        cmocka_unit_test(what_may_not_be_opened_names_the_udev_rules),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
