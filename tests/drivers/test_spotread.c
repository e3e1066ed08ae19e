// SPDX-License-Identifier: Apache-2.0
// The driver above tests/fakes/spotread.sh on a real pseudo terminal.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "drivers/spotread.h"

#include <cmocka.h>

#include "tests/fakes/folder.h"
#include "tests/fakes/near.h"

static const double arithmetic = 1e-12;
enum { BUDGET_MS = 20000 }; // bounds a hang, measures nothing

static struct folder here;

static int a_folder(void **state)
{
    (void)state;
    folder_open(&here);
    return 0;
}

static int no_folder(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static int64_t soon(void)
{
    return clock_now_ns() + BUDGET_MS * NS_PER_MS;
}

static struct radiometer_options options_for(const char *how)
{
    struct radiometer_options o;
    memset(&o, 0, sizeof o);
    settings_preset(radiometer_settings, &o);
    strcpy(o.program, "tests/fakes/spotread.sh");
    snprintf(o.arguments, sizeof o.arguments, "-y l how=%s keys=%s", how, folder_at(&here, "keys"));
    unlink(folder_at(&here, "keys"));
    return o;
}

static struct radiometer *open_how(const char *how, struct error *err)
{
    struct radiometer_options o = options_for(how);
    struct radiometer *r = spotread_driver.open(&o, soon(), err);
    if (!r)
        print_error("%s\n", err->text);
    return r;
}

static const char *keys(void)
{
    static char text[64];
    FILE *in = fopen(folder_at(&here, "keys"), "r");
    size_t n = in ? fread(text, 1, sizeof text - 1, in) : 0;
    text[n] = 0;
    if (in)
        fclose(in);
    return text;
}

static void the_lines_of_spotread_are_told_apart(void **state)
{
    (void)state;
    struct xyz xyz;
    double first, last, v[8];
    int count, got = 0;
    assert_int_equal(spotread_line(" Result is XYZ: 1.0 2.0 3.0, D50 Lab: 1 2 3"), SPOTREAD_XYZ);
    assert_int_equal(spotread_line("Set instrument sensor to calibration position,"),
                     SPOTREAD_CALIBRATION);
    assert_int_equal(spotread_line("Hit ESC or Q to exit, any other key to take a reading: "),
                     SPOTREAD_READY);
    assert_int_equal(spotread_line("Hit Esc or Q to give up, any other key to retry:"),
                     SPOTREAD_RETRY);
    assert_int_equal(spotread_line("Hit any key to retry, or Esc or Q to abort:"), SPOTREAD_RETRY);
    assert_int_equal(spotread_line("Instrument initialisation failed"), SPOTREAD_FAILED);
    assert_int_equal(spotread_line("Got fatal error 'Bad' (Worse)"), SPOTREAD_FAILED);
    assert_int_equal(spotread_line("Need spectral information for custom illuminant or observer"),
                     SPOTREAD_NO_SPECTRA);
    assert_int_equal(spotread_line("Spot read failed due to misread (Underexposure)"),
                     SPOTREAD_FAILED);
    assert_int_equal(spotread_line("Setting no-initial calibrate failed with 'a' (b)"),
                     SPOTREAD_OTHER);
    assert_int_equal(
        spotread_line("Display/calibration type ignored - instrument doesn't support it"),
        SPOTREAD_OTHER);
    assert_int_equal(spotread_line("Calibration complete"), SPOTREAD_OTHER);
    assert_true(spotread_xyz(" Result is XYZ: 1.5 -0.25 3.0, Yxy: 1 2 3", &xyz));
    assert_near(xyz.Y, -0.25, arithmetic);
    assert_false(spotread_xyz(" Result is XYZ: 1.5 2.0", &xyz));
    assert_true(spotread_spectrum_head("Spectrum from 380.0 to 730.0 nm in 36 steps", &first, &last,
                                       &count));
    assert_int_equal(count, 36);
    assert_false(
        spotread_spectrum_head("Spectrum from 730 to 380 nm in 36 steps", &first, &last, &count));
    assert_true(spotread_spectrum_values("   1.000,    2.500,", v, 8, &got));
    assert_true(spotread_spectrum_values("   3.000", v, 8, &got));
    assert_int_equal(got, 3);
    assert_near(v[1], 2.5, arithmetic);
    assert_false(spotread_spectrum_values("1, two", v, 8, &got));
    got = 7;
    assert_false(spotread_spectrum_values("1, 2", v, 8, &got));
}

static void a_reading_has_xyz_and_its_spectrum_in_watts(void **state)
{
    (void)state;
    const char *const hows[] = {"fine", "after", "oldprompt"};
    for (int i = 0; i < 3; i++) {
        struct error err = {0};
        struct radiance_sample s;
        struct instrument_identity who;
        struct radiometer *r = open_how(hows[i], &err);
        assert_non_null(r);
        spotread_driver.identify(r, &who);
        assert_string_equal(who.model, "i1 Pro");
        assert_string_equal(who.serial, "EMU12345");
        assert_string_equal(who.firmware, "502");
        assert_true(who.emulated);
        if (!spotread_driver.read(r, soon(), &s, &err))
            print_error("%s\n", err.text);
        assert_int_equal(err.code, ERROR_NONE);
        assert_near(s.xyz.Y, 85.5, arithmetic);
        assert_int_equal(s.count, 101);
        assert_near(s.first_nm, 380, arithmetic);
        assert_near(s.step_nm, 4, arithmetic);
        assert_near(s.raw[100], 100.125e-3, arithmetic);
        assert_near(s.radiance.v[400 - SPECTRUM_FIRST_NM], 5.125e-3, 1e-6);
        assert_true(s.taken.earliest_ns < s.taken.latest_ns);
        spotread_driver.close(r);
    }
}

static void one_blank_goes_out_for_each_reading(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct radiometer_options o = options_for("fine");
    o.average = 3;
    struct radiometer *r = spotread_driver.open(&o, soon(), &err);
    assert_non_null(r);
    assert_string_equal(keys(), "");
    assert_true(spotread_driver.read(r, soon(), &s, &err));
    assert_near(s.xyz.X, 81.25, arithmetic);
    assert_near(s.raw[8], 8.125e-3, arithmetic);
    assert_string_equal(keys(), "32\n32\n32\n");
    spotread_driver.close(r);
}

static void a_colorimeter_has_no_spectrum_and_says_so(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct instrument_identity who;
    struct radiometer *r = open_how("colorimeter", &err);
    assert_non_null(r);
    spotread_driver.identify(r, &who);
    assert_string_equal(who.model, "i1 Pro (no spectra)");
    assert_true(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(s.count, 0);
    assert_near(s.xyz.Z, 93.125, arithmetic);
    spotread_driver.close(r);
}

static void whether_spectra_are_asked_for_is_a_setting(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiometer_options o = options_for("colorimeter");
    o.spectral = RADIOMETER_SPECTRAL_YES;
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "spectral = auto"));
    o.spectral = RADIOMETER_SPECTRAL_NO;
    struct radiometer *r = spotread_driver.open(&o, soon(), &err);
    assert_non_null(r);
    spotread_driver.close(r);
    o = options_for("colorimeter -s"); // asked for by the arguments, too: once more and no oftener
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_int_equal(err.code, ERROR_CONFIG);
}

