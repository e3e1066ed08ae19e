// SPDX-License-Identifier: Apache-2.0
#include "calibration/fields.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>
#undef fail

struct part {
    char name[8];
    double at[3];
};

struct whole {
    char title[16];
    double number, unknown;
    int count, parts_count, values_count;
    bool flag;
    struct part first, parts[3];
    double values[4];
    json_t *raw;
};

#define OWNER part
static const struct field PART[] = {F_TEXT("name", name), F_NUMBERS("at", at), {0}};
#undef OWNER
#define OWNER whole
static const struct field WHOLE[] = {
    F_TEXT("title", title),
    F_NUMBER("number", number),
    F_NUMBER("unknown", unknown),
    F_WHOLE("count", count),
    F_FLAG("flag", flag),
    F_OBJECT("first", first, PART),
    F_LIST("parts", parts, parts_count, PART),
    F_SERIES("values", values, values_count),
    F_JSON("raw", raw),
    {0},
};
#undef OWNER

static struct whole example(void)
{
    struct whole w = {.title = "one",
                      .number = 0.1,
                      .unknown = NAN,
                      .count = -3,
                      .parts_count = 2,
                      .values_count = 3,
                      .flag = true,
                      .first = {"f", {1, 2, 3}},
                      .parts = {{"a", {4, 5, 6}}, {"b", {7, 8, NAN}}},
                      .values = {9, 10, 11},
                      .raw = json_pack("[i]", 5)};
    return w;
}

static void a_struct_comes_back_as_it_was_written(void **state)
{
    (void)state;
    struct whole w = example(), back = {0};
    json_t *json = fields_as_json(WHOLE, &w);
    assert_non_null(json);
    char *text = json_dumps(json, 0);
    json_t *again = json_loads(text, 0, NULL);
    assert_true(fields_from_json(WHOLE, again, &back, NULL));
    assert_string_equal(back.title, "one");
    assert_true(back.number == 0.1 && isnan(back.unknown) && back.count == -3 && back.flag);
    assert_memory_equal(&back.first, &w.first, sizeof w.first);
    assert_int_equal(back.parts_count, 2);
    assert_string_equal(back.parts[1].name, "b");
    assert_true(back.parts[1].at[1] == 8 && isnan(back.parts[1].at[2]));
    assert_int_equal(back.values_count, 3);
    assert_true(back.values[2] == 11);
    assert_true(json_equal(back.raw, w.raw));
    free(text);
    json_decref(json);
    json_decref(again);
    json_decref(w.raw);
    json_decref(back.raw);
}

static void a_missing_key_leaves_its_field_alone(void **state)
{
    (void)state;
    struct whole w = {.number = 7};
    json_t *none = json_object();
    assert_true(fields_from_json(WHOLE, none, &w, NULL));
    assert_true(w.number == 7);
    json_decref(none);
}

static void what_does_not_fit_is_refused_with_its_place(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said;
    } bad[] = {
        {"[]", "object"},
        {"{\"number\": \"x\"}", "number"},
        {"{\"count\": 1.5}", "count"},
        {"{\"flag\": 1}", "flag"},
        {"{\"title\": \"longer than there is room\"}", "title"},
        {"{\"first\": {\"at\": [1, 2]}}", "at"},
        {"{\"parts\": [{}, {\"name\": 3}]}", "parts[1]"},
        {"{\"parts\": [{}, {}, {}, {}]}", "parts"},
        {"{\"values\": [1, 2, 3, 4, 5]}", "values"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct whole w = {0};
        struct error err = {0};
        json_t *json = json_loads(bad[i].text, 0, NULL);
        assert_false(fields_from_json(WHOLE, json, &w, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_non_null(strstr(err.text, bad[i].said));
        json_decref(json);
    }
}

static void an_infinite_number_is_not_written(void **state)
{
    (void)state;
    struct whole w = example();
    w.parts[1].at[0] = INFINITY;
    assert_null(fields_as_json(WHOLE, &w));
    json_decref(w.raw);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_struct_comes_back_as_it_was_written),
        cmocka_unit_test(a_missing_key_leaves_its_field_alone),
        cmocka_unit_test(what_does_not_fit_is_refused_with_its_place),
        cmocka_unit_test(an_infinite_number_is_not_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
