// SPDX-License-Identifier: Apache-2.0
// The command line of the emulated spotread and the files that it leaves.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "files/cgats.h"
#include "simulator/model_spotread.h"
#include "simulator/spotread_options.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/fakes/folder.h"
#include "tests/fakes/near.h"

#include "tests/simulator/spotread_here.h"

#define PRINTED 1e-6 // relative: six digits and more

static struct folder folder;

static int fresh_with_folder(void **state)
{
    folder_open(&folder);
    return fresh(state);
}

static int gone_with_folder(void **state)
{
    gone(state);
    folder_close(&folder);
    return 0;
}

static bool parse(const char *line, struct spotread_options *o, char why[128])
{
    static char words[256];
    char *argv[16];
    int argc = 0;
    strcpy(words, line);
    for (char *rest = words, *word; (word = strtok_r(rest, " ", &rest));)
        argv[argc++] = word;
    return spotread_options(o, argc, argv, why);
}

static void values_stand_beside_their_option_or_apart(void **state)
{
    (void)state;
    struct spotread_options o;
    char why[128];
    assert_true(parse("-v -e -s -N -c1 -y l -Q 1964_10 -X panel.ccss log.txt", &o, why));
    assert_true(o.verbose && o.spectrum && o.no_calibration && !o.one);
    assert_int_equal(o.port, 1);
    assert_int_equal(o.display_type, 'l');
    assert_int_equal(o.observer, OBSERVER_1964_10);
    assert_string_equal(o.correction, "panel.ccss");
    assert_string_equal(o.log_path, "log.txt");
    assert_true(parse("-O one.sp -x", &o, why));
    assert_string_equal(o.one_path, "one.sp");
    assert_int_equal(o.form, SPOTREAD_YXY);
    assert_true(parse("-O -e", &o, why)); // the next word is an option
    assert_null(o.one_path);
}

static void what_it_does_not_know_it_refuses(void **state)
{
    (void)state;
    static const char *const lines[] = {"-Z", "-", "-c", "-c 99", "-Q nobody", "-eb", "-t", "--"};
    struct spotread_options o;
    char why[128];
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
        if (parse(lines[i], &o, why)) {
            print_error("%s was taken\n", lines[i]);
            _fail(__FILE__, __LINE__);
        }
    start(SPOTREAD_SPECBOS, "-Z");
    assert_says(listen(), "usage: spotread");
    assert_int_equal(spotread_status(spotread), 1);
}

static void expect_spectrum(const char *path, size_t bands)
{
    struct cgats file = {0};
    struct error err = {0};
    double count, first, last;
    if (!cgats_load_as(path, "SPECT", &file, &err))
        fail_msg("%s", err.text);
    assert_true(cgats_numbers(&file, "SPECTRAL_BANDS", &count, 1, &err));
    assert_true(cgats_numbers(&file, "SPECTRAL_START_NM", &first, 1, &err));
    assert_true(cgats_numbers(&file, "SPECTRAL_END_NM", &last, 1, &err));
    assert_int_equal((size_t)count, bands);
    assert_near(first, 380, 0);
    assert_int_equal(file.table.columns, bands);
    assert_int_equal(file.table.rows, 1);
    assert_string_equal(file.table.names[0], "SPEC_380");
    assert_near(table_at(&file.table, 0, 10), 2, 0.05); // mW m-2 sr-1 nm-1
    cgats_fini(&file);
}

static void s_saves_the_last_spectrum_under_the_name_that_is_typed(void **state)
{
    (void)state;
    const char *path = folder_at(&folder, "one.sp");
    start(SPOTREAD_SPECBOS, "-e");
    listen();
    press(' ');
    assert_says(press('s'), "\nEnter filename (ie. xxxx.sp): ");
    assert_int_equal(wants(), SPOTREAD_LINE);
    spotread_line(spotread, now_ns, path);
    assert_says(listen(), "' succeeded\n");
    expect_spectrum(path, 401);
    press('s');
    spotread_line(spotread, now_ns, "/nowhere/one.sp");
    assert_says(listen(), "' failed\n");
    press('s');
    spotread_line(spotread, now_ns, "");
    assert_says(listen(), "nothing saved\n");
}

static void once_it_needs_no_key_and_leaves_a_file(void **state)
{
    (void)state;
    char line[300];
    const char *path = folder_at(&folder, "once.sp");
    snprintf(line, sizeof line, "-N -O %s", path);
    start(SPOTREAD_I1PRO, line);
    assert_says(listen(), "\n Result is XYZ: ");
    assert_int_equal(wants(), SPOTREAD_END);
    assert_int_equal(spotread_status(spotread), 0);
    expect_spectrum(path, 36);
}

static void every_reading_is_a_row_of_the_log(void **state)
{
    (void)state;
    char line[300];
    struct table table = {0};
    struct error err = {0};
    const char *path = folder_at(&folder, "log.txt");
    snprintf(line, sizeof line, "-s %s", path);
    start(SPOTREAD_SPECBOS, line);
    listen();
    double Y[2];
    for (int i = 0; i < 2; i++)
        assert_int_equal(sscanf(strstr(press(' '), "XYZ: "), "XYZ: %*f %lf", &Y[i]), 1);
    if (!csv_load(path, &table, &err))
        fail_msg("%s", err.text);
    assert_int_equal(table.rows, 2);
    assert_int_equal(table.columns, 7 + 401);
    assert_string_equal(table.names[2], "Y");
    for (size_t i = 0; i < 2; i++) {
        assert_near(table_at(&table, i, 0), (double)i + 1, 0);
        assert_near(table_at(&table, i, 2) / Y[i], 1, PRINTED);
    }
    table_fini(&table);
}

#define IN_FOLDER(test) cmocka_unit_test_setup_teardown(test, fresh_with_folder, gone_with_folder)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH(values_stand_beside_their_option_or_apart),
        WITH(what_it_does_not_know_it_refuses),
        IN_FOLDER(s_saves_the_last_spectrum_under_the_name_that_is_typed),
        IN_FOLDER(once_it_needs_no_key_and_leaves_a_file),
        IN_FOLDER(every_reading_is_a_row_of_the_log),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
