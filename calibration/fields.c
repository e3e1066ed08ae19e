// SPDX-License-Identifier: Apache-2.0
#include "calibration/fields.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static json_t *number(double v)
{
    return isnan(v) ? json_null() : json_real(v);
}

static json_t *series(const double *v, int count)
{
    json_t *out = json_array();
    for (int i = 0; i < count; i++)
        if (json_array_append_new(out, number(v[i]))) {
            json_decref(out);
            return NULL;
        }
    return out;
}

static json_t *list(const struct field *f, const char *from, int count)
{
    json_t *out = json_array();
    for (int i = 0; i < count; i++)
        if (json_array_append_new(out, fields_as_json(f->rows, from + (size_t)i * f->size))) {
            json_decref(out);
            return NULL;
        }
    return out;
}

static json_t *one_as_json(const struct field *f, const char *base)
{
    const void *at = base + f->offset;
    int count = 0;
    if (f->kind == FIELD_LIST || f->kind == FIELD_SERIES)
        memcpy(&count, base + f->count, sizeof count);
    switch (f->kind) {
    case FIELD_NUMBER:
        return number(*(const double *)at);
    case FIELD_WHOLE:
        return json_integer(*(const int *)at);
    case FIELD_FLAG:
        return json_boolean(*(const bool *)at);
    case FIELD_TEXT:
        return json_string(at);
    case FIELD_NUMBERS:
        return series(at, (int)f->size);
    case FIELD_OBJECT:
        return fields_as_json(f->rows, at);
    case FIELD_LIST:
        return list(f, at, count);
    case FIELD_SERIES:
        return series(at, count);
    case FIELD_JSON:
        return *(json_t *const *)at ? json_incref(*(json_t *const *)at) : json_null();
    }
    return NULL;
}

json_t *fields_as_json(const struct field *rows, const void *from)
{
    json_t *out = json_object();
    for (; rows->key; rows++)
        if (json_object_set_new(out, rows->key, one_as_json(rows, from))) {
            json_decref(out);
            return NULL;
        }
    return out;
}

// ---- reading back --------------------------------------------------------------

static bool refuse(const struct field *f, const char *wanted, struct error *err)
{
    return fail(err, ERROR_DATA, "%s: must be %s", f->key, wanted);
}

static bool take_number(const struct field *f, const json_t *v, double *out, struct error *err)
{
    if (!json_is_number(v) && !json_is_null(v))
        return refuse(f, "a number or null", err);
    *out = json_is_null(v) ? NAN : json_number_value(v);
    return true;
}

static bool take_series(const struct field *f, const json_t *v, double *out, int most,
                        struct error *err)
{
    if (!json_is_array(v) || (int)json_array_size(v) > most)
        return refuse(f, "an array of numbers, no longer than there is room for", err);
    for (int i = 0; i < (int)json_array_size(v); i++)
        if (!take_number(f, json_array_get(v, (size_t)i), &out[i], err))
            return false;
    return true;
}

static bool take_text(const struct field *f, const json_t *v, char *out, struct error *err)
{
    const char *text = json_string_value(v);
    if (!text || strlen(text) >= f->size)
        return refuse(f, "a text that fits", err);
    strcpy(out, text);
    return true;
}

static bool take_list(const struct field *f, const json_t *v, char *out, struct error *err)
{
    if (!json_is_array(v) || (int)json_array_size(v) > f->most)
        return refuse(f, "an array, no longer than there is room for", err);
    for (int i = 0; i < (int)json_array_size(v); i++)
        if (!fields_from_json(f->rows, json_array_get(v, (size_t)i), out + (size_t)i * f->size,
                              err))
            return while_doing(err, "%s[%d]", f->key, i);
    return true;
}

static bool take_one(const struct field *f, const json_t *v, char *base, struct error *err)
{
    void *at = base + f->offset;
    int count = json_is_array(v) ? (int)json_array_size(v) : 0;
    switch (f->kind) {
    case FIELD_NUMBER:
        return take_number(f, v, at, err);
    case FIELD_WHOLE:
        *(int *)at = (int)json_integer_value(v);
        return json_is_integer(v) || refuse(f, "a whole number", err);
    case FIELD_FLAG:
        *(bool *)at = json_is_true(v);
        return json_is_boolean(v) || refuse(f, "true or false", err);
    case FIELD_TEXT:
        return take_text(f, v, at, err);
    case FIELD_NUMBERS:
        return (count == (int)f->size || refuse(f, "an array of its own length", err)) &&
               take_series(f, v, at, count, err);
    case FIELD_OBJECT:
        return fields_from_json(f->rows, v, at, err) || while_doing(err, "%s", f->key);
    case FIELD_LIST:
        memcpy(base + f->count, &count, sizeof count);
        return take_list(f, v, at, err);
    case FIELD_SERIES:
        memcpy(base + f->count, &count, sizeof count);
        return take_series(f, v, at, f->most, err);
    case FIELD_JSON:
        *(json_t **)at = json_incref((json_t *)v);
        return true;
    }
    return false;
}

bool fields_from_json(const struct field *rows, const json_t *from, void *to, struct error *err)
{
    if (!json_is_object(from))
        return fail(err, ERROR_DATA, "must be an object");
    for (; rows->key; rows++) {
        const json_t *v = json_object_get(from, rows->key);
        if (v && !take_one(rows, v, to, err))
            return false;
    }
    return true;
}
