// SPDX-License-Identifier: Apache-2.0
// Settling, found on panels whose response is known.
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration/journal.h"
#include "calibration/settle.h"
#include "calibration/statistics.h"

// cmocka defines a macro named fail: it comes last.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

static const double EXACT = 1e-12;

// An exponential panel with readings that scatter like a saw tooth.
struct panel {
    double time_constant_s, noise;
    int turn;
};

static const double WHITE = 900, BLACK = 0.3;

static bool read_panel(void *context, bool white, double after_s, double *luminance,
                       struct error *err)
{
    (void)err;
    struct panel *p = context;
    double from = white ? BLACK : WHITE, to = white ? WHITE : BLACK;
    double left = p->time_constant_s > 0 ? exp(-after_s / p->time_constant_s) : 0;
    *luminance = (to + (from - to) * left) * (1 + p->noise * (p->turn++ % 5 - 2));
    return true;
}

static void a_panel_that_answers_at_once_needs_no_wait(void **state)
{
    (void)state;
    struct settle s;
    assert_true(settle_find(read_panel, &(struct panel){0, 2e-4, 0}, &s, NULL));
    assert_true(s.settled);
    assert_float_equal(s.seconds, 0, EXACT);
    assert_float_equal(s.white, WHITE, 0.1);
}

// Black after white decides: exp(-t/20 ms) must fall below 1e-5 of white, 0.23 s.
static void a_slow_panel_is_waited_for_as_long_as_its_black_takes(void **state)
{
    (void)state;
    struct settle s;
    assert_true(settle_find(read_panel, &(struct panel){0.020, 0, 0}, &s, NULL));
    assert_true(s.settled);
    assert_float_equal(s.seconds, 0.4, EXACT);
}

static void noise_does_not_pass_for_settling(void **state)
{
    (void)state;
    struct settle quiet, noisy;
    assert_true(settle_find(read_panel, &(struct panel){0.020, 0, 0}, &quiet, NULL));
    assert_true(settle_find(read_panel, &(struct panel){0.020, 5e-3, 0}, &noisy, NULL));
    assert_true(noisy.settled && noisy.seconds <= quiet.seconds);
    assert_true(noisy.seconds >= 0.1); // white after black: exp(-0.05/0.02) is 8 %
}

static void a_panel_that_never_stands_is_said_to(void **state)
{
    (void)state;
    struct settle s;
    assert_true(settle_find(read_panel, &(struct panel){3, 0, 0}, &s, NULL));
    assert_false(s.settled);
    assert_float_equal(s.seconds, SETTLE_LONGEST_S, EXACT);
}

static bool broken(void *context, bool white, double after_s, double *luminance, struct error *err)
{
    (void)context, (void)white, (void)after_s, (void)luminance;
    return fail(err, ERROR_GONE, "cable pulled");
}

static void an_instrument_that_fails_ends_the_search(void **state)
{
    (void)state;
    struct settle s = {.seconds = 7};
    struct error err;
    assert_false(settle_find(broken, NULL, &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_float_equal(s.seconds, 7, EXACT);
}

// ---- the line --------------------------------------------------------------

// JCGM 100:2008, H.3: calibration of a thermometer, 11 readings about 20 C:
// y1 = -0.1712 C (0.0029), y2 = 0.00218 (0.00067) per degree.
static void the_line_of_the_guide_comes_out(void **state)
{
    (void)state;
    static const double T[] = {21.521, 22.012, 22.512, 23.003, 23.507, 23.999,
                               24.513, 25.002, 25.503, 26.010, 26.511};
    static const double B[] = {-0.171, -0.169, -0.166, -0.159, -0.164, -0.165,
                               -0.156, -0.157, -0.159, -0.161, -0.160};
    struct line_fit f = line_through(T, B, 11);
    assert_float_equal(f.at_mean + f.slope * (20 - f.mean_x), -0.1712, 5e-5);
    assert_float_equal(f.slope, 0.00218, 5e-6);
    assert_float_equal(f.slope_u, 0.00067, 5e-6);
    assert_float_equal(f.scatter, 0.0035, 5e-5);
}

static void a_line_needs_two_places(void **state)
{
    (void)state;
    double x[] = {3, 3}, y[] = {1, 2};
    assert_float_equal(line_through(x, y, 2).slope, 0, EXACT);
    assert_float_equal(line_through(x, y, 1).at_mean, 0, EXACT);
}

// ---- the journal -----------------------------------------------------------

static void a_torn_line_is_cut_off_and_the_rest_is_kept(void **state)
{
    (void)state;
    char path[] = "/tmp/journal-XXXXXX";
    close(mkstemp(path));
    unlink(path);
    struct journal j;
    struct error err;
    json_t *head = json_pack("{s:s}", "journal", "test");
    assert_true(journal_open(&j, path, head, &err));
    assert_true(journal_add(&j, json_pack("{s:i}", "n", 1), &err));
    journal_close(&j);
    FILE *torn = fopen(path, "a");
    fputs("{\"n\":2,\"XYZ\":[1,", torn);
    fclose(torn);
    assert_true(journal_open(&j, path, head, &err));
    assert_int_equal(json_array_size(j.lines), 1);
    assert_true(journal_add(&j, json_pack("{s:i}", "n", 2), &err));
    journal_close(&j);
    assert_true(journal_open(&j, path, head, &err));
    assert_int_equal(json_array_size(j.lines), 2);
    assert_int_equal(json_integer_value(json_object_get(json_array_get(j.lines, 1), "n")), 2);
    journal_close(&j);
    json_decref(head);
    unlink(path);
}

static void a_line_that_is_none_is_named(void **state)
{
    (void)state;
    char path[] = "/tmp/journal-XXXXXX";
    FILE *file = fdopen(mkstemp(path), "w");
    fputs("{\"journal\":\"test\"}\nrubbish\n{\"n\":1}\n", file);
    fclose(file);
    struct journal j;
    struct error err;
    json_t *head = json_object();
    assert_false(journal_open(&j, path, head, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, ":2:"));
    json_decref(head);
    unlink(path);
}

static void two_cannot_write_one_journal(void **state)
{
    (void)state;
    char path[] = "/tmp/journal-XXXXXX";
    close(mkstemp(path));
    struct journal first, second;
    struct error err;
    json_t *head = json_object();
    assert_true(journal_open(&first, path, head, &err));
    assert_false(journal_open(&second, path, head, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    journal_close(&first);
    json_decref(head);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_panel_that_answers_at_once_needs_no_wait),
        cmocka_unit_test(a_slow_panel_is_waited_for_as_long_as_its_black_takes),
        cmocka_unit_test(noise_does_not_pass_for_settling),
        cmocka_unit_test(a_panel_that_never_stands_is_said_to),
        cmocka_unit_test(an_instrument_that_fails_ends_the_search),
        cmocka_unit_test(the_line_of_the_guide_comes_out),
        cmocka_unit_test(a_line_needs_two_places),
        cmocka_unit_test(a_torn_line_is_cut_off_and_the_rest_is_kept),
        cmocka_unit_test(a_line_that_is_none_is_named),
        cmocka_unit_test(two_cannot_write_one_journal),
    };
    return cmocka_run_group_tests_name("measuring", tests, NULL, NULL);
}
