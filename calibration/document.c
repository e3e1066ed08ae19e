// SPDX-License-Identifier: Apache-2.0
#include "calibration/document.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static const struct document_writer *const WRITERS[] = {
    [DOCUMENT_HTML] = &document_html,
    [DOCUMENT_TEXT] = &document_text,
    [DOCUMENT_PDF] = &document_pdf,
};

struct document *document_begin(enum document_form form, const char *title, const char *date,
                                FILE *out, struct error *err)
{
    struct document *d = WRITERS[form]->begin(title, date, out);
    if (!d)
        fail(err, ERROR_SYSTEM, "out of memory for a document");
    return d;
}

static char *said(struct document *d, const char *format, va_list args)
{
    char *text = NULL;
    if (vasprintf(&text, format, args) >= 0)
        return text;
    fail(&d->failure, ERROR_SYSTEM, "out of memory for a document");
    return NULL;
}

void document_heading(struct document *d, int level, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    char *text = said(d, format, args);
    va_end(args);
    if (text)
        d->writer->heading(d, level, text);
    free(text);
}

void document_paragraph(struct document *d, enum tone tone, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    char *text = said(d, format, args);
    va_end(args);
    if (text)
        d->writer->paragraph(d, tone, text);
    free(text);
}

void document_chart(struct document *d, const char *svg, size_t size)
{
    d->writer->chart(d, svg, size);
}

void document_picture(struct document *d, const char *path, const char *caption)
{
    d->writer->picture(d, path, caption);
}

void document_verbatim(struct document *d, const char *text, const char *where)
{
    d->writer->verbatim(d, text, where);
}

void document_seal(struct document *d)
{
    d->writer->seal(d);
}

bool document_end(struct document *d, struct error *err)
{
    d->writer->end(d);
    if (!d->failure.code && fflush(d->out))
        fail_errno(&d->failure, "a document cannot be written");
    bool fine = !d->failure.code;
    if (!fine && err)
        *err = d->failure;
    free(d);
    return fine;
}

// ---- tables ------------------------------------------------------------------------

static bool table_room(struct document_table *t)
{
    if (t->rows + 1 < t->room)
        return true;
    int room = t->room ? 2 * t->room : 32;
    char **cells = realloc(t->cells, (size_t)room * t->columns * sizeof *cells);
    if (cells)
        t->cells = cells;
    enum tone *tones = realloc(t->tones, (size_t)room * sizeof *tones);
    if (tones)
        t->tones = tones;
    if (cells && tones)
        t->room = room;
    t->failed = t->failed || !cells || !tones;
    return cells && tones;
}

// Row -1 is the header.
static void take_cells(struct document_table *t, int row, enum tone tone, const char *text)
{
    t->tones[row + 1] = tone;
    for (int c = 0; c < t->columns; c++) {
        size_t size = strcspn(text, "\t");
        char *cell = strndup(text, size);
        t->failed = t->failed || !cell;
        t->cells[(size_t)(row + 1) * t->columns + c] = cell;
        text += size + (text[size] == '\t');
    }
}

void table_begin(struct document_table *t, const char *header)
{
    *t = (struct document_table){.columns = 1};
    for (const char *p = header; *p; p++)
        t->columns += *p == '\t';
    if (table_room(t))
        take_cells(t, -1, TONE_PLAIN, header);
}

void table_row(struct document_table *t, enum tone tone, const char *format, ...)
{
    va_list args;
    char *text = NULL;
    va_start(args, format);
    bool fine = vasprintf(&text, format, args) >= 0;
    va_end(args);
    if (!fine)
        text = NULL;
    if (text && !t->failed && table_room(t))
        take_cells(t, t->rows++, tone, text);
    t->failed = t->failed || !text;
    free(text);
}

void document_table(struct document *d, struct document_table *t)
{
    if (t->failed)
        fail(&d->failure, ERROR_SYSTEM, "out of memory for a table");
    else if (t->rows)
        d->writer->table(d, t);
    for (int i = 0; t->cells && i < (t->rows + (t->room > 0)) * t->columns; i++)
        free(t->cells[i]);
    free(t->cells);
    free(t->tones);
    *t = (struct document_table){0};
}
