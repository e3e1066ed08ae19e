// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <math.h>
#include <pthread.h>

#include "files/ini.h"
#include "tests/files/place.h"

static const char *const KINDS[] = {"chart", "flat", NULL};

struct screen {
    double width_m;
    int bits;
    char name[300];
    int kind;
};

static const struct setting SCREEN[] = {
    {"width_m", SETTING_DOUBLE, SETTING_FIELD(struct screen, width_m), 0, 0.01, 10, "m", NULL, NULL,
     "Width of the screen."},
    {"bits", SETTING_INT, SETTING_FIELD(struct screen, bits), 0, 6, 16, "", NULL, "8",
     "Depth of the panel."},
    {"name", SETTING_TEXT, SETTING_FIELD(struct screen, name), SETTING_SIZE(struct screen, name), 0,
     0, "", NULL, "panel", "Its name."},
    {"kind", SETTING_ENUM, SETTING_FIELD(struct screen, kind), 0, 0, 0, "", KINDS, "flat", "Kind."},
    {0}};

struct stand {
    double eye_m[3];
};

static const struct setting STAND[] = {{"eye_m", SETTING_VECTOR, SETTING_FIELD(struct stand, eye_m),
                                        3, -5, 5, "m", NULL, "0 0.55 0.65", "Where the eye is."},
                                       {0}};

struct both {
    struct screen screen;
    struct stand stand;
};

static bool load(const char *text, struct both *both, struct error *err)
{
    struct settings_section sections[] = {
        {"screen", SCREEN, &both->screen}, {"stand", STAND, &both->stand}, {0}};
    return ini_load(put_text("a.ini", text), sections, err);
}

