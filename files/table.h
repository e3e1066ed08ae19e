// SPDX-License-Identifier: Apache-2.0
// A plain table of numbers with named columns and its place in a file, as CSV
// and CGATS readers return it.
#ifndef FILES_TABLE_H
#define FILES_TABLE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

// Owned by whoever called the reader; free with table_fini.
struct table {
    char path[512]; // for error texts
    size_t columns, rows;
    char **names;   // [columns]; never NULL, "" when the file names none
    double *values; // [rows][columns]
    int *lines;     // [rows] line of the file a row began on, 1-based
    char **labels;  // [rows] text of the row's label column, or NULL when there is none
};

// Accepts a zeroed table.
void table_fini(struct table *table);

// Index of a column by exact name, or -1.
int table_column(const struct table *table, const char *name);

static inline double table_at(const struct table *table, size_t row, size_t column)
{
    return table->values[row * table->columns + column];
}

// CSV: ',' ';' tab or spaces between cells, '#' comment lines, an optional
// first line of names (a first line whose first cell is no number; names may
// stand in double quotes). The first line decides which separator the file
// uses. Decimal point only: what commas separate and begins with a zero like the
// end of "1,05" is refused as ambiguous. Every row has the same number of cells, every cell a finite
// number; a file that breaks this is refused with file, line, column and
// cell. At most 65536 columns and 100 000 000 cells. Errors: SYSTEM when the file
// cannot be read, DATA when it is not such a table.
bool csv_load(const char *path, struct table *table, struct error *err);

// As csv_load from memory; path is only used in errors.
bool csv_parse(const char *path, const char *text, size_t size, struct table *table,
               struct error *err);

#endif
