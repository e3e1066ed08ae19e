// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <stdlib.h>
#include <string.h>

#include "base/settings.h"

enum mode { MODE_FULL, MODE_BANDS, MODE_PRODUCT };

static const char *const MODES[] = {"full", "bands", "product", NULL};

enum { CURVE = 300 };

struct probe {
    double width_m;
    int integration_us;
    bool emulated;
    char name[8];
    int mode;
    double eye_m[3];
    double curve[CURVE];
};

#define FIELD(field) SETTING_FIELD(struct probe, field)

static const struct setting ROWS[] = {
    {"width_m", SETTING_DOUBLE, FIELD(width_m), 0, 0.01, 10, "m", NULL, NULL,
     "Width of the screen."},
    {"integration_us", SETTING_INT, FIELD(integration_us), 0, 1000, 65535000, "us", NULL, "100000",
     "Integration time."},
    {"emulated", SETTING_BOOL, FIELD(emulated), 0, 0, 0, "", NULL, "no", "Is it emulated?"},
    {"name", SETTING_TEXT, FIELD(name), SETTING_SIZE(struct probe, name), 0, 0, "", NULL, "booth",
     "Its name."},
    {"mode", SETTING_ENUM, FIELD(mode), 0, 0, 0, "", MODES, "bands", "Spectral mode."},
    {"eye_m", SETTING_VECTOR, FIELD(eye_m), 3, -5, 5, "m", NULL, "0 0.55 0.65",
     "Where the eye is."},
    {"curve", SETTING_VECTOR, FIELD(curve), CURVE, 0, 1, "", NULL, NULL, "A long one."},
    {0}};

