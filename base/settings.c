// SPDX-License-Identifier: Apache-2.0
#include "base/settings.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"

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

static bool refuse(const struct setting *row, const char *text, int size, const char *why,
                   struct error *err)
{
    return fail(err, ERROR_CONFIG, "%s: \"%.*s\" %s; allowed: %.15g..%.15g%s%s", row->name,
                size > 80 ? 80 : size, text, why, row->least, row->most, *row->unit ? " " : "",
                row->unit);
}

// alone: nothing may follow it.
static bool number(const struct setting *row, const char **text, bool alone, double *value,
                   struct error *err)
{
    const char *end;
    bool one = number_parse(*text, &end, value);
    bool apart = one && (!*end || *end == ' ' || *end == '\t');
    if (!apart)
        return refuse(row, *text, (int)strlen(*text), "is not a number", err);
    if (alone && end[strspn(end, " \t")])
        return refuse(row, *text, (int)strlen(*text), "is not one number", err);
    if (*value < row->least || *value > row->most)
        return fail(err, ERROR_CONFIG, "%s: %.*s is outside %.15g..%.15g%s%s", row->name,
                    (int)(end - *text), *text, row->least, row->most, *row->unit ? " " : "",
                    row->unit);
    *text = end + strspn(end, " \t");
    return true;
}

static bool whole(const struct setting *row, const char *text, int *value, struct error *err)
{
    const char *rest = text;
    double x;
    if (!number(row, &rest, true, &x, err))
        return false;
    if (x != rint(x))
        return refuse(row, text, (int)strlen(text), "is not a whole number", err);
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
    return fail(err, ERROR_CONFIG, "%s: \"%.80s\" is not one of: %s", row->name, text, list);
}

// Looked through first, so that a bad element leaves all as they were.
static bool vector(const struct setting *row, const char *text, double *values, struct error *err)
{
    const char *rest = text;
    double x;
    for (size_t i = 0; i < row->size; i++) {
        if (!*rest)
            return fail(err, ERROR_CONFIG, "%s: \"%.80s\" has %zu numbers instead of %zu",
                        row->name, text, i, row->size);
        if (!number(row, &rest, false, &x, err))
            return false;
    }
    if (*rest)
        return fail(err, ERROR_CONFIG, "%s: \"%.80s\" is not %zu numbers with blanks between",
                    row->name, text, row->size);
    for (size_t i = 0; i < row->size; i++)
        number(row, &text, false, &values[i], NULL);
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
        if (!number(row, &rest, true, &x, err))
            return false;
        *(double *)field = x;
        return true;
    case SETTING_INT:
        return whole(row, text, field, err);
    case SETTING_BOOL:
        if (!choice(&(struct setting){.name = name, .choices = (const char *[]){"no", "yes", NULL}},
                    text, &i, err))
            return false;
        *(bool *)field = i;
        return true;
    case SETTING_TEXT:
        if (strlen(text) >= row->size)
            return fail(err, ERROR_CONFIG, "%s: \"%.40s\" is longer than %zu characters", name,
                        text, row->size - 1);
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
    char shown[NUMBER_TEXT];
    switch (row->type) {
    case SETTING_DOUBLE:
        snprintf(text, size, "%s", number_text(shown, *(const double *)field));
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
            used += snprintf(text + used, size - used, "%s%s", i ? " " : "",
                             number_text(shown, ((const double *)field)[i]));
        return;
    }
}

void settings_describe(const struct settings_section *section, FILE *out)
{
    fprintf(out, "[%s]\n", section->name);
    for (const struct setting *row = section->rows; row->name; row++) {
        fprintf(out, "# %s", row->help);
        if (row->type == SETTING_DOUBLE || row->type == SETTING_INT || row->type == SETTING_VECTOR)
            fprintf(out, " %.9g..%.9g%s%s", row->least, row->most, *row->unit ? " " : "",
                    row->unit);
        if (row->type == SETTING_ENUM)
            for (int i = 0; row->choices[i]; i++)
                fprintf(out, "%s%s", i ? " | " : " ", row->choices[i]);
        fprintf(out, "\n%s%s = %s\n", row->preset ? "# " : "", row->name,
                row->preset ? row->preset : "");
    }
}

static void write_row(const struct setting *row, const void *target, FILE *out)
{
    struct setting element = *row;
    char text[1024];
    size_t count = row->type == SETTING_VECTOR ? row->size : 1;
    element.type = row->type == SETTING_VECTOR ? SETTING_DOUBLE : row->type;
    fprintf(out, "%s =", row->name);
    for (size_t i = 0; i < count; i++) {
        settings_get(&element, target, text, sizeof text);
        fprintf(out, " %s", text);
        element.offset += sizeof(double);
    }
    fputc('\n', out);
}

void settings_write(const struct settings_section *section, FILE *out)
{
    fprintf(out, "[%s]\n", section->name);
    for (const struct setting *row = section->rows; row->name; row++)
        write_row(row, section->target, out);
}
