// SPDX-License-Identifier: Apache-2.0
#include "files/table.h"

#include <stdlib.h>
#include <string.h>

#include "files/text.h"
#include "files/write.h"

enum { CELLS_MOST = 100000000, COLUMNS_MOST = 65536, BYTES_MOST = 2000000000 };

void table_fini(struct table *table)
{
    for (size_t i = 0; table->names && i < table->columns; i++)
        free(table->names[i]);
    for (size_t i = 0; table->labels && i < table->rows; i++)
        free(table->labels[i]);
    free(table->names);
    free(table->labels);
    free(table->values);
    free(table->lines);
    *table = (struct table){0};
}

int table_column(const struct table *table, const char *name)
{
    for (size_t i = 0; i < table->columns; i++)
        if (!strcmp(table->names[i], name))
            return (int)i;
    return -1;
}

struct csv {
    struct table *table;
    const char *next, *end; // of the text
    const char *at, *stop;  // of the line
    int line;
    char separator;
    size_t names_room, rows_room;
};

struct cell {
    const char *text;
    size_t size;
    bool quoted;
};

static bool out_of_memory(struct csv *csv, struct error *err)
{
    return fail(err, ERROR_SYSTEM, "%s:%d: out of memory", csv->table->path, csv->line);
}

static bool blank(char c)
{
    return c == ' ' || c == '\t';
}

// Between cells that blanks separate, a tab is a blank like any other.
static bool separates(const struct csv *csv, char c)
{
    return c == csv->separator || (csv->separator == ' ' && c == '\t');
}

// Blanks that mean nothing: those before a cell, but no separating tab.
static void skip_padding(struct csv *csv)
{
    while (csv->at < csv->stop && blank(*csv->at) && !(csv->separator == '\t' && *csv->at == '\t'))
        csv->at++;
}

// The next line that says something; ends are LF, CR LF and CR.
static bool next_line(struct csv *csv)
{
    while (csv->next < csv->end) {
        csv->at = csv->stop = csv->next;
        while (csv->stop < csv->end && *csv->stop != '\n' && *csv->stop != '\r')
            csv->stop++;
        csv->next = csv->stop + (csv->stop < csv->end);
        if (csv->next < csv->end && *csv->stop == '\r' && *csv->next == '\n')
            csv->next++;
        csv->line++;
        skip_padding(csv);
        while (csv->at < csv->stop && blank(csv->stop[-1]))
            csv->stop--;
        if (csv->at < csv->stop && *csv->at != '#')
            return true;
    }
    return false;
}

static char separator_of(const char *text, const char *stop)
{
    const char kinds[] = {';', '\t', ',', ' '};
    for (int i = 0; i < 4; i++)
        if (memchr(text, kinds[i], stop - text))
            return kinds[i];
    return ' ';
}

static bool quoted_cell(struct csv *csv, struct cell *cell, struct error *err)
{
    const char *close = memchr(csv->at + 1, '"', csv->stop - csv->at - 1);
    if (!close)
        return fail(err, ERROR_DATA, "%s:%d: a quote is not closed", csv->table->path, csv->line);
    *cell = (struct cell){csv->at + 1, close - csv->at - 1, true};
    csv->at = close + 1;
    return true;
}

static bool text_after_quote(const struct csv *csv, struct error *err)
{
    return fail(err, ERROR_DATA, "%s:%d: text after a closing quote", csv->table->path, csv->line);
}

// Takes one cell off the line; *more tells whether a separator followed it.
static bool take_cell(struct csv *csv, struct cell *cell, bool *more, struct error *err)
{
    skip_padding(csv);
    if (csv->at < csv->stop && *csv->at == '"') {
        if (!quoted_cell(csv, cell, err))
            return false;
    } else {
        const char *from = csv->at, *end;
        while (csv->at < csv->stop && !separates(csv, *csv->at))
            csv->at++;
        for (end = csv->at; end > from && blank(end[-1]);)
            end--;
        *cell = (struct cell){from, end - from, false};
    }
    const char *after = csv->at;
    skip_padding(csv);
    *more = csv->at < csv->stop;
    if (*more && csv->separator == ' ')
        return csv->at > after || text_after_quote(csv, err);
    if (*more && *csv->at != csv->separator)
        return text_after_quote(csv, err);
    csv->at += *more;
    return true;
}

static bool add_name(struct csv *csv, struct cell cell, struct error *err)
{
    struct table *t = csv->table;
    char shown[TEXT_SHOWN];
    if (t->columns == COLUMNS_MOST)
        return fail(err, ERROR_DATA, "%s:%d: more than %d columns", t->path, csv->line,
                    COLUMNS_MOST);
    if (text_utf8_end(cell.text, cell.size) < cell.size)
        return fail(err, ERROR_DATA, "%s:%d: column %zu: name \"%s\" is not UTF-8 text", t->path,
                    csv->line, t->columns + 1, text_shown(shown, cell.text, cell.size));
    if (t->columns == csv->names_room) {
        size_t room = 2 * csv->names_room + 8;
        char **more = realloc(t->names, room * sizeof *more);
        if (!more)
            return out_of_memory(csv, err);
        t->names = more;
        csv->names_room = room;
    }
    if (!(t->names[t->columns] = strndup(cell.text, cell.size)))
        return out_of_memory(csv, err);
    t->columns++;
    return true;
}