static void a_failed_reading_names_its_cause_and_the_next_one_works(void **state)
{
    (void)state;
    static const struct {
        const char *how, *says;
        enum error_code code;
    } rows[] = {
        {"misread", "Inconsistent", ERROR_RETRY},  {"saturated", "saturated", ERROR_RANGE},
        {"bright", "too high", ERROR_RANGE},       {"dark", "too low", ERROR_RETRY},
        {"specbos", "Overexposure", ERROR_RANGE},  {"untold", "Something else", ERROR_RETRY},
        {"turned", "wrong position", ERROR_RETRY}, {"cut", "60 values instead of 101", ERROR_RETRY},
        {"garbage", "?[31m", ERROR_RETRY},         {"huge", "99999", ERROR_RETRY},
        {"nan", "no result", ERROR_RETRY},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct error err = {0};
        struct radiance_sample s = {.count = -7};
        struct radiometer *r = open_how(rows[i].how, &err);
        assert_non_null(r);
        assert_false(spotread_driver.read(r, soon(), &s, &err));
        assert_int_equal(err.code, rows[i].code);
        if (!strstr(err.text, rows[i].says))
            print_error("%s: %s\n", rows[i].how, err.text);
        assert_non_null(strstr(err.text, rows[i].says));
        assert_int_equal(s.count, -7);
        assert_true(spotread_driver.read(r, soon(), &s, &err));
        assert_near(s.xyz.Y, 85.5, arithmetic);
        spotread_driver.close(r);
    }
}

