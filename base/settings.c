// SPDX-License-Identifier: Apache-2.0
#include "base/settings.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *field_of(const struct setting *row, void *target)
{
    return (char *)target + row->offset;
}

const struct setting *settings_find(const struct setting *rows, const char *name)
{
    for (; rows->name; rows++)
        if (!strcmp(rows->name, name))
            return rows;
    return NULL;
}

void settings_preset(const struct setting *rows, void *target)
{
    for (; rows->name; rows++)
        if (rows->preset)
            settings_set(rows, target, rows->name, rows->preset, NULL);
}

static bool outside(const struct setting *row, const char *text, struct error *err)
{
    return fail(err, ERROR_CONFIG, "%s: %s is outside %.15g..%.15g%s%s", row->name, text, row->least,
                row->most, *row->unit ? " " : "", row->unit);
}

static bool number(const struct setting *row, const char **text, double *value, struct error *err)
{
    char *end;
    errno = 0;
    *value = strtod(*text, &end);
    if (end == *text || !isfinite(*value))
        return fail(err, ERROR_CONFIG, "%s: \"%s\" is not a number%s%s", row->name, *text,
                    *row->unit ? " in " : "", row->unit);
    if (*value < row->least || *value > row->most) {
        char shown[64];
        snprintf(shown, sizeof shown, "%.*s", (int)(end - *text), *text);
        return outside(row, shown, err);
    }
    *text = end + strspn(end, " \t");
    return true;
}

static bool whole(const struct setting *row, const char *text, int *value, struct error *err)
{
    const char *rest = text;
    double x;
    if (!number(row, &rest, &x, err))
        return false;
    if (*rest || x != rint(x))
        return fail(err, ERROR_CONFIG, "%s: \"%s\" is not a whole number", row->name, text);
    *value = (int)x;
    return true;
}

static bool choice(const struct setting *row, const char *text, int *value, struct error *err)
{
    char list[256] = "";
    for (int i = 0; row->choices[i]; i++) {
        if (!strcmp(row->choices[i], text)) {
            *value = i;
            return true;
        }
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", row->choices[i]);
    }
    return fail(err, ERROR_CONFIG, "%s: \"%s\" is not one of: %s", row->name, text, list);
}

static bool vector(const struct setting *row, const char *text, double *values, struct error *err)
{
    double parsed[16] = {0};
    const char *rest = text;
    for (size_t i = 0; i < row->size; i++)
        if (!number(row, &rest, &parsed[i], err))
            return false;
    if (*rest)
        return fail(err, ERROR_CONFIG, "%s: \"%s\" has more than %zu numbers", row->name, text,
                    row->size);
    memcpy(values, parsed, row->size * sizeof *values);
    return true;
}

bool settings_set(const struct setting *rows, void *target, const char *name, const char *text,
                  struct error *err)
{
    const struct setting *row = settings_find(rows, name);
    if (!row)
        return fail(err, ERROR_CONFIG, "%s: no such setting", name);
    void *field = field_of(row, target);
    const char *rest = text;
    double x;
    int i;
    switch (row->type) {
    case SETTING_DOUBLE:
        if (!number(row, &rest, &x, err))
            return false;
        if (*rest)
            return fail(err, ERROR_CONFIG, "%s: \"%s\" is not one number", name, text);
        *(double *)field = x;
        return true;
    case SETTING_INT:
        return whole(row, text, field, err);
    case SETTING_BOOL:
        if (!choice(&(struct setting){.name = name, .choices = (const char *[]){"no", "yes", NULL}}, text,
                    &i, err))
            return false;
        *(bool *)field = i;
        return true;
    case SETTING_TEXT:
        if (strlen(text) >= row->size)
            return fail(err, ERROR_CONFIG, "%s: \"%.40s\" is longer than %zu characters", name, text,
                        row->size - 1);
        strcpy(field, text);
        return true;
    case SETTING_ENUM:
        return choice(row, text, field, err);
    case SETTING_VECTOR:
        return vector(row, text, field, err);
    }
    return false;
}

void settings_get(const struct setting *row, const void *target, char *text, size_t size)
{
    const void *field = (const char *)target + row->offset;
    switch (row->type) {
    case SETTING_DOUBLE:
        snprintf(text, size, "%.17g", *(const double *)field);
        return;
    case SETTING_INT:
        snprintf(text, size, "%d", *(const int *)field);
        return;
    case SETTING_BOOL:
        snprintf(text, size, "%s", *(const bool *)field ? "yes" : "no");
        return;
    case SETTING_TEXT:
        snprintf(text, size, "%s", (const char *)field);
        return;
    case SETTING_ENUM:
        snprintf(text, size, "%s", row->choices[*(const int *)field]);
        return;
    case SETTING_VECTOR:
        *text = 0;
        for (size_t i = 0, used = 0; i < row->size && used < size; i++)
            used += snprintf(text + used, size - used, "%s%.17g", i ? " " : "",
                             ((const double *)field)[i]);
        return;
    }
}

void settings_describe(const struct settings_section *section, FILE *out)
{
    fprintf(out, "[%s]\n", section->name);
    for (const struct setting *row = section->rows; row->name; row++) {
        fprintf(out, "# %s", row->help);
        if (row->type == SETTING_DOUBLE || row->type == SETTING_INT || row->type == SETTING_VECTOR)
            fprintf(out, " %.9g..%.9g%s%s", row->least, row->most, *row->unit ? " " : "", row->unit);
        if (row->type == SETTING_ENUM)
            for (int i = 0; row->choices[i]; i++)
                fprintf(out, "%s%s", i ? " | " : " ", row->choices[i]);
        fprintf(out, "\n%s%s = %s\n", row->preset ? "# " : "", row->name, row->preset ? row->preset : "");
    }
}

void settings_write(const struct settings_section *section, FILE *out)
{
    fprintf(out, "[%s]\n", section->name);
    for (const struct setting *row = section->rows; row->name; row++) {
        char text[1024];
        settings_get(row, section->target, text, sizeof text);
        fprintf(out, "%s = %s\n", row->name, text);
    }
}
