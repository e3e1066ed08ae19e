// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <math.h>

#include "files/cgats.h"
#include "tests/files/place.h"

static const char EXAMPLE[] = "CTI3   \n"
                              "\n"
                              "DESCRIPTOR \"a \"\"good\"\" panel\" # its name\n"
                              "KEYWORD \"LUMINANCE_XYZ_CDM2\"\n"
                              "LUMINANCE_XYZ_CDM2 \"95.1 100 108.25\"\n"
                              "NORMALIZED_TO_Y_100 NO\n"
                              "\n"
                              "BEGIN_ARGYLL_COLPROF_ARGS\n"
                              "-v -C \"No copyright NUMBER_OF_SETS 7\n"
                              "END_ARGYLL_COLPROF_ARGS\n"
                              "\n"
                              "NUMBER_OF_FIELDS 5\n"
                              "BEGIN_DATA_FORMAT\n"
                              "SAMPLE_ID SAMPLE_LOC\n"
                              "RGB_R\tRGB_G RGB_B\n"
                              "END_DATA_FORMAT\n"
                              "\n"
                              "NUMBER_OF_SETS 3\n"
                              "BEGIN_DATA\n"
                              "1 \"A 1\" 0 50 100\n"
                              "2 \"A2\" 1e1\n"
                              "  60.5 -1\n"
                              "\"3 b\" A3 1 2 3 # last\n"
                              "END_DATA\n";

