// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "colorimetry/colour.h"
#include "simulator/model_pr655.h"

#include <cmocka.h> // last: its fail() is a macro

#define MS NS_PER_MS
// 0.1 % repeatability of a reading, five sigma, and four digits of the text.
#define BRIGHT 0.006
#define DARK 0.05 // a display's black: shot and read noise over 6 s, five sigma

static struct spectrum light;
static struct pr655 *device;
static int64_t now_ns;

static void shine(void *context, int64_t at_ns, struct spectrum *out)
{
    (void)context, (void)at_ns;
    *out = light;
}

static void make(double hurry)
{
    struct pr655_options options = {
        .around = {.radiance = shine},
        .serial = "EMU65500123",
        .seed = 11,
        .hurry = hurry,
        .lapses = {.drift = 0.01, .misread_every = 3},
    };
    pr655_destroy(device);
    device = pr655_create(&options);
    assert_non_null(device);
}

static int fresh(void **state)
{
    (void)state;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        light.v[i] = 0.002;
    now_ns = 0;
    make(1);
    return 0;
}

static int gone(void **state)
{
    (void)state;
    pr655_destroy(device);
    device = NULL;
    return 0;
}

// Sends, lets time go by until nothing more is to come; the answer.
static const char *ask(const char *text)
{
    static char answer[8192];
    int64_t again_ns = 0;
    size_t size = 0;
    for (; *text; text++)
        pr655_in(device, now_ns, *text);
    while (again_ns < INT64_MAX) {
        size += pr655_out(device, now_ns, answer + size, sizeof(answer) - 1 - size, &again_ns);
        now_ns = again_ns < INT64_MAX ? again_ns : now_ns;
    }
    answer[size] = '\0';
    return answer;
}

static double luminance(void)
{
    struct xyz c = xyz_absolute(&light, OBSERVER_1931_2);
    return c.Y;
}

static void it_only_listens_in_remote_mode(void **state)
{
    (void)state;
    assert_string_equal(ask("D111\r"), "");
    assert_string_equal(ask("PHOTO\r"), " REMOTE MODE\r\n");
    assert_string_equal(ask("D111\r"), "00000,PR-655\r\n");
    assert_string_equal(ask("Q\r"), "");
    assert_string_equal(ask("D111\r"), "");
    assert_string_equal(ask("PHOTO\n"), " REMOTE MODE\r\n"); // LF ends a line as well
}

static void it_says_what_it_is(void **state)
{
    (void)state;
    ask("PHOTO\r");
    assert_string_equal(ask("D110\r"), "00000,EMU65500123\r\n");
    assert_string_equal(ask("D120\r"), "00000,101,8.00,380.00,780.00,4.00\r\n");
}

static void nonsense_has_its_own_status(void **state)
{
    (void)state;
    ask("PHOTO\r");
    assert_string_equal(ask("X\r"), "-1000\r\n");
    assert_string_equal(ask("M\r"), "-1000\r\n");
    assert_string_equal(ask("SN1,2\r"), "-1001\r\n");
    assert_string_equal(ask("D1\r"), "-2000\r\n"); // nothing was measured yet
    assert_string_equal(ask("D77\r"), "-2000\r\n");
}

static void luminance_is_that_of_the_light(void **state)
{
    (void)state;
    int status, units;
    double Y, x, y;
    ask("PHOTO\r");
    const char *answer = ask("M1\r");
    assert_int_equal(sscanf(answer, "%5d,%d,%lf,%lf,%lf\r\n", &status, &units, &Y, &x, &y), 5);
    assert_int_equal(status, 0);
    assert_true(fabs(Y / luminance() - 1) < BRIGHT);
    assert_true(fabs(x - 1 / 3.0) < 0.002);
    assert_true(fabs(y - 1 / 3.0) < 0.002);
}

static void the_spectrum_has_101_lines(void **state)
{
    (void)state;
    ask("PHOTO\r");
    const char *line = ask("M5\r");
    assert_memory_equal(line, "00000,0,", 8);
    for (int i = 0; i < 101; i++) {
        int nm;
        double value;
        line = strstr(line, "\r\n") + 2;
        assert_int_equal(sscanf(line, "%d,%lf\r\n", &nm, &value), 2);
        assert_int_equal(nm, 380 + 4 * i);
        assert_true(fabs(value / 0.002 - 1) < 10 * BRIGHT); // one point, at its noise
    }
    assert_string_equal(strstr(line, "\r\n"), "\r\n");
}

static void a_line_is_smeared_over_a_triangle_of_8_nm(void **state)
{
    (void)state;
    memset(&light, 0, sizeof(light));
    light.v[540 - SPECTRUM_FIRST_NM] = 0.08;
    ask("PHOTO\r");
    const char *at = strstr(ask("M5\r"), " 532,");
    double v[5];
    assert_int_equal(sscanf(at, " 532,%lf 536,%lf 540,%lf 544,%lf 548,%lf", v, v + 1, v + 2,
                            v + 3, v + 4),
                     5);
    assert_true(fabs(v[2] / 0.01 - 1) < 10 * BRIGHT);
    assert_true(fabs(v[1] / 0.005 - 1) < 10 * BRIGHT);
    assert_true(fabs(v[3] / 0.005 - 1) < 10 * BRIGHT);
    assert_true(fabs(v[0]) < 1e-4 && fabs(v[4]) < 1e-4); // read noise
}

