// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <math.h>

#include "files/table.h"
#include "files/text.h"
#include "tests/files/place.h"

static struct table good(const char *text, size_t columns, size_t rows)
{
    struct table t;
    struct error err = {0};
    if (!csv_parse("t.csv", text, strlen(text), &t, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_int_equal(t.columns, columns);
    assert_int_equal(t.rows, rows);
    return t;
}

static void bad(const char *text, const char *expected)
{
    struct table t;
    struct error err = {0};
    memset(&t, 0x55, sizeof t);
    assert_false(csv_parse("t.csv", text, strlen(text), &t, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_string_equal(err.text, expected);
    assert_null(t.values);
    assert_null(t.names);
    table_fini(&t);
}

static void a_header_names_the_columns(void **state)
{
    (void)state;
    struct table t = good("nm,dark skin,\"a, b\"\n380,0.5,1\n390,-1e-3,2\n", 3, 2);
    assert_string_equal(t.names[0], "nm");
    assert_int_equal(table_column(&t, "dark skin"), 1);
    assert_int_equal(table_column(&t, "a, b"), 2);
    assert_int_equal(table_column(&t, "c"), -1);
    assert_true(table_at(&t, 1, 1) == -1e-3);
    assert_int_equal(t.lines[1], 3);
    assert_null(t.labels);
    table_fini(&t);
    table_fini(&t);
}

static void the_header_is_optional(void **state)
{
    (void)state;
    struct table t = good("380,0.5\n390,.25", 2, 2);
    assert_string_equal(t.names[0], "");
    assert_string_equal(t.names[1], "");
    assert_true(table_at(&t, 0, 0) == 380 && table_at(&t, 1, 1) == 0.25);
    table_fini(&t);
}

static void names_that_begin_like_nan_and_inf_are_names(void **state)
{
    (void)state;
    struct table t = good("nanometres,infrared\n380,1\n", 2, 1);
    assert_string_equal(t.names[0], "nanometres");
    table_fini(&t);
}

static void every_separator_and_line_end_gives_the_same_table(void **state)
{
    (void)state;
    static const char *const SAME[] = {
        "nm,E\n380,1\n390,2\n",
        "nm;E\n380;1\n390;2\n",
        "nm\tE\n380\t1\n390\t2\n",
        "nm E\n380 1\n390 2\n",
        "nm E\n380\t1\n390 \t2\t\n",
        "nm\tE\n380 \t 1\n 390\t2\n",
        "  nm   E  \n  380     1\n390 \t 2  ",
        "nm,E\r\n380,1\r\n390,2\r\n",
        "nm,E\r380,1\r390,2\r",
        "\xef\xbb\xbfnm,E\n380,1\n390,2\n",
        "# a lamp\n\nnm , E\n  # noon\n380 , 1\n\n   \n390, 2\n#end",
        "\"nm\",\"E\"\n\"380\",1\n390,\"2\"",
        "nm;E\n+380;1e0\n3.9e2;2.\n",
    };
    for (size_t i = 0; i < sizeof SAME / sizeof *SAME; i++) {
        struct table t = good(SAME[i], 2, 2);
        assert_string_equal(t.names[0], "nm");
        assert_string_equal(t.names[1], "E");
        const double values[] = {380, 1, 390, 2};
        assert_memory_equal(t.values, values, sizeof values);
        table_fini(&t);
    }
}

static void lines_are_counted_through_comments_and_every_line_end(void **state)
{
    (void)state;
    struct table t = good("# 1\r\n# 2\r\n\n380 1\r390 2\r\n400 3", 2, 3);
    assert_int_equal(t.lines[0], 4);
    assert_int_equal(t.lines[1], 5);
    assert_int_equal(t.lines[2], 6);
    table_fini(&t);
}

static void decimal_commas_are_refused(void **state)
{
    (void)state;
    bad("nm;E\n380;0,5\n", "t.csv:2: column 2 (E): \"0,5\" has a decimal comma; allowed: a number "
                           "with a decimal point");
    bad("380,5;0,5\n", "t.csv:1: column 1: \"380,5\" has a decimal comma; allowed: a number with a "
                       "decimal point");
    bad("380\t-1,5e-3\n", "t.csv:1: column 2: \"-1,5e-3\" has a decimal comma; allowed: a number "
                          "with a decimal point");
    bad("nm E\n380 0,5\n", "t.csv:2: column 2 (E): \"0,5\" has a decimal comma; allowed: a number "
                           "with a decimal point");
    bad("nm,E\n380,0,5\n", "t.csv:2: row has at least 3 cells; allowed: 2, as in the first line");
}

static void what_may_be_the_end_of_a_decimal_comma_is_refused(void **state)
{
    (void)state;
    bad("nm,l,m\n380,1,00\n", "t.csv:2: column 3: \"00\" may be a number of its own or what follows "
                              "a decimal comma (\",00\"); allowed: a decimal point, no zero before "
                              "other digits");
    struct table t = good("nm;l;m\n380;0;00\n", 3, 1);
    table_fini(&t);
    t = good("nm,l,m\n0380,0,0.05\n", 3, 1);
    table_fini(&t);
}

static void what_is_not_finite_is_refused(void **state)
{
    (void)state;
    bad("nm,E\n380,nan\n",
        "t.csv:2: column 2 (E): \"nan\" is not finite; allowed: a finite number");
    bad("nm,E\n380,1\n390,-Inf\n",
        "t.csv:3: column 2 (E): \"-Inf\" is not finite; allowed: a finite number");
    bad("nan,1\n", "t.csv:1: column 1: \"nan\" is not finite; allowed: a finite number");
    bad("380,1e999\n", "t.csv:1: column 2: \"1e999\" is not finite; allowed: a finite number");
    bad("380,infinity\n",
        "t.csv:1: column 2: \"infinity\" is not finite; allowed: a finite number");
}

static void huge_and_tiny_numbers_that_a_double_holds_are_kept(void **state)
{
    (void)state;
    struct table t =
        good("1.7976931348623157e308 4.9e-324 1e-400 123456789012345678901234567890", 4, 1);
    assert_true(table_at(&t, 0, 0) == 1.7976931348623157e308);
    assert_true(table_at(&t, 0, 1) == 4.9e-324);
    assert_true(table_at(&t, 0, 2) == 0);
    table_fini(&t);
}

static void what_is_no_number_is_refused_with_its_place(void **state)
{
    (void)state;
    bad("nm,E\n380nm,1\n",
        "t.csv:2: column 1 (nm): \"380nm\" is not a number; allowed: a finite number");
    bad("nm,E\n0x10,1\n",
        "t.csv:2: column 1 (nm): \"0x10\" is not a number; allowed: a finite number");
    bad("nm,E\n380,\n", "t.csv:2: column 2 (E): \"\" is empty; allowed: a finite number");
    bad("nm,E\n,1\n", "t.csv:2: column 1 (nm): \"\" is empty; allowed: a finite number");
    bad("nm,E\n380,1 2\n",
        "t.csv:2: column 2 (E): \"1 2\" is not a number; allowed: a finite number");
    bad("nm,E\n380,--1\n",
        "t.csv:2: column 2 (E): \"--1\" is not a number; allowed: a finite number");
    bad("nm,E\nnm,E\n", "t.csv:2: column 1 (nm): \"nm\" is not a number; allowed: a finite number");
    bad("380nm,1\n", "t.csv:1: column 1: \"380nm\" is not a number; allowed: a finite number");
}

static void ragged_rows_are_refused(void **state)
{
    (void)state;
    bad("nm,E\n380\n", "t.csv:2: row has 1 cells; allowed: 2, as in the first line");
    bad("1 2 3\n1 2 3\n1 2\n", "t.csv:3: row has 2 cells; allowed: 3, as in the first line");
    bad("1 2\n1 2 3\n", "t.csv:2: row has at least 3 cells; allowed: 2, as in the first line");
    bad("1,2,3\n4,5,6,\n", "t.csv:2: row has at least 4 cells; allowed: 3, as in the first line");
}

static void a_file_without_numbers_is_refused(void **state)
{
    (void)state;
    bad("", "t.csv: holds no row of numbers");
    bad("\n\n# nothing\n", "t.csv: holds no row of numbers");
    bad("nm,E\n", "t.csv: holds no row of numbers");
    bad("\xef\xbb\xbf", "t.csv: holds no row of numbers");
}

static void quotes_are_closed_on_their_line(void **state)
{
    (void)state;
    bad("\"nm,E\n380,1\n", "t.csv:1: a quote is not closed");
    bad("\"nm\"x,E\n380,1\n", "t.csv:1: text after a closing quote");
}

static void bytes_that_are_no_text_show_as_question_marks(void **state)
{
    (void)state;
    bad("nm,E\n380,\x01\xff\n", "t.csv:2: column 2 (E): \"??\" is not a number; allowed: a finite "
                                "number");
    bad("nm,\xe4\n380,1\n", "t.csv:1: column 2: name \"?\" is not UTF-8 text");
    struct table t;
    struct error err = {0};
    assert_false(csv_parse("t.csv", "380,1\0\n", 7, &t, &err));
    assert_string_equal(err.text,
                        "t.csv:1: column 2: \"1?\" is not a number; allowed: a finite number");
    t = good("nm,\xc2\xb5W\n380,1\n", 2, 1);
    assert_string_equal(t.names[1], "\xc2\xb5W");
    table_fini(&t);
}

static void an_endless_cell_gives_a_short_error(void **state)
{
    (void)state;
    char *text = malloc(100001);
    memset(text, '9', 100000);
    text[100000] = 0;
    bad(text, "t.csv:1: column 1: \"9999999999999999999999999999999999999...\" is not a number; "
              "allowed: a finite number");
    memset(text, 'x', 100000);
    text[99990] = '\n';
    bad(text, "t.csv:2: column 1 (xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...): \"xxxxxxxxx\" is not "
              "a number; allowed: a finite number");
    free(text);
}

static void too_many_columns_are_refused(void **state)
{
    (void)state;
    char *text = malloc(2 * 65537 + 1);
    for (int i = 0; i < 65537; i++)
        memcpy(text + 2 * i, "1,", 2);
    text[2 * 65537 - 1] = 0;
    bad(text, "t.csv:1: more than 65536 columns");
    text[2 * 65536 - 1] = 0;
    struct table t = good(text, 65536, 1);
    table_fini(&t);
    free(text);
}

static void a_missing_file_and_a_folder_are_named(void **state)
{
    (void)state;
    struct table t;
    struct error err = {0};
    assert_false(csv_load(at("none.csv"), &t, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_complaint(err.text, "none.csv: cannot be read: No such file or directory");
    assert_false(csv_load(place, &t, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "Is a directory"));
    assert_false(csv_load(at("none.csv"), &t, NULL));
}

static void an_error_in_a_file_names_the_file(void **state)
{
    (void)state;
    struct table t;
    struct error err = {0};
    assert_false(csv_load(put_text("a.csv", "1 2\n3 x\n"), &t, &err));
    assert_complaint(err.text,
                     "a.csv:2: column 2: \"x\" is not a number; allowed: a finite number");
    assert_true(csv_load(put_text("b.csv", "1 2\n3 4\n"), &t, &err));
    assert_string_equal(t.path, at("b.csv"));
    table_fini(&t);
}

static void a_text_ends_with_what_it_is_longer_than(void **state)
{
    (void)state;
    assert_true(text_ends_with("lamp.csv", ".csv") && text_ends_with("LAMP.CSV", ".csv"));
    assert_false(text_ends_with(".csv", ".csv") || text_ends_with("lamp.csv ", ".csv"));
    assert_false(text_ends_with("", ".csv") || text_ends_with("sv", ".csv"));
}

static void real_lamps_and_reflectances_load(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        size_t columns, rows;
    } REAL[] = {{"lamps/Philips.FT.TLD.36W.965.csv", 2, 501},
                {"lamps/Philips.Inc.50W.spot.halogen.csv", 2, 823},
                {"reflectances/sur_macbeth.csv", 25, 81},
                {"reflectances/sur_nickerson.csv", 463, 81},
                {"cie/cmf_xyz_1931_2deg_1nm.csv", 4, 471}};
    for (size_t i = 0; i < sizeof REAL / sizeof *REAL; i++) {
        struct table t;
        const char *path = shared_file(REAL[i].name);
        assert_true(csv_load(path, &t, NULL));
        assert_int_equal(t.columns, REAL[i].columns);
        assert_int_equal(t.rows, REAL[i].rows);
        table_fini(&t);
    }
    const char *commas = shared_file("spectrometer/OO_comma.txt");
    struct table t;
    assert_false(csv_load(commas, &t, NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_header_names_the_columns),
        cmocka_unit_test(the_header_is_optional),
        cmocka_unit_test(names_that_begin_like_nan_and_inf_are_names),
        cmocka_unit_test(every_separator_and_line_end_gives_the_same_table),
        cmocka_unit_test(lines_are_counted_through_comments_and_every_line_end),
        cmocka_unit_test(decimal_commas_are_refused),
        cmocka_unit_test(what_may_be_the_end_of_a_decimal_comma_is_refused),
        cmocka_unit_test(what_is_not_finite_is_refused),
        cmocka_unit_test(huge_and_tiny_numbers_that_a_double_holds_are_kept),
        cmocka_unit_test(what_is_no_number_is_refused_with_its_place),
        cmocka_unit_test(ragged_rows_are_refused),
        cmocka_unit_test(a_file_without_numbers_is_refused),
        cmocka_unit_test(quotes_are_closed_on_their_line),
        cmocka_unit_test(bytes_that_are_no_text_show_as_question_marks),
        cmocka_unit_test(an_endless_cell_gives_a_short_error),
        cmocka_unit_test(too_many_columns_are_refused),
        cmocka_unit_test(a_missing_file_and_a_folder_are_named),
        cmocka_unit_test(an_error_in_a_file_names_the_file),
        cmocka_unit_test(a_text_ends_with_what_it_is_longer_than),
        cmocka_unit_test(real_lamps_and_reflectances_load),
    };
    return cmocka_run_group_tests_name("table", tests, open_place, close_place);
}
