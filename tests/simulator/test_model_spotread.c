// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "colorimetry/colour.h"
#include "simulator/model_spotread.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/fakes/near.h"

#include "tests/simulator/spotread_here.h"

#define REPEAT 0.006 // 0.1 % of a reading, five sigma and some
#define ESCAPE 0x1b

static const char prompt_begins[] = "\nPlace instrument on spot to be measured,\n";
static const char prompt_ends[] = "any other key to take a reading: ";
static const char asks[] = "Hit Esc or Q to give up, any other key to retry:";

static struct xyz result_in(const char *text)
{
    struct xyz c;
    const char *at = strstr(text, "\n Result is XYZ: ");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "\n Result is XYZ: %lf %lf %lf,", &c.X, &c.Y, &c.Z), 3);
    return c;
}

static void expect_result(const char *text, double factor, double tolerance)
{
    struct xyz seen = result_in(text), is = xyz_absolute(&sight.radiance, OBSERVER_1931_2);
    assert_near(seen.X / is.X, factor, tolerance);
    assert_near(seen.Y / is.Y, factor, tolerance);
    assert_near(seen.Z / is.Z, factor, tolerance);
}

static void a_key_takes_a_reading_and_the_prompt_comes_back(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    const char *text = listen();
    assert_memory_equal(text, prompt_begins, strlen(prompt_begins));
    assert_string_equal(text + strlen(text) - strlen(prompt_ends), prompt_ends);
    for (int i = 0; i < 3; i++) {
        text = press(' ');
        assert_int_equal(text[0], '\n');
        expect_result(text, 1, REPEAT);
        assert_says(text, ", D50 Lab: ");
        assert_string_equal(text + strlen(text) - strlen(prompt_ends), prompt_ends);
        assert_int_equal(wants(), SPOTREAD_KEY);
    }
}

static void every_instrument_sees_even_light_alike(void **state)
{
    (void)state;
    const double missing = 0.002; // of X, Y, Z below 380 nm and beyond 730 nm
    for (int kind = SPOTREAD_SPECBOS; kind <= SPOTREAD_I1D3; kind++) {
        start((enum spotread_kind)kind, "-e -N");
        listen();
        expect_result(press(' '), 1, REPEAT + missing);
    }
}

static void the_form_of_the_third_group_is_chosen(void **state)
{
    (void)state;
    static const char *const rows[][2] = {{"-x", "Yxy: "}, {"-h", "LCh: "}, {"-u", "Yuv: "}};
    double Y, x, y;
    for (int i = 0; i < 3; i++) {
        start(SPOTREAD_SPECBOS, rows[i][0]);
        listen();
        const char *text = press(' ');
        const char *at = strstr(text, rows[i][1]);
        assert_non_null(at);
        if (i == 0) {
            assert_int_equal(sscanf(at, "Yxy: %lf %lf %lf", &Y, &x, &y), 3);
            assert_near(Y, result_in(text).Y, 0);
            assert_near(x, 1 / 3.0, 0.002);
            assert_near(y, 1 / 3.0, 0.002);
        }
    }
}

static void a_spectrum_comes_before_the_result_in_milliwatts(void **state)
{
    (void)state;
    double first, second;
    start(SPOTREAD_SPECBOS, "-e -s");
    listen();
    const char *text = press(' ');
    const char *at = strstr(text, "Spectrum from 380.000 to 780.000 nm in 401 steps\n");
    assert_non_null(at);
    assert_true(strstr(at, "Result is XYZ") > at);
    at = strchr(at, '\n') + 1;
    assert_int_equal(sscanf(at, "%lf, %lf,", &first, &second), 2);
    assert_near(first, 2, 0.02);
    assert_near(second, 2, 0.02);
    int commas = 0;
    for (; *at != '\n'; at++)
        commas += *at == ',';
    assert_int_equal(commas, 400);
}

static double seconds_for_a_reading(double radiance)
{
    shine(radiance);
    int64_t before_ns = now_ns;
    result_in(press(' '));
    return (double)(now_ns - before_ns) / NS_PER_S;
}