static void a_late_result_is_waited_for_and_not_taken_for_the_next(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct radiometer *r = open_how("slow", &err);
    assert_non_null(r);
    assert_false(spotread_driver.read(r, clock_now_ns() + 50 * NS_PER_MS, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_true(spotread_driver.read(r, soon(), &s, &err));
    assert_string_equal(keys(), "32\n32\n"); // none while the first one was under way
    spotread_driver.close(r);
}

static void a_late_failure_is_answered_before_the_next_reading(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct radiometer *r = open_how("late", &err);
    assert_non_null(r);
    assert_false(spotread_driver.read(r, clock_now_ns() + 50 * NS_PER_MS, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_true(spotread_driver.read(r, soon(), &s, &err));
    assert_string_equal(keys(), "32\n32\n32\n"); // a reading, any other key, a reading
    spotread_driver.close(r);
}

static void a_communication_problem_is_gone_and_not_answered(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct radiometer *r = open_how("cable", &err);
    assert_non_null(r);
    assert_true(spotread_driver.read(r, soon(), &s, &err));
    assert_false(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "communication problem"));
    assert_string_equal(keys(), "32\n32\n");
    spotread_driver.close(r);
    r = open_how("fatal", &err);
    assert_non_null(r);
    assert_false(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "It broke"));
    spotread_driver.close(r);
}

static void a_pulled_cable_or_a_dead_process_is_gone(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct radiometer *r = open_how("pulled", &err);
    assert_non_null(r);
    assert_true(spotread_driver.read(r, soon(), &s, &err));
    assert_false(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "Communications failure"));
    assert_false(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    spotread_driver.close(r);
    r = open_how("killed", &err);
    assert_non_null(r);
    assert_false(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "signal 9"));
    spotread_driver.close(r);
    r = open_how("flood", &err);
    assert_non_null(r);
    assert_false(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "without an end"));
    spotread_driver.close(r);
}

static void what_cannot_start_says_why(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiometer_options o = options_for("absent");
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "initialisation failed"));
    strcpy(o.program, "/nowhere/spotread");
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "/nowhere/spotread"));
    o = options_for("unfit");
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_non_null(strstr(err.text, "support it"));
    o = options_for("shy");
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_non_null(strstr(err.text, "ended with 1: Good bye"));
    o = options_for("mute");
    assert_null(spotread_driver.open(&o, clock_now_ns() + 300 * NS_PER_MS, &err));
    assert_int_equal(err.code, ERROR_GONE);
    spotread_driver.close(NULL);
}

static void calibration_happens_only_when_the_settings_say_so(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct radiometer_options o = options_for("calibrate");
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_non_null(strstr(err.text, "calibrate = yes"));
    assert_string_equal(keys(), "");
    o.calibrate = true;
    struct radiometer *r = spotread_driver.open(&o, soon(), &err);
    assert_non_null(r);
    assert_true(spotread_driver.read(r, soon(), &s, &err));
    spotread_driver.close(r);
    o = options_for("stubborn");
    o.calibrate = true;
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_string_equal(keys(), "32\n");
    o = options_for("uncalibrated");
    o.calibrate = true;
    assert_null(spotread_driver.open(&o, soon(), &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "White reference"));
    assert_string_equal(keys(), "32\n");
}

static void nobody_calibrates_on_a_light_even_late(void **state)
{
    (void)state;
    struct error err = {0};
    struct radiance_sample s;
    struct radiometer_options o = options_for("recalibrate");
    o.calibrate = true;
    struct radiometer *r = spotread_driver.open(&o, soon(), &err);
    assert_non_null(r);
    assert_false(spotread_driver.read(r, clock_now_ns() + 50 * NS_PER_MS, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_false(spotread_driver.read(r, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_string_equal(keys(), "32\n");
    spotread_driver.close(r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_lines_of_spotread_are_told_apart),
        cmocka_unit_test(a_reading_has_xyz_and_its_spectrum_in_watts),
        cmocka_unit_test(one_blank_goes_out_for_each_reading),
        cmocka_unit_test(a_colorimeter_has_no_spectrum_and_says_so),
        cmocka_unit_test(whether_spectra_are_asked_for_is_a_setting),
        cmocka_unit_test(a_failed_reading_names_its_cause_and_the_next_one_works),
        cmocka_unit_test(a_late_result_is_waited_for_and_not_taken_for_the_next),
        cmocka_unit_test(a_late_failure_is_answered_before_the_next_reading),
        cmocka_unit_test(a_communication_problem_is_gone_and_not_answered),
        cmocka_unit_test(a_pulled_cable_or_a_dead_process_is_gone),
        cmocka_unit_test(what_cannot_start_says_why),
        cmocka_unit_test(calibration_happens_only_when_the_settings_say_so),
        cmocka_unit_test(nobody_calibrates_on_a_light_even_late),
    };
    return cmocka_run_group_tests(tests, a_folder, no_folder);
}
