// SPDX-License-Identifier: Apache-2.0
// Plain text: 96 columns, tables in columns of their own width.
#include <stdlib.h>
#include <string.h>

#include "calibration/document.h"
#include "calibration/seal.h"

enum { WIDTH = 96 };

// Columns that a text takes: every character one.
static int width_of(const char *text)
{
    int n = 0;
    for (; *text; text++)
        n += ((unsigned char)*text & 0xc0) != 0x80;
    return n;
}

static struct document *begin(const char *title, const char *date, FILE *out)
{
    (void)title, (void)date;
    struct document *d = calloc(1, sizeof *d);
    if (d)
        *d = (struct document){.writer = &document_text, .out = out};
    return d;
}

static void heading(struct document *d, int level, const char *text)
{
    fprintf(d->out, "%s%s\n", level == 1 ? "" : "\n", text);
    for (int i = 0; level < 3 && i < width_of(text); i++)
        fputc(level == 1 ? '=' : '-', d->out);
    fputs(level < 3 ? "\n" : "", d->out);
}

static void paragraph(struct document *d, enum tone tone, const char *text)
{
    int at = 0;
    fputs(tone == TONE_NOTE || tone == TONE_BAD ? "! " : "", d->out);
    while (*text) {
        size_t size = strcspn(text, " \n");
        char word[256];
        snprintf(word, sizeof word, "%.*s", (int)size, text);
        if (at && at + 1 + width_of(word) > WIDTH) {
            fputc('\n', d->out);
            at = 0;
        }
        at += fprintf(d->out, at ? " %.*s" : "%.*s", (int)size, text) >= 0
                  ? width_of(word) + (at > 0)
                  : 0;
        text += size + (text[size] != 0);
    }
    fputc('\n', d->out);
}

static void cell(FILE *out, const char *text, int width, bool left)
{
    int blanks = width - width_of(text);
    if (left)
        fputs(text, out);
    for (int i = 0; i < blanks; i++)
        fputc(' ', out);
    if (!left)
        fputs(text, out);
}

static void table(struct document *d, const struct document_table *t)
{
    int *widths = calloc((size_t)t->columns, sizeof *widths);
    if (!widths) {
        fail(&d->failure, ERROR_SYSTEM, "out of memory for a table");
        return;
    }
    for (int row = -1; row < t->rows; row++)
        for (int c = 0; c < t->columns; c++) {
            int w = width_of(table_cell(t, row, c));
            widths[c] = w > widths[c] ? w : widths[c];
        }
    for (int row = -1; row < t->rows; row++) {
        fputs(t->tones[row + 1] == TONE_BAD ? "! " : "  ", d->out);
        for (int c = 0; c < t->columns; c++) {
            fputs(c ? "  " : "", d->out);
            cell(d->out, table_cell(t, row, c), widths[c], c == 0);
        }
        fputc('\n', d->out);
    }
    free(widths);
}

static void chart(struct document *d, const char *svg, size_t size)
{
    (void)d, (void)svg, (void)size;
}

static void picture(struct document *d, const char *path, const char *caption)
{
    fprintf(d->out, "%s: %s\n", caption, path);
}

static void verbatim(struct document *d, const char *text, const char *where)
{
    (void)text;
    fprintf(d->out, "See %s.\n", where);
}

static void seal(struct document *d)
{
    fputs("\n" SEAL_BLANK "\n", d->out);
}

static void end(struct document *d)
{
    (void)d;
}

const struct document_writer document_text = {begin,   heading,  paragraph, table, chart,
                                              picture, verbatim, seal,      end};