static void the_dark_takes_longer(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    double bright = seconds_for_a_reading(0.01), dark = seconds_for_a_reading(4e-6);
    assert_true(bright > 0.5 && bright < 1);
    assert_true(dark > 6 && dark < 8);
}

static void too_little_and_too_much_light_ask_to_go_on(void **state)
{
    (void)state;
    const struct {
        double radiance;
        enum spotread_trouble trouble;
        const char *says;
    } rows[] = {{1e-8, SPOTREAD_WELL, "misread (Underexposure)"},
                {2, SPOTREAD_WELL, "misread (Overexposure)"},
                {0.002, SPOTREAD_WEAK, "misread (Underexposure)"},
                {0.002, SPOTREAD_BRIGHT, "misread (Overexposure)"}};
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        shine(rows[i].radiance);
        sight.trouble = rows[i].trouble;
        const char *text = press(' ');
        assert_says(text, "\n\nSpot read failed due to ");
        assert_says(text, rows[i].says);
        assert_string_equal(text + strlen(text) - strlen(asks), asks);
        assert_true(spotread_drops_keys(spotread));
        assert_int_equal(wants(), SPOTREAD_NEXT_KEY);
        sight.trouble = SPOTREAD_WELL;
        shine(0.002);
        assert_says(press(' '), prompt_begins); // the key only goes on
        expect_result(press(' '), 1, REPEAT);
    }
}

static void giving_up_ends_it(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    const char *text = press('q');
    assert_says(text, "\n\nSpot read stopped at user request!\n");
    assert_says(text, asks);
    assert_false(spotread_drops_keys(spotread)); // "qq" ends it
    assert_says(press('x'), prompt_begins);
    press(ESCAPE);
    press(ESCAPE);
    assert_int_equal(wants(), SPOTREAD_END);
    assert_int_equal(spotread_status(spotread), 0);
}

static void a_pulled_cable_is_a_communication_problem_until_it_is_started_again(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    sight.trouble = SPOTREAD_GONE;
    assert_says(press(' '), "\n\nSpot read failed due to communication problem.\n");
    assert_says(press(' '), prompt_begins);
    sight = (struct spotread_sight){.radiance = sight.radiance, .plug = 2};
    assert_says(press(' '), "communication problem");
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    expect_result(press(' '), 1, REPEAT);
}

static void without_an_instrument_it_does_not_start(void **state)
{
    (void)state;
    sight.trouble = SPOTREAD_GONE;
    start(SPOTREAD_SPECBOS, "-e");
    assert_says(listen(), "spotread: Error - No instrument at port 1\n");
    assert_int_equal(wants(), SPOTREAD_END);
    assert_int_equal(spotread_status(spotread), 1);
    sight.trouble = SPOTREAD_WELL;
    start(SPOTREAD_SPECBOS, "-e -c 2");
    assert_says(listen(), "No instrument at port 2");
}

static void stuck_a_reading_waits_until_it_is_well(void **state)
{
    (void)state;
    int64_t until_ns;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    sight.trouble = SPOTREAD_STUCK;
    spotread_key(spotread, now_ns, ' ');
    for (int i = 0; i < 100; i++) {
        if (wants() == SPOTREAD_TIME) {
            spotread_wants(spotread, now_ns, &until_ns);
            now_ns = until_ns;
            spotread_time(spotread, now_ns);
        } else {
            assert_int_equal(wants(), SPOTREAD_SIGHT);
            spotread_sight(spotread, now_ns, &sight);
        }
    }
    assert_string_equal(spotread_out(spotread), "\n");
    sight.trouble = SPOTREAD_WELL;
    expect_result(listen(), 1, REPEAT);
}

static void a_fatal_error_ends_it(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    sight.trouble = SPOTREAD_FATAL;
    assert_says(press(' '), "\n\nGot fatal error '");
    assert_int_equal(wants(), SPOTREAD_END);
    assert_int_equal(spotread_status(spotread), 0);
}

static void readings_drift_and_lapse(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    sight.lapse = LAPSE_DRIFT;
    for (int i = 1; i <= 4; i++)
        expect_result(press(' '), pow(1.01, i), 1.1 * REPEAT);
    sight.lapse = LAPSE_MISREAD; // every second one
    expect_result(press(' '), 1.1, 1.1 * REPEAT);
    expect_result(press(' '), 1, REPEAT);
    assert_says(press(' '), "misread (Adaption integration time)");
}