static double seconds_for(double level)
{
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        light.v[i] = level;
    int64_t before_ns = now_ns;
    ask("M1\r");
    return (double)(now_ns - before_ns) * 1e-9;
}

static void the_dark_takes_longer(void **state)
{
    (void)state;
    ask("PHOTO\r");
    double bright = seconds_for(0.01), dim = seconds_for(1e-4), dark = seconds_for(3e-6);
    assert_true(bright < 1);
    assert_true(dim > 2 * bright);
    assert_true(dark > 6 && dark < 20); // 6 s of light, then the dark reading
    make(100);
    ask("PHOTO\r");
    assert_true(fabs(seconds_for(3e-6) * 100 / dark - 1) < 0.01);
}

static void a_display_s_black_can_be_read_and_less_is_weak(void **state)
{
    (void)state;
    double Y;
    spectrum_scale(&light, 0.3 / luminance());
    ask("PHOTO\r");
    assert_int_equal(sscanf(ask("M1\r"), "00000,0,%lf", &Y), 1);
    assert_true(fabs(Y / 0.3 - 1) < DARK);
    spectrum_scale(&light, 0.02);
    assert_string_equal(ask("M1\r"), "-0008\r\n");
    assert_string_equal(ask("D5\r"), "-0008\r\n");
}

static void too_much_is_an_overload(void **state)
{
    (void)state;
    spectrum_scale(&light, 200000 / luminance());
    ask("PHOTO\r");
    assert_string_equal(ask("M1\r"), "-0002\r\n");
}

static void exposure_and_averages_are_set_within_range(void **state)
{
    (void)state;
    ask("PHOTO\r");
    assert_string_equal(ask("SE250\r"), "00000\r\n");
    ask("M2\r");
    assert_string_equal(ask("D13\r"), "00000,1,250.0\r\n");
    assert_string_equal(ask("SE9999\r"), "-1005\r\n");
    assert_string_equal(ask("SN100\r"), "-1005\r\n");
    assert_string_equal(ask("SN3\r"), "00000\r\n");
}

static void upset_it_answers_its_status(void **state)
{
    (void)state;
    ask("PHOTO\r");
    pr655_upset(device, -1);
    assert_string_equal(ask("M5\r"), "-0001\r\n");
    pr655_upset(device, 0);
    assert_memory_equal(ask("M5\r"), "00000,", 6);
}

static double read_Y(void)
{
    double Y = 0;
    assert_int_equal(sscanf(ask("M1\r"), "00000,0,%lf", &Y), 1);
    return Y;
}

static void a_drifting_one_reads_more_each_time(void **state)
{
    (void)state;
    ask("PHOTO\r");
    double true_Y = read_Y();
    pr655_lapse(device, LAPSE_DRIFT);
    for (int i = 1; i <= 5; i++)
        assert_true(fabs(read_Y() / (true_Y * pow(1.01, i)) - 1) < 2 * BRIGHT);
    pr655_lapse(device, LAPSE_NONE);
    assert_true(fabs(read_Y() / true_Y - 1) < 2 * BRIGHT);
}

static void a_misreading_one_is_wrong_every_third_time(void **state)
{
    (void)state;
    ask("PHOTO\r");
    double true_Y = read_Y();
    pr655_lapse(device, LAPSE_MISREAD);
    const double wrong_by[] = {1.1, 1, 1, 0, 1, 1, 1000, 1, 1}; // 0 = an error
    for (int i = 0; i < 9; i++)
        if (wrong_by[i] > 0)
            assert_true(fabs(read_Y() / (true_Y * wrong_by[i]) - 1) < 2 * BRIGHT);
        else
            assert_string_equal(ask("M1\r"), "-0001\r\n");
}

#define WITH(test) cmocka_unit_test_setup_teardown(test, fresh, gone)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH(it_only_listens_in_remote_mode),
        WITH(it_says_what_it_is),
        WITH(nonsense_has_its_own_status),
        WITH(luminance_is_that_of_the_light),
        WITH(the_spectrum_has_101_lines),
        WITH(a_line_is_smeared_over_a_triangle_of_8_nm),
        WITH(the_dark_takes_longer),
        WITH(a_display_s_black_can_be_read_and_less_is_weak),
        WITH(too_much_is_an_overload),
        WITH(exposure_and_averages_are_set_within_range),
        WITH(upset_it_answers_its_status),
        WITH(a_drifting_one_reads_more_each_time),
        WITH(a_misreading_one_is_wrong_every_third_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