static struct both good(const char *text)
{
    struct both both = {0};
    struct error err = {0};
    if (!load(text, &both, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    return both;
}

static void bad(const char *text, const char *expected)
{
    struct both both = {0};
    struct error err = {0};
    assert_false(load(text, &both, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_complaint(err.text, expected);
    assert_false(load(text, &both, NULL));
}

static void what_the_file_says_is_set_and_the_rest_has_its_preset(void **state)
{
    (void)state;
    struct both b = good("# booth\n[screen]\nwidth_m = 0.52\nname = EIZO CG\n\n[stand]\n");
    assert_true(b.screen.width_m == 0.52);
    assert_int_equal(b.screen.bits, 8);
    assert_string_equal(b.screen.name, "EIZO CG");
    assert_int_equal(b.screen.kind, 1);
    assert_true(b.stand.eye_m[1] == 0.55);
}

static void blanks_comments_line_ends_and_a_mark_change_nothing(void **state)
{
    (void)state;
    static const char *const SAME[] = {
        "[screen]\nwidth_m=0.5\nbits=10\n",
        "[screen]\r\nwidth_m = 0.5\r\nbits = 10\r\n",
        "\xef\xbb\xbf[screen]\nwidth_m = 0.5\nbits = 10",
        "; c\n#c\n  [screen]  \n\n\twidth_m   =\t0.5  \n   bits = 10\n# bits = 12\n",
        "[stand]\neye_m = 0 0.55 0.65\n[screen]\nbits = 10\nwidth_m: 0.5\n",
    };
    for (size_t i = 0; i < sizeof SAME / sizeof *SAME; i++) {
        struct both b = good(SAME[i]);
        assert_true(b.screen.width_m == 0.5);
        assert_int_equal(b.screen.bits, 10);
    }
}

static void a_comment_sign_within_a_value_belongs_to_it(void **state)
{
    (void)state;
    struct both b = good("[screen]\nwidth_m = 1\nname = a ; b # c = d [e]\n");
    assert_string_equal(b.screen.name, "a ; b # c = d [e]");
}

static void a_value_of_hundreds_of_bytes_is_kept_whole(void **state)
{
    (void)state;
    char text[400] = "[screen]\nwidth_m = 1\nname = ";
    memset(text + strlen(text), 'n', 299);
    struct both b = good(text);
    assert_int_equal(strlen(b.screen.name), 299);
    strcat(text, "n");
    struct error err = {0};
    assert_false(load(text, &b, &err));
    assert_non_null(strstr(err.text, "a.ini:3: [screen]: name: \"nnn"));
    assert_non_null(strstr(err.text, "is longer than 299 characters"));
}

static void a_value_out_of_range_names_file_line_key_value_and_range(void **state)
{
    (void)state;
    bad("[screen]\nwidth_m = 11\n", "a.ini:2: [screen]: width_m: 11 is outside 0.01..10 m");
    bad("[screen]\nwidth_m = 1\n\n[stand]\neye_m = 0 0 7\n",
        "a.ini:5: [stand]: eye_m: 7 is outside -5..5 m");
    bad("[screen]\nbits = eight\n", "a.ini:2: [screen]: bits: \"eight\" is not a number; allowed: "
                                    "6..16");
    bad("[screen]\nkind = Chart\n",
        "a.ini:2: [screen]: kind: \"Chart\" is not one of: chart, flat");
    bad("[screen]\nwidth_m = nan\n",
        "a.ini:2: [screen]: width_m: \"nan\" is not a number; allowed: 0.01..10 m");
    bad("[screen]\nwidth_m =\n",
        "a.ini:2: [screen]: width_m: \"\" is not a number; allowed: 0.01..10 m");
    bad("[screen]\nwidth_m = 0.5 ; metres\n",
        "a.ini:2: [screen]: width_m: \"0.5 ; metres\" is not one number; allowed: 0.01..10 m");
}

static void an_unknown_key_is_named_with_those_allowed(void **state)
{
    (void)state;
    bad("[screen]\nwidth_m = 1\nwidht_m = 2\n", "a.ini:3: [screen] widht_m = 2: no such setting; "
                                                "allowed: width_m, bits, name, kind");
    bad("[stand]\nwidth_m = 1\n", "a.ini:2: [stand] width_m = 1: no such setting; allowed: eye_m");
    bad("[screen]\n= 1\n",
        "a.ini:2: [screen]  = 1: no such setting; allowed: width_m, bits, name, kind");
}

static void an_unknown_section_is_refused_even_when_empty(void **state)
{
    (void)state;
    bad("[screen]\nwidth_m = 1\n[scren]\n",
        "a.ini:3: [scren]: no such section; allowed: screen, stand");
    bad("[scren]\nwidth_m = 1\n", "a.ini:1: [scren]: no such section; allowed: screen, stand");
    bad("[]\n", "a.ini:1: [?]: no such section; allowed: screen, stand");
    bad("width_m = 1\n", "a.ini:1: a setting before the first [section]; allowed: screen, stand");
}

static void nothing_may_be_given_twice(void **state)
{
    (void)state;
    bad("[screen]\nwidth_m = 1\nbits = 8\nwidth_m = 1\n",
        "a.ini:4: [screen] width_m = 1: given a second time; allowed: once");
    bad("[screen]\nwidth_m = 1\n[stand]\n[screen]\nbits = 8\n",
        "a.ini:4: [screen]: section given a second time; allowed: once");
}

static void a_required_key_that_is_missing_is_named_with_its_meaning(void **state)
{
    (void)state;
    bad("", "a.ini: [screen] width_m is missing and must be given: Width of the screen.");
    bad("[screen]\nbits = 8\n",
        "a.ini: [screen] width_m is missing and must be given: Width of the screen.");
}

static void a_line_that_is_nothing_known_is_refused(void **state)
{
    (void)state;
    bad("[screen]\nwidth_m = 1\nhello\n",
        "a.ini:3: \"hello\" is neither [section], key = value nor a # comment");
    bad("[screen\nwidth_m = 1\n",
        "a.ini:1: \"[screen\" is neither [section], key = value nor a # comment");
    bad("[screen] width_m = 1\n", "a.ini:1: text after [section]; allowed: nothing");
    bad("[screen]\rwidth_m = 1\r", "a.ini:1: byte 0x0d is not text");
}

static void the_first_of_several_faults_is_reported(void **state)
{
    (void)state;
    bad("[screen]\nbits = 99\nhello\nwidth_m = 99\n",
        "a.ini:2: [screen]: bits: 99 is outside 6..16");
    bad("[screen]\nhello\nbits = 99\n",
        "a.ini:2: \"hello\" is neither [section], key = value nor a # comment");
}

static void bytes_that_are_no_text_are_refused(void **state)
{
    (void)state;
    struct both both;
    struct error err = {0};
    struct settings_section sections[] = {
        {"screen", SCREEN, &both.screen}, {"stand", STAND, &both.stand}, {0}};
    bad("[screen]\nname = caf\xe9\n", "a.ini:2: byte 0xe9 is not text");
    bad("[screen]\nname = a\x07\n", "a.ini:2: byte 0x07 is not text");
    assert_false(ini_load(put("a.ini", "[screen]\nwidth_m = 1\0\n", 22), sections, &err));
    assert_complaint(err.text, "a.ini:2: byte 0x00 is not text");
    struct both b = good("[screen]\nwidth_m = 1\nname = caf\xc3\xa9\n");
    assert_string_equal(b.screen.name, "caf\xc3\xa9");
}

static void a_line_longer_than_its_bound_is_refused(void **state)
{
    (void)state;
    char *text = malloc(70000);
    strcpy(text, "[screen]\nname = ");
    memset(text + 16, 'x', 65001);
    text[16 + 65001] = 0;
    bad(text, "a.ini:2: line is longer than 65000 bytes");
    free(text);
}

static void a_missing_file_is_named(void **state)
{
    (void)state;
    struct both both;
    struct error err = {0};
    struct settings_section sections[] = {{"screen", SCREEN, &both.screen}, {0}};
    assert_false(ini_load(at("none.ini"), sections, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_complaint(err.text, "none.ini: cannot be read: No such file or directory");
}

static void what_is_saved_loads_to_the_same_values(void **state)
{
    (void)state;
    struct both both = {{1.0 / 3, 12, "a ; b = c", 0}, {{0.1, -5, 4.999999999999999}}}, back = {0};
    struct settings_section sections[] = {
        {"screen", SCREEN, &both.screen}, {"stand", STAND, &both.stand}, {0}};
    struct settings_section again[] = {
        {"screen", SCREEN, &back.screen}, {"stand", STAND, &back.stand}, {0}};
    assert_true(ini_save(at("b.ini"), sections, NULL));
    assert_true(ini_load(at("b.ini"), again, NULL));
    assert_memory_equal(&back, &both, sizeof both);
    assert_holds(at("b.ini"), "[screen]\nwidth_m = 0.3333333333333333\nbits = 12\n"
                              "name = a ; b = c\nkind = chart\n\n[stand]\n"
                              "eye_m = 0.1 -5 4.999999999999999\n");
}

static void what_would_not_load_is_not_saved(void **state)
{
    (void)state;
    static const struct screen BAD[] = {{NAN, 8, "x", 0}, {1, 5, "x", 0},  {1, 8, "a\nbits = 9", 0},
                                        {1, 8, " x", 0},  {1, 8, "x ", 0}, {1, 8, "\xff", 0}};
    put_text("c.ini", "old");
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        struct screen screen = BAD[i];
        struct error err = {0};
        struct settings_section sections[] = {{"screen", SCREEN, &screen}, {0}};
        assert_false(ini_save(at("c.ini"), sections, &err));
        assert_int_equal(err.code, ERROR_CONFIG);
        assert_holds(at("c.ini"), "old");
    }
}

static void *load_often(void *context)
{
    struct both both;
    struct settings_section sections[] = {
        {"screen", SCREEN, &both.screen}, {"stand", STAND, &both.stand}, {0}};
    for (int i = 0; i < 200; i++)
        if (!ini_load(context, sections, NULL))
            return context;
    return NULL;
}

static void several_threads_may_load_at_once(void **state)
{
    (void)state;
    pthread_t threads[4];
    char path[96];
    strcpy(path, put_text("a.ini", "[screen]\nwidth_m = 1\nname = several threads ; at once\n"));
    for (int i = 0; i < 4; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, load_often, path), 0);
    for (int i = 0; i < 4; i++) {
        void *failed;
        pthread_join(threads[i], &failed);
        assert_null(failed);
    }
}

static void a_file_over_another_leaves_what_it_does_not_name(void **state)
{
    (void)state;
    struct both b = {0};
    bool given[5] = {0};
    struct error err = {0};
    struct settings_section sections[] = {
        {"screen", SCREEN, &b.screen}, {"stand", STAND, &b.stand}, {0}};
    assert_int_equal(ini_rows(sections), 5);
    assert_true(
        ini_load(put_text("a.ini", "[screen]\nwidth_m = 0.5\nname = first\n"), sections, &err));
    assert_true(
        ini_load_onto(put_text("b.ini", "[screen]\nname = second\n[stand]\neye_m = 1 2 3\n"),
                      sections, given, &err));
    assert_true(b.screen.width_m == 0.5);
    assert_string_equal(b.screen.name, "second");
    assert_true(b.stand.eye_m[2] == 3);
    const bool expected[5] = {false, false, true, false, true};
    assert_memory_equal(given, expected, sizeof given);
    assert_false(ini_complete("b.ini", sections, given, &err));
    assert_string_equal(err.text, "b.ini: [screen] width_m is missing and must be given: Width of "
                                  "the screen.");
    assert_true(ini_load_onto(put_text("c.ini", "[screen]\nwidth_m = 1\n"), sections, given, &err));
    assert_true(ini_complete("c.ini", sections, given, &err));
    assert_true(given[2] && given[4]);
    assert_true(ini_load_onto(put_text("d.ini", ""), sections, NULL, &err));
    assert_false(ini_load_onto(put_text("d.ini", "[stand]\nbits = 8\n"), sections, given, &err));
    assert_complaint(err.text, "d.ini:2: [stand] bits = 8: no such setting; allowed: eye_m");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_the_file_says_is_set_and_the_rest_has_its_preset),
        cmocka_unit_test(blanks_comments_line_ends_and_a_mark_change_nothing),
        cmocka_unit_test(a_comment_sign_within_a_value_belongs_to_it),
        cmocka_unit_test(a_value_of_hundreds_of_bytes_is_kept_whole),
        cmocka_unit_test(a_value_out_of_range_names_file_line_key_value_and_range),
        cmocka_unit_test(an_unknown_key_is_named_with_those_allowed),
        cmocka_unit_test(an_unknown_section_is_refused_even_when_empty),
        cmocka_unit_test(nothing_may_be_given_twice),
        cmocka_unit_test(a_required_key_that_is_missing_is_named_with_its_meaning),
        cmocka_unit_test(a_line_that_is_nothing_known_is_refused),
        cmocka_unit_test(the_first_of_several_faults_is_reported),
        cmocka_unit_test(bytes_that_are_no_text_are_refused),
        cmocka_unit_test(a_line_longer_than_its_bound_is_refused),
        cmocka_unit_test(a_missing_file_is_named),
        cmocka_unit_test(what_is_saved_loads_to_the_same_values),
        cmocka_unit_test(what_would_not_load_is_not_saved),
        cmocka_unit_test(several_threads_may_load_at_once),
        cmocka_unit_test(a_file_over_another_leaves_what_it_does_not_name),
    };
    return cmocka_run_group_tests_name("ini", tests, open_place, close_place);
}