static void an_i1pro_wants_a_calibration_first(void **state)
{
    (void)state;
    start(SPOTREAD_I1PRO, "-e");
    const char *text = listen();
    assert_says(text, "\nSpot read needs a calibration before continuing\n");
    assert_says(text, " or hit Esc or Q to abort: ");
    assert_int_equal(wants(), SPOTREAD_FRESH_KEY);
    text = press(' ');
    assert_says(text, "Calibration complete\n");
    assert_says(text, "instrument switch or any other key to take a reading: ");
    result_in(press(' '));
    assert_says(press('k'), " or hit Esc or Q to abort: "); // again, because it was asked for
    assert_says(press(ESCAPE), "abort or error from calibrate\n");
    assert_int_equal(wants(), SPOTREAD_END);
    start(SPOTREAD_I1PRO, "-e");
    listen();
    assert_says(press('q'), "abort or error from calibration\n");
    start(SPOTREAD_I1PRO, "-e -N");
    assert_says(listen(), prompt_begins);
}

static void an_i1pro_has_two_resolutions(void **state)
{
    (void)state;
    start(SPOTREAD_I1PRO, "-e -N -s");
    listen();
    assert_says(press(' '), "Spectrum from 380.000 to 730.000 nm in 36 steps\n");
    assert_says(press('h'), "high resolution");
    assert_says(press(' '), "Spectrum from 380.000 to 730.000 nm in 106 steps\n");
    assert_says(press('h'), "standard resolution");
    assert_says(press(' '), " in 36 steps\n");
}

static void a_colorimeter_has_no_spectrum(void **state)
{
    (void)state;
    start(SPOTREAD_I1D3, "-e -s");
    assert_says(listen(), "and instrument doesn't support it\n");
    assert_int_equal(spotread_status(spotread), 255);
    start(SPOTREAD_I1D3, "-e");
    listen();
    press(' ');
    assert_says(press('s'), "\nNo previous spectral reading");
    assert_says(press('h'), "'H' Command ignored");
}

static void letters_are_for_papers_with_brighteners(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    const char *text = press('b');
    assert_says(text, "Unable to apply FWA compensation");
    expect_result(text, 1, REPEAT);
    assert_says(press('B'), "slot 'B'\n");
    assert_int_equal(wants(), SPOTREAD_END);
    assert_int_equal(spotread_status(spotread), 1);
}

static void the_last_reading_becomes_the_reference(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    assert_says(press('r'), "\n No previous reading to use as reference\n");
    press(' ');
    assert_says(press('r'), "\n Reference is now XYZ: ");
}

static void the_same_seed_gives_the_same_readings(void **state)
{
    (void)state;
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    struct xyz first = result_in(press(' '));
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    struct xyz second = result_in(press(' '));
    assert_near(first.Y, second.Y, 0);
    assert_true(fabs(first.Y - result_in(press(' ')).Y) > 0); // but no two in a row
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH(a_key_takes_a_reading_and_the_prompt_comes_back),
        WITH(every_instrument_sees_even_light_alike),
        WITH(the_form_of_the_third_group_is_chosen),
        WITH(a_spectrum_comes_before_the_result_in_milliwatts),
        WITH(the_dark_takes_longer),
        WITH(too_little_and_too_much_light_ask_to_go_on),
        WITH(giving_up_ends_it),
        WITH(a_pulled_cable_is_a_communication_problem_until_it_is_started_again),
        WITH(without_an_instrument_it_does_not_start),
        WITH(stuck_a_reading_waits_until_it_is_well),
        WITH(a_fatal_error_ends_it),
        WITH(readings_drift_and_lapse),
        WITH(an_i1pro_wants_a_calibration_first),
        WITH(an_i1pro_has_two_resolutions),
        WITH(a_colorimeter_has_no_spectrum),
        WITH(letters_are_for_papers_with_brighteners),
        WITH(the_last_reading_becomes_the_reference),
        WITH(the_same_seed_gives_the_same_readings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
