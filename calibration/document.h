// SPDX-License-Identifier: Apache-2.0
// A report's words, tables and charts, said once and written in several forms:
// a self-contained HTML page, plain text, PDF. Text is UTF-8. A writer keeps
// its first failure; document_end tells it.
#ifndef CALIBRATION_DOCUMENT_H
#define CALIBRATION_DOCUMENT_H

#include <stdio.h>

#include "base/error.h"

enum document_form { DOCUMENT_HTML, DOCUMENT_TEXT, DOCUMENT_PDF };

enum tone {
    TONE_PLAIN,
    TONE_MUTED, // of others, for comparison
    TONE_NOTE,  // to be seen first
    TONE_BAD,   // missed, outside, failed
};

struct document;

// out must outlive the document. NULL with err (SYSTEM) on failure. date: of
// the PDF's own record, "2026-01-31T12:34:56Z", "" = none.
struct document *document_begin(enum document_form form, const char *title, const char *date,
                                FILE *out, struct error *err);

// level 1 (title) .. 3.
void document_heading(struct document *d, int level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

void document_paragraph(struct document *d, enum tone tone, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// An SVG of svg.h. Text leaves it out.
void document_chart(struct document *d, const char *svg, size_t size);

// A PNG, embedded. Text leaves it out. A file that cannot be read fails the
// document.
void document_picture(struct document *d, const char *path, const char *caption);

// Long text for machines, line by line. PDF says instead where it stands.
void document_verbatim(struct document *d, const char *text, const char *where);

// The last words, in small: the blank of seal.h; PDF puts it behind its end.
void document_seal(struct document *d);

// Finishes and frees. False with the first failure.
bool document_end(struct document *d, struct error *err);

// ---- tables ------------------------------------------------------------------------

// Cells are separated by tabs; the first column is flush left, the others
// right. Too many cells are left out, missing ones stay empty.
struct document_table {
    int columns, rows, room; // rows: without the header
    char **cells;            // [1 + rows][columns], owned
    enum tone *tones;        // [1 + rows], owned
    bool failed;             // out of memory
};

void table_begin(struct document_table *t, const char *header);
void table_row(struct document_table *t, enum tone tone, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Writes the table, unless it has no rows, and frees it.
void document_table(struct document *d, struct document_table *t);

// ---- for the forms -------------------------------------------------------------------

struct document {
    const struct document_writer *writer;
    FILE *out;
    struct error failure; // code NONE while all is well
};

// Each form fills this and puts struct document first into its own.
struct document_writer {
    struct document *(*begin)(const char *title, const char *date, FILE *out);
    void (*heading)(struct document *d, int level, const char *text);
    void (*paragraph)(struct document *d, enum tone tone, const char *text);
    void (*table)(struct document *d, const struct document_table *t);
    void (*chart)(struct document *d, const char *svg, size_t size);
    void (*picture)(struct document *d, const char *path, const char *caption);
    void (*verbatim)(struct document *d, const char *text, const char *where);
    void (*seal)(struct document *d);
    void (*end)(struct document *d); // frees what is the form's own, not d
};

extern const struct document_writer document_html, document_text, document_pdf;

// Cell of a row; row -1 is the header.
static inline const char *table_cell(const struct document_table *t, int row, int column)
{
    return t->cells[(size_t)(row + 1) * t->columns + column];
}

#endif
