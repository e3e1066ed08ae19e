// SPDX-License-Identifier: Apache-2.0
#include <jansson.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/list.h"

#include <cmocka.h>

static struct found_list two(void)
{
    struct found_list list = {.count = 2};
    list.of[0] = (struct found){.kind = "spectrometer",
                                .driver = "ocean",
                                .place = "/dev/bus/usb/001/004",
                                .model = "Flame-S",
                                .serial = "FLMS01234",
                                .firmware = "3.01.2"};
    list.of[1] = (struct found){.kind = "serial line",
                                .place = "/dev/ttyUSB0",
                                .model = "a \"quoted\" name",
                                .emulated = true,
                                .access = FOUND_REFUSED,
                                .note = "no permission"};
    return list;
}

static char *printed(void (*print)(const struct found_list *, FILE *), struct found_list list)
{
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    print(&list, out);
    fclose(out);
    return text;
}

static void the_table_lines_up_and_says_what_is_wrong(void **state)
{
    (void)state;
    char *text = printed(list_text, two()), *save = NULL;
    char *title = strtok_r(text, "\n", &save), *first = strtok_r(NULL, "\n", &save);
    char *second = strtok_r(NULL, "\n", &save), *note = strtok_r(NULL, "\n", &save);
    ptrdiff_t serial = strstr(title, "SERIAL") - title, access = strstr(title, "ACCESS") - title;
    assert_int_equal(strncmp(first + serial, "FLMS01234", 9), 0);
    assert_string_equal(first + access, "usable");
    assert_int_equal(second[serial], '-');
    assert_string_equal(second + access, "refused (emulated)");
    assert_non_null(strstr(note, "no permission"));
    free(text);
}

static void nothing_found_is_said(void **state)
{
    (void)state;
    char *text = printed(list_text, (struct found_list){0});
    assert_string_equal(text, "no instruments found\n");
    free(text);
    text = printed(list_json, (struct found_list){0});
    assert_string_equal(text, "[]\n");
    free(text);
}

static void json_holds_every_field(void **state)
{
    (void)state;
    char *text = printed(list_json, two());
    json_t *all = json_loads(text, 0, NULL);
    free(text);
    assert_int_equal(json_array_size(all), 2);
    static const char *const keys[] = {"kind",   "driver",   "place",  "model",
                                       "serial", "firmware", "access", "note"};
    for (size_t k = 0; k < sizeof keys / sizeof *keys; k++)
        assert_true(json_is_string(json_object_get(json_array_get(all, 0), keys[k])));
    const json_t *second = json_array_get(all, 1);
    assert_string_equal(json_string_value(json_object_get(second, "model")), "a \"quoted\" name");
    assert_string_equal(json_string_value(json_object_get(second, "access")), "refused");
    assert_true(json_is_true(json_object_get(second, "emulated")));
    json_decref(all);
}

static void one_refused_instrument_is_noticed(void **state)
{
    (void)state;
    struct found_list list = two();
    assert_true(list_refused(&list));
    list.of[1].access = FOUND_IN_USE;
    assert_false(list_refused(&list));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_lines_up_and_says_what_is_wrong),
        cmocka_unit_test(nothing_found_is_said),
        cmocka_unit_test(json_holds_every_field),
        cmocka_unit_test(one_refused_instrument_is_noticed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
