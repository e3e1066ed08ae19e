// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#undef fail // ours is a function

#include "config/view_file.h"

static struct display_view some_view(void)
{
    struct display_view v;
    display_view_none(&v);
    v.sine_most = 0.64278760968653925;
    for (int c = 0; c < VIEW_CHANNELS; c++) {
        for (int t = 0; t < VIEW_TERMS; t++)
            v.angle[c][t] = -0.1 * (c + 1) / (t + 3.0);
        for (int i = 0; i < VIEW_GRID * VIEW_GRID; i++)
            v.place[c][i / VIEW_GRID][i % VIEW_GRID] = i == 12 ? 1 : 1 - 0.01 * (c + 1) / (i + 3.0);
    }
    assert_true(display_view_prepare(&v, NULL));
    return v;
}

static void what_was_saved_comes_back_to_the_last_digit(void **state)
{
    (void)state;
    char path[] = "/tmp/view-XXXXXX";
    close(mkstemp(path));
    struct display_view out = some_view(), back;
    struct view_origin origin = {"PR-655", "2026-01-31", "boothd test", "display.ini",
                                 17,       25,           9.5,           0.3};
    struct view_origin from;
    struct error err;
    assert_true(view_save(path, &out, &origin, &err));
    assert_true(view_load(path, &back, &from, &err));
    assert_memory_equal(&out, &back, sizeof out);
    assert_int_equal(from.directions, 17);
    assert_string_equal(from.model, "display.ini");
    unlink(path);
}

static void a_gain_that_cannot_be_names_the_file(void **state)
{
    (void)state;
    char path[] = "/tmp/view-XXXXXX";
    close(mkstemp(path));
    struct display_view v = some_view(), back = {.sine_most = 0.25};
    struct view_origin origin = {0};
    struct error err;
    v.angle[1][2] = -50;
    assert_true(view_save(path, &v, &origin, &err));
    assert_false(view_load(path, &back, NULL, &err));
    assert_non_null(strstr(err.text, path));
    assert_non_null(strstr(err.text, "green"));
    assert_float_equal(back.sine_most, 0.25, 0);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_saved_comes_back_to_the_last_digit),
        cmocka_unit_test(a_gain_that_cannot_be_names_the_file),
    };
    return cmocka_run_group_tests_name("view file", tests, NULL, NULL);
}