static bool is_header(struct cell cell)
{
    double x;
    if (cell.quoted)
        return true;
    if (text_number(cell.text, cell.size, &x) != TEXT_NOT_ONE)
        return false;
    return !cell.size || !strchr("0123456789+-.,", *cell.text);
}

// Names of the first line, or as many empty names as it has cells.
static bool read_names(struct csv *csv, bool *header, struct error *err)
{
    const char *from = csv->at;
    bool more = true;
    *header = false;
    for (size_t i = 0; more; i++) {
        struct cell cell;
        if (!take_cell(csv, &cell, &more, err))
            return false;
        if (!i)
            *header = is_header(cell);
        if (!add_name(csv, *header ? cell : (struct cell){"", 0, false}, err))
            return false;
    }
    csv->at = from;
    return true;
}

static bool make_room(struct csv *csv, struct error *err)
{
    struct table *t = csv->table;
    if ((t->rows + 1) * t->columns > CELLS_MOST)
        return fail(err, ERROR_DATA, "%s:%d: more than %d cells", t->path, csv->line, CELLS_MOST);
    if (t->rows < csv->rows_room)
        return true;
    size_t rows = csv->rows_room ? 2 * csv->rows_room : 1;
    int *lines = realloc(t->lines, rows * sizeof *lines);
    if (lines)
        t->lines = lines;
    double *values = realloc(t->values, rows * t->columns * sizeof *values);
    if (values)
        t->values = values;
    if (!lines || !values)
        return out_of_memory(csv, err);
    csv->rows_room = rows;
    return true;
}

static bool bad_cell(struct csv *csv, size_t column, struct cell cell, struct error *err)
{
    const struct table *t = csv->table;
    char name[TEXT_SHOWN], shown[TEXT_SHOWN];
    text_shown(name, t->names[column], strlen(t->names[column]));
    text_shown(shown, cell.text, cell.size);
    return fail(err, ERROR_DATA, "%s:%d: column %zu%s%s%s: \"%s\" %s", t->path, csv->line,
                column + 1, *name ? " (" : "", name, *name ? ")" : "", shown,
                text_number_fault(cell.text, cell.size));
}

// "1,05" in a table that commas separate reads as 1 and 05.
static bool is_comma_tail(const struct csv *csv, size_t column, struct cell cell)
{
    if (!column || csv->separator != ',' || cell.quoted || cell.size < 2 || *cell.text != '0')
        return false;
    for (size_t i = 0; i < cell.size; i++)
        if (cell.text[i] < '0' || cell.text[i] > '9')
            return false;
    return true;
}

static bool ambiguous(struct csv *csv, size_t column, struct cell cell, struct error *err)
{
    char shown[TEXT_SHOWN];
    text_shown(shown, cell.text, cell.size);
    return fail(err, ERROR_DATA,
                "%s:%d: column %zu: \"%s\" may be a number of its own or what follows a decimal "
                "comma (\",%s\"); allowed: a decimal point, no zero before other digits",
                csv->table->path, csv->line, column + 1, shown, shown);
}

static bool ragged(struct csv *csv, size_t cells, struct error *err)
{
    return fail(err, ERROR_DATA, "%s:%d: row has %s%zu cells; allowed: %zu, as in the first line",
                csv->table->path, csv->line, cells > csv->table->columns ? "at least " : "", cells,
                csv->table->columns);
}

static bool read_row(struct csv *csv, struct error *err)
{
    struct table *t = csv->table;
    if (!make_room(csv, err))
        return false;
    bool more = true;
    size_t column = 0;
    for (; more; column++) {
        struct cell cell;
        if (!take_cell(csv, &cell, &more, err))
            return false;
        if (column == t->columns)
            return ragged(csv, column + 1, err);
        double *value = &t->values[t->rows * t->columns + column];
        if (text_number(cell.text, cell.size, value) != TEXT_NUMBER)
            return bad_cell(csv, column, cell, err);
        if (is_comma_tail(csv, column, cell))
            return ambiguous(csv, column, cell, err);
    }
    if (column < t->columns)
        return ragged(csv, column, err);
    t->lines[t->rows++] = csv->line;
    return true;
}

static bool read_rows(struct csv *csv, struct error *err)
{
    bool header, more = next_line(csv);
    if (!more)
        return fail(err, ERROR_DATA, "%s: holds no row of numbers", csv->table->path);
    csv->separator = separator_of(csv->at, csv->stop);
    if (!read_names(csv, &header, err))
        return false;
    if (header)
        more = next_line(csv);
    for (; more; more = next_line(csv))
        if (!read_row(csv, err))
            return false;
    return csv->table->rows ||
           fail(err, ERROR_DATA, "%s: holds no row of numbers", csv->table->path);
}

bool csv_parse(const char *path, const char *text, size_t size, struct table *table,
               struct error *err)
{
    *table = (struct table){0};
    snprintf(table->path, sizeof table->path, "%s", path);
    struct csv csv = {.table = table, .next = text, .end = text + size};
    if (size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3))
        csv.next += 3;
    if (read_rows(&csv, err))
        return true;
    table_fini(table);
    return false;
}

bool csv_load(const char *path, struct table *table, struct error *err)
{
    *table = (struct table){0};
    size_t size;
    char *text = file_read(path, BYTES_MOST, &size, err);
    bool ok = text && csv_parse(path, text, size, table, err);
    free(text);
    return ok;
}
