// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/clock.h"

static void the_calendar_is_read_and_written(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int64_t utc_s; // date -u -d TEXT +%s
    } known[] = {{"1970-01-01T00:00:00Z", 0},
                 {"2026-01-31T12:34:56Z", 1769862896},
                 {"2024-02-29T23:59:59Z", 1709251199},
                 {"1969-12-31T23:59:59Z", -1},
                 {"2100-03-01T00:00:00Z", 4107542400}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        char text[21];
        int64_t utc_s = 7;
        assert_true(clock_utc_parse(known[i].text, &utc_s));
        assert_true(utc_s == known[i].utc_s);
        clock_utc_text(utc_s, text);
        assert_string_equal(text, known[i].text);
    }
}

static void what_is_no_time_is_refused(void **state)
{
    (void)state;
    static const char *const BAD[] = {"",
                                      "2026-01-31",
                                      "2026-02-29T00:00:00Z",
                                      "2026-01-31T24:00:00Z",
                                      "2026-01-31T12:34:56+",
                                      "2026-1-31T12:34:56ZZ",
                                      "2026-01-31T12:34:56Z "};
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        int64_t utc_s = 7;
        assert_false(clock_utc_parse(BAD[i], &utc_s));
        assert_true(utc_s == 7);
    }
}

static void now_is_the_same_in_both_forms(void **state)
{
    (void)state;
    char text[21];
    int64_t before = clock_utc_s(), now;
    clock_utc(text);
    assert_true(clock_utc_parse(text, &now));
    assert_true(now >= before && now <= clock_utc_s());
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_calendar_is_read_and_written),
        cmocka_unit_test(what_is_no_time_is_refused),
        cmocka_unit_test(now_is_the_same_in_both_forms),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