static void assert_refused(const char *name, const char *value, const char *text)
{
    struct probe before, probe;
    struct error err = {0};
    memset(&before, 0x55, sizeof before);
    probe = before;
    assert_false(settings_set(ROWS, &probe, name, value, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_string_equal(err.text, text);
    assert_memory_equal(&probe, &before, sizeof probe);
}

static void presets_fill_what_has_one_and_leave_the_rest(void **state)
{
    (void)state;
    struct probe probe = {0};
    settings_preset(ROWS, &probe);
    assert_int_equal(probe.integration_us, 100000);
    assert_false(probe.emulated);
    assert_string_equal(probe.name, "booth");
    assert_int_equal(probe.mode, MODE_BANDS);
    assert_true(probe.eye_m[1] == 0.55 && probe.eye_m[2] == 0.65);
    assert_true(probe.width_m == 0);
}

static void a_value_out_of_range_is_refused_with_its_range_and_unit(void **state)
{
    (void)state;
    assert_refused("integration_us", "0", "integration_us: 0 is outside 1000..65535000 us");
    assert_refused("integration_us", "65535001",
                   "integration_us: 65535001 is outside 1000..65535000 us");
    assert_refused("width_m", "1e300", "width_m: 1e300 is outside 0.01..10 m");
    assert_refused("eye_m", "0 0 -5.1", "eye_m: -5.1 is outside -5..5 m");
}

static void the_ends_of_a_range_belong_to_it(void **state)
{
    (void)state;
    struct probe probe = {0};
    assert_true(settings_set(ROWS, &probe, "integration_us", "1000", NULL));
    assert_true(settings_set(ROWS, &probe, "integration_us", "65535000", NULL));
    assert_true(settings_set(ROWS, &probe, "eye_m", "-5 5\t 5", NULL));
    assert_true(probe.eye_m[0] == -5 && probe.eye_m[2] == 5);
}

static void what_is_no_number_is_refused_and_says_what_is_allowed(void **state)
{
    (void)state;
    assert_refused("width_m", "wide", "width_m: \"wide\" is not a number; allowed: 0.01..10 m");
    assert_refused("width_m", "", "width_m: \"\" is not a number; allowed: 0.01..10 m");
    assert_refused("width_m", "nan", "width_m: \"nan\" is not a number; allowed: 0.01..10 m");
    assert_refused("width_m", "inf", "width_m: \"inf\" is not a number; allowed: 0.01..10 m");
    assert_refused("width_m", "1e999", "width_m: \"1e999\" is not a number; allowed: 0.01..10 m");
    assert_refused("width_m", "0,5", "width_m: \"0,5\" is not a number; allowed: 0.01..10 m");
    assert_refused("width_m", "0.5m", "width_m: \"0.5m\" is not a number; allowed: 0.01..10 m");
    assert_refused("width_m", "0.5 m", "width_m: \"0.5 m\" is not one number; allowed: 0.01..10 m");
    assert_refused("width_m", "520 mm", "width_m: \"520 mm\" is not one number; allowed: 0.01..10 m");
    assert_refused("width_m", "0x1", "width_m: \"0x1\" is not a number; allowed: 0.01..10 m");
    assert_refused("integration_us", "0x10000",
                   "integration_us: \"0x10000\" is not a number; allowed: 1000..65535000 us");
    assert_refused("integration_us", "1000.5",
                   "integration_us: \"1000.5\" is not a whole number; allowed: 1000..65535000 us");
}

static void a_vector_takes_its_count_of_numbers_no_more_no_less(void **state)
{
    (void)state;
    assert_refused("eye_m", "1 2", "eye_m: \"1 2\" has 2 numbers instead of 3");
    assert_refused("eye_m", "", "eye_m: \"\" has 0 numbers instead of 3");
    assert_refused("eye_m", "1 2 3 4", "eye_m: \"1 2 3 4\" is not 3 numbers with blanks between");
    assert_refused("eye_m", "1.2.3 4", "eye_m: \"1.2.3 4\" is not a number; allowed: -5..5 m");
    assert_refused("eye_m", "1, 2, 3", "eye_m: \"1, 2, 3\" is not a number; allowed: -5..5 m");
}

static void a_text_fits_its_field_or_is_refused(void **state)
{
    (void)state;
    struct probe probe = {0};
    assert_true(settings_set(ROWS, &probe, "name", "1234567", NULL));
    assert_string_equal(probe.name, "1234567");
    assert_true(settings_set(ROWS, &probe, "name", "", NULL));
    assert_string_equal(probe.name, "");
    assert_refused("name", "12345678", "name: \"12345678\" is longer than 7 characters");
}

static void choices_are_named_when_none_of_them_was_given(void **state)
{
    (void)state;
    struct probe probe = {0};
    assert_true(settings_set(ROWS, &probe, "mode", "product", NULL));
    assert_int_equal(probe.mode, MODE_PRODUCT);
    assert_true(settings_set(ROWS, &probe, "emulated", "yes", NULL));
    assert_true(probe.emulated);
    assert_refused("mode", "Full", "mode: \"Full\" is not one of: full, bands, product");
    assert_refused("emulated", "true", "emulated: \"true\" is not one of: no, yes");
}

static void an_unknown_setting_is_refused(void **state)
{
    (void)state;
    assert_refused("widht_m", "1", "widht_m: no such setting");
    assert_null(settings_find(ROWS, "widht_m"));
    assert_ptr_equal(settings_find(ROWS, "emulated"), &ROWS[2]);
}

static struct probe filled(void)
{
    struct probe p = {.width_m = 0.1,
                      .integration_us = 1234,
                      .emulated = true,
                      .name = "a b",
                      .mode = MODE_PRODUCT,
                      .eye_m = {1.0 / 3, -4.999999999999999, 5e-324}};
    for (int i = 0; i < CURVE; i++)
        p.curve[i] = i / (CURVE - 1.0);
    return p;
}

static void every_value_written_reads_back_to_the_same_bits(void **state)
{
    (void)state;
    struct probe probe = filled(), back = {0};
    char text[CURVE * 32];
    for (const struct setting *row = ROWS; row->name; row++) {
        settings_get(row, &probe, text, sizeof text);
        assert_true(settings_set(ROWS, &back, row->name, text, NULL));
    }
    assert_memory_equal(&back, &probe, sizeof probe);
    settings_get(ROWS, &probe, text, sizeof text);
    assert_string_equal(text, "0.1");
}

static void a_written_section_holds_every_row_whole(void **state)
{
    (void)state;
    struct probe probe = filled(), back = {0};
    char *text, *line, *rest;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    settings_write(&(struct settings_section){"probe", ROWS, &probe}, out);
    fclose(out);
    line = strtok_r(text, "\n", &rest);
    assert_string_equal(line, "[probe]");
    int rows = 0;
    for (; (line = strtok_r(NULL, "\n", &rest)); rows++) {
        char *value = strstr(line, " = ");
        assert_non_null(value);
        *value = 0;
        assert_true(settings_set(ROWS, &back, line, value + 3, NULL));
    }
    assert_int_equal(rows, 7);
    assert_memory_equal(&back, &probe, sizeof probe);
    free(text);
}

static void a_description_names_help_range_unit_and_preset(void **state)
{
    (void)state;
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    settings_describe(&(struct settings_section){"probe", ROWS, NULL}, out);
    fclose(out);
    assert_non_null(strstr(text, "[probe]\n# Width of the screen. 0.01..10 m\nwidth_m = \n"));
    assert_non_null(
        strstr(text, "# Integration time. 1000..65535000 us\n# integration_us = 100000\n"));
    assert_non_null(strstr(text, "# Spectral mode. full | bands | product\n# mode = bands\n"));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(presets_fill_what_has_one_and_leave_the_rest),
        cmocka_unit_test(a_value_out_of_range_is_refused_with_its_range_and_unit),
        cmocka_unit_test(the_ends_of_a_range_belong_to_it),
        cmocka_unit_test(what_is_no_number_is_refused_and_says_what_is_allowed),
        cmocka_unit_test(a_vector_takes_its_count_of_numbers_no_more_no_less),
        cmocka_unit_test(a_text_fits_its_field_or_is_refused),
        cmocka_unit_test(choices_are_named_when_none_of_them_was_given),
        cmocka_unit_test(an_unknown_setting_is_refused),
        cmocka_unit_test(every_value_written_reads_back_to_the_same_bits),
        cmocka_unit_test(a_written_section_holds_every_row_whole),
        cmocka_unit_test(a_description_names_help_range_unit_and_preset),
    };
    return cmocka_run_group_tests_name("settings", tests, NULL, NULL);
}
