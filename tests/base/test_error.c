// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"
#include "base/log.h"
#include "base/number.h"

static void context_goes_before_the_text_and_the_code_stays(void **state)
{
    (void)state;
    struct error err = {0};
    assert_false(fail(&err, ERROR_GONE, "read %d of %d bytes", 3, 64));
    assert_false(while_doing(&err, "reading %s", "dark frame"));
    assert_false(while_doing(&err, "spectrometer"));
    assert_int_equal(err.code, ERROR_GONE);
    assert_string_equal(err.text, "spectrometer: reading dark frame: read 3 of 64 bytes");
}

static void a_system_error_says_what_the_system_says(void **state)
{
    (void)state;
    struct error err = {0};
    errno = ENOENT;
    assert_false(fail_errno(&err, "lamp.sp"));
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_string_equal(err.text, "lamp.sp: No such file or directory");
}

static void no_error_to_fill_is_allowed_everywhere(void **state)
{
    (void)state;
    assert_false(fail(NULL, ERROR_DATA, "x"));
    assert_false(fail_errno(NULL, "x"));
    assert_false(while_doing(NULL, "x"));
}

static void a_long_text_is_cut_and_stays_a_text(void **state)
{
    (void)state;
    struct error err = {0};
    char text[2000];
    memset(text, 'x', sizeof text);
    text[1999] = 0;
    fail(&err, ERROR_DATA, "%s", text);
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
    while_doing(&err, "%s", text);
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
    assert_int_equal(err.code, ERROR_DATA);
}

static void an_error_may_be_its_own_argument(void **state)
{
    (void)state;
    struct error err = {0};
    fail(&err, ERROR_DATA, "inner");
    fail(&err, ERROR_CONFIG, "outer: %s", err.text);
    assert_string_equal(err.text, "outer: inner");
}

static void every_code_has_its_name(void **state)
{
    (void)state;
    static const char *const NAMES[] = {"none",  "retry",  "gone",  "data",
                                        "range", "config", "system"};
    for (int i = ERROR_NONE; i <= ERROR_SYSTEM; i++)
        assert_string_equal(error_code_name(i), NAMES[i]);
}

static void a_number_as_text_is_short_and_exact(void **state)
{
    (void)state;
    char text[NUMBER_TEXT];
    assert_string_equal(number_text(text, 0.1), "0.1");
    assert_string_equal(number_text(text, 1e6), "1000000");
    assert_string_equal(number_text(text, -0.52), "-0.52");
    uint64_t bits = 1;
    for (int i = 0; i < 20000; i++) {
        double value;
        bits = bits * 6364136223846793005u + 1442695040888963407u;
        memcpy(&value, &bits, sizeof value);
        if (isfinite(value))
            assert_true(strtod(number_text(text, value), NULL) == value);
    }
    assert_true(strtod(number_text(text, 5e-324), NULL) == 5e-324);
}

static void the_clock_never_goes_back_and_sleeps_to_its_deadline(void **state)
{
    (void)state;
    int64_t before = clock_now_ns();
    for (int i = 0; i < 1000; i++) {
        int64_t now = clock_now_ns();
        assert_true(now >= before);
        before = now;
    }
    clock_sleep_until_ns(before + 2 * NS_PER_MS);
    assert_true(clock_now_ns() >= before + 2 * NS_PER_MS);
    clock_sleep_until_ns(0);
    char text[21];
    clock_utc(text);
    assert_int_equal(strlen(text), 20);
    assert_int_equal(text[10], 'T');
    assert_int_equal(text[19], 'Z');
}

static size_t logged(enum log_level level, char *text, size_t room)
{
    char path[] = "/tmp/log-XXXXXX";
    int file = mkstemp(path), saved = dup(2);
    assert_true(file >= 0 && saved >= 0);
    dup2(file, 2);
    log_line(level, "lamp %s", "D50");
    dup2(saved, 2);
    close(saved);
    ssize_t size = pread(file, text, room - 1, 0);
    close(file);
    unlink(path);
    text[size] = 0;
    return size;
}

static void what_others_wrote_cannot_command_the_terminal(void **state)
{
    (void)state;
    struct error err = {0};
    fail(&err, ERROR_CONFIG, "no material \"%s\"", "a\nb\x1b[31mc\r\x7f\xc2\x9b, caf\xc3\xa9");
    assert_string_equal(err.text, "no material \"a b?[31mc????, caf\xc3\xa9\"");
    while_doing(&err, "showing\x07");
    assert_string_equal(err.text, "showing?: no material \"a b?[31mc????, caf\xc3\xa9\"");
}

static void what_can_be_corrected_ends_a_program_with_2(void **state)
{
    (void)state;
    static const enum error_code bad_input[] = {ERROR_DATA, ERROR_RANGE, ERROR_CONFIG};
    static const enum error_code failed[] = {ERROR_RETRY, ERROR_GONE, ERROR_SYSTEM};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(error_exit_code(&(struct error){.code = bad_input[i]}), 2);
        assert_int_equal(error_exit_code(&(struct error){.code = failed[i]}), 1);
    }
}

static void a_number_is_decimal_and_finite(void **state)
{
    (void)state;
    static const char *const bad[] = {"", "x", " 1", "0x10", "nan", "inf", "1e999", "-"};
    const char *end;
    double value = 7;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_false(number_parse(bad[i], &end, &value));
    assert_true(value == 7);
    assert_true(number_parse("-1.5e2K", &end, &value));
    assert_true(value == -150);
    assert_string_equal(end, "K");
}

static void a_log_line_names_the_program_or_gives_the_journal_its_level(void **state)
{
    (void)state;
    char text[256];
    log_init("boothtest", LOG_LEVEL_NOTICE);
    unsetenv("JOURNAL_STREAM");
    logged(LOG_LEVEL_WARNING, text, sizeof text);
    assert_string_equal(text, "boothtest: lamp D50\n");
    assert_int_equal(logged(LOG_LEVEL_INFO, text, sizeof text), 0);
    setenv("JOURNAL_STREAM", "8:1", 1);
    logged(LOG_LEVEL_ERROR, text, sizeof text);
    assert_string_equal(text, "<3>lamp D50\n");
    unsetenv("JOURNAL_STREAM");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(context_goes_before_the_text_and_the_code_stays),
        cmocka_unit_test(a_system_error_says_what_the_system_says),
        cmocka_unit_test(no_error_to_fill_is_allowed_everywhere),
        cmocka_unit_test(a_long_text_is_cut_and_stays_a_text),
        cmocka_unit_test(an_error_may_be_its_own_argument),
        cmocka_unit_test(every_code_has_its_name),
        cmocka_unit_test(a_number_as_text_is_short_and_exact),
        cmocka_unit_test(the_clock_never_goes_back_and_sleeps_to_its_deadline),
        cmocka_unit_test(what_others_wrote_cannot_command_the_terminal),
        cmocka_unit_test(what_can_be_corrected_ends_a_program_with_2),
        cmocka_unit_test(a_number_is_decimal_and_finite),
        cmocka_unit_test(a_log_line_names_the_program_or_gives_the_journal_its_level),
    };
    return cmocka_run_group_tests_name("error", tests, NULL, NULL);
}