static void good(const char *text, struct cgats *file)
{
    struct error err = {0};
    if (!cgats_load(put_text("a.ti3", text), file, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
}

static void bad(const char *text, const char *expected)
{
    struct cgats file;
    struct error err = {0};
    memset(&file, 0x55, sizeof file);
    assert_false(cgats_load(put_text("a.ti3", text), &file, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_complaint(err.text, expected);
    assert_null(file.keywords);
    assert_null(file.table.values);
    cgats_fini(&file);
}

// The example with its only "from" replaced.
static const char *edited(const char *from, const char *to)
{
    static char text[4096];
    const char *place_of = strstr(EXAMPLE, from);
    assert_non_null(place_of);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(place_of - EXAMPLE), EXAMPLE, to,
             place_of + strlen(from));
    return text;
}

static void an_example_is_read_as_it_stands(void **state)
{
    (void)state;
    struct cgats file;
    good(EXAMPLE, &file);
    const struct table *t = &file.table;
    assert_string_equal(file.identifier, "CTI3");
    assert_string_equal(cgats_keyword(&file, "DESCRIPTOR"), "a \"good\" panel");
    assert_string_equal(cgats_keyword(&file, "NORMALIZED_TO_Y_100"), "NO");
    assert_null(cgats_keyword(&file, "NUMBER_OF_SETS"));
    assert_null(cgats_keyword(&file, "KEYWORD"));
    assert_int_equal(cgats_line(&file, "DESCRIPTOR"), file.keywords[0].line);
    assert_int_equal(cgats_line(&file, "NUMBER_OF_SETS"), 0);
    assert_int_equal(file.keyword_count, 3);
    assert_int_equal(file.keywords[1].line, 5);
    assert_int_equal(t->columns, 5);
    assert_int_equal(t->rows, 3);
    assert_int_equal(table_column(t, "RGB_B"), 4);
    assert_true(isnan(table_at(t, 0, 0)) && isnan(table_at(t, 0, 1)));
    assert_true(table_at(t, 1, 2) == 10 && table_at(t, 1, 3) == 60.5 && table_at(t, 1, 4) == -1);
    assert_string_equal(t->labels[0], "1");
    assert_string_equal(t->labels[2], "3 b");
    assert_int_equal(t->lines[1], 21);
    assert_int_equal(t->lines[2], 23);
    cgats_fini(&file);
    cgats_fini(&file);
}

static void line_ends_and_a_mark_change_nothing(void **state)
{
    (void)state;
    char text[2 * sizeof EXAMPLE] = "\xef\xbb\xbf", *to = text + 3;
    for (const char *from = EXAMPLE; *from; from++) {
        if (*from == '\n')
            *to++ = '\r';
        *to++ = *from;
    }
    struct cgats file;
    good(text, &file);
    assert_int_equal(file.table.rows, 3);
    assert_string_equal(cgats_keyword(&file, "DESCRIPTOR"), "a \"good\" panel");
    cgats_fini(&file);
}

static void lines_may_end_in_carriage_returns_alone(void **state)
{
    (void)state;
    struct cgats file;
    char text[sizeof EXAMPLE];
    strcpy(text, EXAMPLE);
    for (char *c = text; *c; c++)
        *c = *c == '\n' ? '\r' : *c;
    good(text, &file);
    assert_int_equal(file.table.rows, 3);
    assert_string_equal(cgats_keyword(&file, "DESCRIPTOR"), "a \"good\" panel");
    cgats_fini(&file);
    char *change = strstr(text, "60.5");
    memcpy(change, "60,5", 4);
    bad(text, "a.ti3:22: field RGB_G: \"60,5\" has a decimal comma; allowed: a number with a decimal "
              "point");
}

// Ten million would take days, were each looked for from the start.
static void many_bytes_that_are_no_text_take_no_longer(void **state)
{
    (void)state;
    enum { MANY = 10 << 20 };
    static const char HEAD[] = "CTI3\nDESCRIPTOR \"", TAIL[] = "\"\nBEGIN_DATA_FORMAT\nX\n"
                                                            "END_DATA_FORMAT\nBEGIN_DATA\n1\n"
                                                            "END_DATA\n";
    char *text = malloc(MANY + sizeof HEAD + sizeof TAIL);
    size_t used = sizeof HEAD - 1;
    memcpy(text, HEAD, used);
    memset(text + used, 0xe9, MANY);
    memcpy(text + used + MANY, TAIL, sizeof TAIL);
    struct cgats file;
    struct error err = {0};
    assert_true(cgats_load(put_text("a.ti3", text), &file, &err));
    const char *value = cgats_keyword(&file, "DESCRIPTOR");
    assert_int_equal(strlen(value), MANY);
    assert_int_equal(strspn(value, "?"), MANY);
    cgats_fini(&file);
    free(text);
}

static void all_cells_may_stand_on_one_line_or_on_one_each(void **state)
{
    (void)state;
    struct cgats file;
    good("SPECT\nNUMBER_OF_FIELDS 2\nBEGIN_DATA_FORMAT A B END_DATA_FORMAT\nNUMBER_OF_SETS 2\n"
         "BEGIN_DATA 1 2 3 4 END_DATA",
         &file);
    assert_true(table_at(&file.table, 1, 0) == 3);
    assert_null(file.table.labels);
    cgats_fini(&file);
    good("SPECT\nBEGIN_DATA_FORMAT\nA\nB\nEND_DATA_FORMAT\nBEGIN_DATA\n1\n2\n3\n4\nEND_DATA\n",
         &file);
    assert_true(table_at(&file.table, 1, 1) == 4);
    cgats_fini(&file);
}

static void a_name_is_the_label_where_there_is_no_id(void **state)
{
    (void)state;
    struct cgats file;
    good("CTI3\nBEGIN_DATA_FORMAT\nA SAMPLE_NAME\nEND_DATA_FORMAT\nBEGIN_DATA\n1 \"dark skin\"\n"
         "2 red\nEND_DATA\n",
         &file);
    assert_string_equal(file.table.labels[0], "dark skin");
    assert_string_equal(file.table.labels[1], "red");
    cgats_fini(&file);
}

static void later_tables_are_checked_and_left_out(void **state)
{
    (void)state;
    char text[4096];
    struct cgats file;
    const char *cal = "CAL\n\nDEVICE_CLASS \"DISPLAY\"\nNUMBER_OF_FIELDS 2\nBEGIN_DATA_FORMAT\n"
                      "RGB_I RGB_R\nEND_DATA_FORMAT\nNUMBER_OF_SETS 1\nBEGIN_DATA\n0 0\nEND_DATA\n";
    snprintf(text, sizeof text, "%s%s", EXAMPLE, cal);
    good(text, &file);
    assert_int_equal(file.table.rows, 3);
    assert_null(cgats_keyword(&file, "DEVICE_CLASS"));
    cgats_fini(&file);
    strstr(text, "\n0 0\n")[3] = 'x';
    bad(text, "a.ti3:34: field RGB_R: \"x\" is not a number; allowed: a finite number");
    snprintf(text, sizeof text, "%sCAL\n", EXAMPLE);
    bad(text, "a.ti3:26: the file ends before BEGIN_DATA");
    snprintf(
        text, sizeof text, "%.*s%s", 0, "",
        "SPECT\nBEGIN_DATA_FORMAT A END_DATA_FORMAT\n"
        "BEGIN_DATA 1 END_DATA\nCAL\nBEGIN_DATA_FORMAT A END_DATA_FORMAT\nBEGIN_DATA 1 END_DATA\n");
    bad(text, "a.ti3:4: a second table; allowed: one in a SPECT file");
}

static void a_missing_identifier_is_refused(void **state)
{
    (void)state;
    bad("", "a.ti3:1: the file ends before an identifier");
    bad("# nothing\n\n", "a.ti3:3: the file ends before an identifier");
    bad("DESCRIPTOR \"x\"\n",
        "a.ti3:1: \"DESCRIPTOR\"; allowed: an identifier such as CTI3 or SPECT "
        "on its own line");
    bad("380,1\n390,2\n", "a.ti3:1: \"380,1\"; allowed: an identifier such as CTI3 or SPECT on its "
                          "own line");
    bad("\"CTI3\"\n", "a.ti3:1: \"CTI3\"; allowed: an identifier such as CTI3 or SPECT on its own "
                      "line");
    bad("BEGIN_DATA\n", "a.ti3:1: \"BEGIN_DATA\"; allowed: an identifier such as CTI3 or SPECT on "
                        "its own line");
}

static void another_identifier_than_the_wanted_one_is_refused(void **state)
{
    (void)state;
    struct cgats file;
    struct error err = {0};
    put_text("a.ti3", EXAMPLE);
    assert_false(cgats_load_as(at("a.ti3"), "SPECT", &file, &err));
    assert_complaint(err.text, "a.ti3:1: identifier \"CTI3\"; allowed: SPECT");
    assert_null(file.keywords);
    assert_true(cgats_load_as(at("a.ti3"), "CTI3", &file, &err));
    cgats_fini(&file);
}

static void a_number_of_fields_that_contradicts_the_fields_is_refused(void **state)
{
    (void)state;
    bad(edited("NUMBER_OF_FIELDS 5", "NUMBER_OF_FIELDS 4"),
        "a.ti3:12: NUMBER_OF_FIELDS: 4 contradicts the 5 fields that line 13 names");
    bad(edited("RGB_R\tRGB_G RGB_B", "RGB_R RGB_G"),
        "a.ti3:12: NUMBER_OF_FIELDS: 5 contradicts the 4 fields that line 13 names");
    bad(edited("NUMBER_OF_FIELDS 5", "NUMBER_OF_FIELDS five"),
        "a.ti3:12: NUMBER_OF_FIELDS: \"five\"; allowed: a whole number 1..4096");
    bad(edited("NUMBER_OF_FIELDS 5", "NUMBER_OF_FIELDS 5\nNUMBER_OF_FIELDS 5"),
        "a.ti3:13: NUMBER_OF_FIELDS: given a second time; allowed: once");
}

static void a_number_of_sets_that_contradicts_the_rows_is_refused(void **state)
{
    (void)state;
    bad(edited("NUMBER_OF_SETS 3", "NUMBER_OF_SETS 2"),
        "a.ti3:18: NUMBER_OF_SETS: 2 contradicts the 3 rows of the data; rows leave their lines at "
        "line 22");
    bad(edited("NUMBER_OF_SETS 3", "NUMBER_OF_SETS 1e9"),
        "a.ti3:18: NUMBER_OF_SETS: \"1e9\"; allowed: a whole number 1..100000000");
    bad(edited("NUMBER_OF_SETS 3", "NUMBER_OF_SETS -3"),
        "a.ti3:18: NUMBER_OF_SETS: \"-3\"; allowed: a whole number 1..100000000");
    bad(edited("NUMBER_OF_SETS 3", "NUMBER_OF_SETS 2.5"),
        "a.ti3:18: NUMBER_OF_SETS: \"2.5\"; allowed: a whole number 1..100000000");
}

static void rows_with_a_cell_too_few_or_too_many_are_refused_with_their_line(void **state)
{
    (void)state;
    bad("CTI3\nBEGIN_DATA_FORMAT\nA B\nEND_DATA_FORMAT\nBEGIN_DATA\n1 2\n3\n5 6\nEND_DATA\n",
        "a.ti3:9: BEGIN_DATA..END_DATA holds 5 cells, which is not a multiple of the 2 fields; "
        "rows "
        "leave their lines at line 8");
    bad("CTI3\nBEGIN_DATA_FORMAT\nA B\nEND_DATA_FORMAT\nBEGIN_DATA\n1 2\n3 4 5\nEND_DATA\n",
        "a.ti3:8: BEGIN_DATA..END_DATA holds 5 cells, which is not a multiple of the 2 fields; "
        "rows "
        "leave their lines at line 7");
    bad("CTI3\nBEGIN_DATA_FORMAT\nA B\nEND_DATA_FORMAT\nBEGIN_DATA\nEND_DATA\n",
        "a.ti3:6: BEGIN_DATA..END_DATA holds no row");
}

static void a_field_given_twice_or_none_at_all_is_refused(void **state)
{
    (void)state;
    bad(edited("RGB_G RGB_B", "RGB_R RGB_B"),
        "a.ti3:15: field RGB_R: given a second time; allowed: once");
    bad("CTI3\nBEGIN_DATA_FORMAT\nEND_DATA_FORMAT\n", "a.ti3:2: BEGIN_DATA_FORMAT: names no field");
    bad("CTI3\nBEGIN_DATA\n1\nEND_DATA\n", "a.ti3:2: BEGIN_DATA: stands before BEGIN_DATA_FORMAT");
    bad("CTI3\nBEGIN_DATA_FORMAT\n1 2\nEND_DATA_FORMAT\n", "a.ti3:3: \"1\" is no field name");
}

static void a_cell_that_is_no_finite_number_is_refused_with_its_field(void **state)
{
    (void)state;
    bad(edited("60.5", "nan"), "a.ti3:22: field RGB_G: \"nan\" is not finite; allowed: a finite "
                               "number");
    bad(edited("60.5", "60,5"), "a.ti3:22: field RGB_G: \"60,5\" has a decimal comma; allowed: a "
                                "number with a decimal point");
    bad(edited("60.5", "1e999"),
        "a.ti3:22: field RGB_G: \"1e999\" is not finite; allowed: a finite "
        "number");
    bad(edited("60.5", "\"\""), "a.ti3:22: field RGB_G: \"\" is empty; allowed: a finite number");
    bad(edited("60.5", "END"), "a.ti3:22: field RGB_G: \"END\" is not a number; allowed: a finite "
                               "number");
}

static void a_keyword_has_one_value_on_its_line(void **state)
{
    (void)state;
    bad(edited("NORMALIZED_TO_Y_100 NO", "NORMALIZED_TO_Y_100"),
        "a.ti3:6: NORMALIZED_TO_Y_100: has no value; allowed: one value on its line");
    bad(edited("NORMALIZED_TO_Y_100 NO", "CREATED Sun Nov"),
        "a.ti3:6: CREATED: more than one value; allowed: one (in quotes if it has blanks)");
    bad(edited("NORMALIZED_TO_Y_100 NO", "DESCRIPTOR \"other\""),
        "a.ti3:6: DESCRIPTOR: \"other\" contradicts line 3");
    bad(edited("NORMALIZED_TO_Y_100 NO", "DESCRIPTOR \"other"),
        "a.ti3:6: a quote is not closed on its line");
    bad(edited("NORMALIZED_TO_Y_100 NO", "\"NAME\" 1"),
        "a.ti3:6: \"NAME\"; allowed: a keyword and its value");
    bad(edited("NORMALIZED_TO_Y_100 NO", "END_DATA 1"),
        "a.ti3:6: \"END_DATA\"; allowed: a keyword and its value");
    struct cgats file;
    good(edited("NORMALIZED_TO_Y_100 NO", "NORMALIZED_TO_Y_100 NO\nNORMALIZED_TO_Y_100 \"NO\""),
         &file);
    cgats_fini(&file);
}

static void a_file_that_ends_early_says_before_what(void **state)
{
    (void)state;
    bad("CTI3\n", "a.ti3:2: the file ends before BEGIN_DATA");
    bad(edited("END_DATA\n", ""), "a.ti3:24: the file ends before END_DATA");
    bad("CTI3\nBEGIN_DATA_FORMAT\nA B", "a.ti3:3: the file ends before END_DATA_FORMAT");
    bad(edited("END_ARGYLL_COLPROF_ARGS", "END_ARGYLL"),
        "a.ti3:8: BEGIN_ARGYLL_COLPROF_ARGS: the file ends before its END");
}

static void bytes_that_are_no_text_are_told(void **state)
{
    (void)state;
    struct cgats file;
    struct error err = {0};
    assert_false(cgats_load(put("a.ti3", "CTI3\nA\0B", 8), &file, &err));
    assert_complaint(err.text, "a.ti3:2: byte 0x00 is not text");
    good(edited("panel\"", "\xa9 panel\""), &file);
    assert_string_equal(cgats_keyword(&file, "DESCRIPTOR"), "a \"good\" ? panel");
    cgats_fini(&file);
}

static void a_keyword_of_numbers_is_read_exactly(void **state)
{
    (void)state;
    struct cgats file;
    struct error err = {0};
    double white[3], y;
    good(EXAMPLE, &file);
    assert_true(cgats_numbers(&file, "LUMINANCE_XYZ_CDM2", white, 3, &err));
    assert_true(white[0] == 95.1 && white[1] == 100 && white[2] == 108.25);
    assert_false(cgats_numbers(&file, "LUMINANCE_XYZ_CDM2", &y, 1, &err));
    assert_complaint(err.text,
                     "a.ti3:5: LUMINANCE_XYZ_CDM2: \"95.1 100 108.25\"; allowed: 1 finite number");
    assert_false(cgats_numbers(&file, "NORMALIZED_TO_Y_100", white, 1, &err));
    assert_complaint(err.text, "a.ti3:6: NORMALIZED_TO_Y_100: \"NO\"; allowed: 1 finite number");
    assert_false(cgats_numbers(&file, "SPECTRAL_BANDS", white, 1, &err));
    assert_complaint(err.text, "a.ti3: SPECTRAL_BANDS is missing; it must give 1 finite number");
    cgats_fini(&file);
}

static void what_is_saved_loads_to_the_same_bits(void **state)
{
    (void)state;
    char *names[] = {(char[]){"RGB_R"}, (char[]){"SPEC_400"}};
    char *labels[] = {(char[]){"1"}, (char[]){"a \"b\" #c"}, (char[]){"END_DATA"}};
    double values[] = {0.1, 1.0 / 3, -5e-324, 1.7976931348623157e308, 100, 123456.789};
    struct cgats_keyword keywords[] = {{(char[]){"DESCRIPTOR"}, (char[]){"say \"hi\" # no"}, 0},
                                       {(char[]){"COLOR_REP"}, (char[]){""}, 0}};
    struct cgats file = {.identifier = "CTI3",
                         .keyword_count = 2,
                         .keywords = keywords,
                         .table = {.columns = 2,
                                   .rows = 3,
                                   .names = names,
                                   .values = values,
                                   .labels = labels}},
                 back, twice;
    struct error err = {0};
    assert_true(cgats_save(at("b.ti3"), &file, &err));
    assert_true(cgats_load(at("b.ti3"), &back, &err));
    assert_string_equal(cgats_keyword(&back, "DESCRIPTOR"), "say \"hi\" # no");
    assert_string_equal(cgats_keyword(&back, "COLOR_REP"), "");
    assert_string_equal(back.table.names[0], "SAMPLE_ID");
    for (size_t r = 0; r < 3; r++) {
        assert_string_equal(back.table.labels[r], labels[r]);
        for (size_t c = 0; c < 2; c++)
            assert_true(table_at(&back.table, r, c + 1) == values[2 * r + c]);
    }
    assert_true(cgats_save(at("c.ti3"), &back, &err));
    assert_true(cgats_load(at("c.ti3"), &twice, &err));
    assert_int_equal(twice.table.columns, 3);
    size_t size;
    char *first = take(at("b.ti3"), &size);
    assert_holds(at("c.ti3"), first);
    assert_non_null(strstr(first, "KEYWORD \"COLOR_REP\"\nCOLOR_REP \"\"\n"));
    assert_non_null(strstr(first, "KEYWORD \"SPEC_400\"\n"));
    assert_null(strstr(first, "KEYWORD \"RGB_R\""));
    free(first);
    cgats_fini(&back);
    cgats_fini(&twice);
}

static void what_would_not_load_is_not_saved(void **state)
{
    (void)state;
    char *names[] = {(char[]){"RGB_R"}, (char[]){"RGB_G"}};
    double values[] = {0, NAN};
    struct cgats_keyword keyword = {(char[]){"NAME"}, (char[]){"two\nlines"}, 0};
    struct cgats file = {.identifier = "CTI3",
                         .table = {.columns = 2, .rows = 1, .names = names, .values = values}};
    struct error err = {0};
    put_text("d.ti3", "old");
    assert_false(cgats_save(at("d.ti3"), &file, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_complaint(err.text, "d.ti3: row 1, field RGB_G: nan; allowed: a finite number");
    values[1] = 1;
    file.keyword_count = 1;
    file.keywords = &keyword;
    assert_false(cgats_save(at("d.ti3"), &file, &err));
    keyword.value = (char[]){"one line"};
    keyword.name = (char[]){"BEGIN_DATA"};
    assert_false(cgats_save(at("d.ti3"), &file, &err));
    keyword.name = (char[]){"TWO WORDS"};
    assert_false(cgats_save(at("d.ti3"), &file, &err));
    keyword.name = (char[]){"NAME"};
    names[1] = names[0];
    assert_false(cgats_save(at("d.ti3"), &file, &err));
    names[1] = (char[]){"RGB_G"};
    file.table.rows = 0;
    assert_false(cgats_save(at("d.ti3"), &file, &err));
    file.table.rows = 1;
    strcpy(file.identifier, "");
    assert_false(cgats_save(at("d.ti3"), &file, &err));
    assert_holds(at("d.ti3"), "old");
    strcpy(file.identifier, "CTI3");
    assert_true(cgats_save(at("d.ti3"), &file, &err));
}

static void real_displays_and_lamps_load(void **state)
{
    (void)state;
    static const struct {
        const char *name, *identifier;
        size_t columns, rows;
    } REAL[] = {{"displays/gpdwin-201906141510.ti3", "CTI3", 7, 417},
                {"displays/hp835g7-202009282130.ti3", "CTI3", 7, 588},
                {"displays/hp835g7-202009282223.ti3", "CTI3", 7, 588},
                {"displays/k2418u-202102090911.ti3", "CTI3", 7, 588},
                {"displays/k2721ug-202302120107.ti3", "CTI3", 113, 588},
                {"displays/kolen-s-ipad-native.ti3", "CTI3", 7, 118},
                {"displays/samsung-20200831.ti3", "CTI3", 7, 119},
                {"displays/thinkbook14p-202208011950.ti3", "CTI3", 7, 596},
                {"lamps/TruluxPlus.sp", "SPECT", 80, 1}};
    for (size_t i = 0; i < sizeof REAL / sizeof *REAL; i++) {
        const char *path = shared_file(REAL[i].name);
        struct cgats file;
        struct error err = {0};
        double white[3];
        assert_true(cgats_load_as(path, REAL[i].identifier, &file, &err));
        assert_int_equal(file.table.columns, REAL[i].columns);
        assert_int_equal(file.table.rows, REAL[i].rows);
        if (!strcmp(REAL[i].identifier, "CTI3"))
            assert_true(cgats_numbers(&file, "LUMINANCE_XYZ_CDM2", white, 3, &err));
        cgats_fini(&file);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_example_is_read_as_it_stands),
        cmocka_unit_test(line_ends_and_a_mark_change_nothing),
        cmocka_unit_test(lines_may_end_in_carriage_returns_alone),
        cmocka_unit_test(many_bytes_that_are_no_text_take_no_longer),
        cmocka_unit_test(all_cells_may_stand_on_one_line_or_on_one_each),
        cmocka_unit_test(a_name_is_the_label_where_there_is_no_id),
        cmocka_unit_test(later_tables_are_checked_and_left_out),
        cmocka_unit_test(a_missing_identifier_is_refused),
        cmocka_unit_test(another_identifier_than_the_wanted_one_is_refused),
        cmocka_unit_test(a_number_of_fields_that_contradicts_the_fields_is_refused),
        cmocka_unit_test(a_number_of_sets_that_contradicts_the_rows_is_refused),
        cmocka_unit_test(rows_with_a_cell_too_few_or_too_many_are_refused_with_their_line),
        cmocka_unit_test(a_field_given_twice_or_none_at_all_is_refused),
        cmocka_unit_test(a_cell_that_is_no_finite_number_is_refused_with_its_field),
        cmocka_unit_test(a_keyword_has_one_value_on_its_line),
        cmocka_unit_test(a_file_that_ends_early_says_before_what),
        cmocka_unit_test(bytes_that_are_no_text_are_told),
        cmocka_unit_test(a_keyword_of_numbers_is_read_exactly),
        cmocka_unit_test(what_is_saved_loads_to_the_same_bits),
        cmocka_unit_test(what_would_not_load_is_not_saved),
        cmocka_unit_test(real_displays_and_lamps_load),
    };
    return cmocka_run_group_tests_name("cgats", tests, open_place, close_place);
}
