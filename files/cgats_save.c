// SPDX-License-Identifier: Apache-2.0
#include "files/cgats.h"

#include <math.h>
#include <string.h>

#include "base/number.h"
#include "files/text.h"
#include "files/write.h"

static bool is_one_of(const char *name, const char *const *list)
{
    for (; *list; list++)
        if (!strcmp(name, *list))
            return true;
    return false;
}

static bool is_standard_keyword(const char *name)
{
    static const char *const STANDARD[] = {
        "ORIGINATOR",         "DESCRIPTOR",       "CREATED",  "MANUFACTURER",
        "PROD_DATE",          "SERIAL",           "MATERIAL", "INSTRUMENTATION",
        "MEASUREMENT_SOURCE", "PRINT_CONDITIONS", NULL};
    return is_one_of(name, STANDARD);
}

static bool is_standard_field(const char *name)
{
    static const char *const STANDARD[] = {
        "SAMPLE_ID", "STRING",   "RGB_R", "RGB_G", "RGB_B", "XYZ_X", "XYZ_Y", "XYZ_Z",  "XYY_X",
        "XYY_Y",     "XYY_CAPY", "LAB_L", "LAB_A", "LAB_B", "LAB_C", "LAB_H", "LAB_DE", NULL};
    return is_one_of(name, STANDARD);
}

static bool is_structure(const char *name)
{
    static const char *const STRUCTURE[] = {"KEYWORD", "NUMBER_OF_FIELDS", "NUMBER_OF_SETS", NULL};
    return is_one_of(name, STRUCTURE) || !strncmp(name, "BEGIN_", 6) || !strncmp(name, "END_", 4);
}

static bool is_bare(const char *name)
{
    return strchr("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz", *name) && *name &&
           !name[strspn(name, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                              "0123456789._/-+:")];
}

static bool is_one_line(const char *text)
{
    return text_utf8_end(text, strlen(text)) == strlen(text) && !strpbrk(text, "\r\n");
}

static bool check_heads(const char *path, const struct cgats *file, struct error *err)
{
    const struct table *t = &file->table;
    if (!is_bare(file->identifier))
        return fail(err, ERROR_RANGE, "%s: \"%s\" is no identifier", path, file->identifier);
    for (size_t i = 0; i < file->keyword_count; i++) {
        const struct cgats_keyword *k = &file->keywords[i];
        if (!is_bare(k->name) || is_structure(k->name) || !is_one_line(k->value))
            return fail(err, ERROR_RANGE, "%s: keyword %s cannot be written", path, k->name);
    }
    for (size_t c = 0; c < t->columns; c++)
        if (!is_bare(t->names[c]) || is_structure(t->names[c]) ||
            table_column(t, t->names[c]) != (int)c)
            return fail(err, ERROR_RANGE, "%s: field \"%s\"; allowed: a bare name, once", path,
                        t->names[c]);
    return t->columns && t->rows ? true : fail(err, ERROR_RANGE, "%s: the table is empty", path);
}

static bool is_label(const struct table *t, size_t column)
{
    return t->labels && !strcmp(t->names[column], "SAMPLE_ID");
}

static bool check_cells(const char *path, const struct table *t, struct error *err)
{
    for (size_t r = 0; r < t->rows; r++) {
        if (t->labels && !is_one_line(t->labels[r] ? t->labels[r] : "\n"))
            return fail(err, ERROR_RANGE, "%s: label of row %zu is not one line", path, r + 1);
        for (size_t c = 0; c < t->columns; c++)
            if (!is_label(t, c) && !isfinite(table_at(t, r, c)))
                return fail(err, ERROR_RANGE, "%s: row %zu, field %s: %g; allowed: a finite number",
                            path, r + 1, t->names[c], table_at(t, r, c));
    }
    return true;
}

static void write_quoted(FILE *out, const char *text)
{
    fputc('"', out);
    for (; *text; text++) {
        if (*text == '"')
            fputc('"', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

static void write_label(FILE *out, const char *label)
{
    if (*label && !strpbrk(label, " \t\"#") && strncmp(label, "END_", 4))
        fputs(label, out);
    else
        write_quoted(out, label);
}

static void write_heads(const struct cgats *file, FILE *out)
{
    const struct table *t = &file->table;
    fprintf(out, "%s\n\n", file->identifier);
    for (size_t i = 0; i < file->keyword_count; i++) {
        const struct cgats_keyword *k = &file->keywords[i];
        if (!is_standard_keyword(k->name))
            fprintf(out, "KEYWORD \"%s\"\n", k->name);
        fprintf(out, "%s ", k->name);
        write_quoted(out, k->value);
        fputc('\n', out);
    }
    for (size_t c = 0; c < t->columns; c++)
        if (!is_standard_field(t->names[c]))
            fprintf(out, "KEYWORD \"%s\"\n", t->names[c]);
}

static void write_table(const struct table *t, FILE *out)
{
    char shown[NUMBER_TEXT];
    bool lead = t->labels && table_column(t, "SAMPLE_ID") < 0;
    fprintf(out, "\nNUMBER_OF_FIELDS %zu\nBEGIN_DATA_FORMAT\n%s", t->columns + lead,
            lead ? "SAMPLE_ID " : "");
    for (size_t c = 0; c < t->columns; c++)
        fprintf(out, "%s%s", c ? " " : "", t->names[c]);
    fprintf(out, "\nEND_DATA_FORMAT\n\nNUMBER_OF_SETS %zu\nBEGIN_DATA\n", t->rows);
    for (size_t r = 0; r < t->rows; r++) {
        if (lead)
            write_label(out, t->labels[r]);
        for (size_t c = 0; c < t->columns; c++) {
            fputs(c || lead ? " " : "", out);
            if (is_label(t, c))
                write_label(out, t->labels[r]);
            else
                fputs(number_text(shown, table_at(t, r, c)), out);
        }
        fputc('\n', out);
    }
    fputs("END_DATA\n", out);
}

bool cgats_save(const char *path, const struct cgats *file, struct error *err)
{
    struct whole_file whole;
    if (!check_heads(path, file, err) || !check_cells(path, &file->table, err) ||
        !whole_file_begin(&whole, path, err))
        return false;
    write_heads(file, whole.stream);
    write_table(&file->table, whole.stream);
    return whole_file_commit(&whole, err);
}
