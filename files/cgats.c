// SPDX-License-Identifier: Apache-2.0
#include "files/cgats.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "files/text.h"
#include "files/write.h"

enum { BYTES_MOST = 1 << 30, FIELDS_MOST = 4096, KEYWORDS_MOST = 4096, CELLS_MOST = 100000000 };

struct token {
    const char *text;
    size_t size;
    int line;
    bool quoted, first; // first of its line
};

struct reader {
    const char *path, *at, *end;
    int line;
    bool fresh; // nothing of this line was taken yet
    struct token token;
    struct error *err;
};

// What NUMBER_OF_FIELDS and NUMBER_OF_SETS promise; line 0 = not given.
struct promise {
    size_t count;
    int line;
};

struct building {
    struct cgats *file;
    struct promise fields, sets;
    int format_line, label_column, odd_line;
    size_t cells, room;
};

void cgats_fini(struct cgats *file)
{
    for (size_t i = 0; i < file->keyword_count; i++) {
        free(file->keywords[i].name);
        free(file->keywords[i].value);
    }
    free(file->keywords);
    table_fini(&file->table);
    *file = (struct cgats){0};
}

static bool out_of_memory(struct reader *r)
{
    return fail(r->err, ERROR_SYSTEM, "%s:%d: out of memory", r->path, r->line);
}

static bool is(const struct token *token, const char *word)
{
    return !token->quoted && token->size == strlen(word) && !memcmp(token->text, word, token->size);
}

static bool begins(const struct token *token, const char *word)
{
    return !token->quoted && token->size > strlen(word) && !memcmp(token->text, word, strlen(word));
}

static const char *shown_token(const struct token *token, char shown[TEXT_SHOWN])
{
    return text_shown(shown, token->text, token->size);
}

static void undouble_quotes(char *text)
{
    char *to = text;
    for (; *text; text++) {
        *to++ = *text;
        if (text[0] == '"' && text[1] == '"')
            text++;
    }
    *to = 0;
}

// A token's text: bytes outside UTF-8 as '?', doubled quotes single.
static char *copy_text(const struct token *token)
{
    char *copy = strndup(token->text, token->size);
    if (!copy)
        return NULL;
    for (size_t at = 0; (at += text_utf8_end(copy + at, token->size - at)) < token->size;)
        copy[at++] = '?';
    if (token->quoted)
        undouble_quotes(copy);
    return copy;
}

static void skip_blanks(struct reader *r)
{
    while (r->at < r->end) {
        if (*r->at == '#') {
            const char *stop = memchr(r->at, '\n', r->end - r->at);
            r->at = stop ? stop : r->end;
        } else if (*r->at == '\n') {
            r->line++, r->at++;
            r->fresh = true;
        } else if (strchr(" \t\r\v\f", *r->at)) {
            r->at++;
        } else {
            return;
        }
    }
}

// Reads the next token. False at the end of the file (*end) or with err.
static bool next(struct reader *r, bool *end)
{
    skip_blanks(r);
    *end = r->at == r->end;
    if (*end)
        return false;
    r->token = (struct token){r->at, 0, r->line, *r->at == '"', r->fresh};
    r->fresh = false;
    if (!r->token.quoted) {
        while (r->at < r->end && !strchr(" \t\r\n\v\f", *r->at))
            r->at++;
        r->token.size = r->at - r->token.text;
        return true;
    }
    const char *from = ++r->at;
    while (r->at < r->end && *r->at != '\n' &&
           (*r->at != '"' || (r->at + 1 < r->end && r->at[1] == '"')))
        r->at += *r->at == '"' ? 2 : 1;
    if (r->at >= r->end || *r->at != '"')
        return fail(r->err, ERROR_DATA, "%s:%d: a quote is not closed on its line", r->path,
                    r->line);
    r->token.text = from;
    r->token.size = r->at++ - from;
    return true;
}

static bool need(struct reader *r, const char *what)
{
    bool end;
    if (next(r, &end))
        return true;
    return end ? fail(r->err, ERROR_DATA, "%s:%d: the file ends before %s", r->path, r->line, what)
               : false;
}

static bool last_of_line(struct reader *r)
{
    const char *at = r->at;
    while (at < r->end && strchr(" \t\r\v\f", *at))
        at++;
    return at == r->end || *at == '\n' || *at == '#';
}

static bool is_name(const struct token *token)
{
    if (token->quoted || !token->size || !isalpha((unsigned char)*token->text))
        return false;
    for (size_t i = 0; i < token->size; i++)
        if (!isalnum((unsigned char)token->text[i]) && !strchr("._/-+:", token->text[i]))
            return false;
    return true;
}

static bool is_identifier(struct reader *r)
{
    return is_name(&r->token) && r->token.size < sizeof((struct cgats *)0)->identifier &&
           r->token.first && last_of_line(r) && !begins(&r->token, "BEGIN_") &&
           !begins(&r->token, "END_");
}

// The value of a keyword: one token on the keyword's own line.
static bool read_value(struct reader *r, const struct token *name)
{
    bool end;
    char shown[TEXT_SHOWN];
    shown_token(name, shown);
    if (last_of_line(r))
        return fail(r->err, ERROR_DATA, "%s:%d: %s: has no value; allowed: one value on its line",
                    r->path, name->line, shown);
    if (!next(r, &end))
        return false;
    if (!last_of_line(r))
        return fail(r->err, ERROR_DATA,
                    "%s:%d: %s: more than one value; allowed: one (in quotes if it has blanks)",
                    r->path, name->line, shown);
    return true;
}

static bool read_promise(struct reader *r, struct promise *promise, size_t most)
{
    struct token name = r->token;
    char shown[2][TEXT_SHOWN];
    double count;
    shown_token(&name, shown[0]);
    if (promise->line)
        return fail(r->err, ERROR_DATA, "%s:%d: %s: given a second time; allowed: once", r->path,
                    name.line, shown[0]);
    if (!read_value(r, &name))
        return false;
    if (text_number(r->token.text, r->token.size, &count) != TEXT_NUMBER || count != floor(count) ||
        count < 1 || count > most)
        return fail(r->err, ERROR_DATA, "%s:%d: %s: \"%s\"; allowed: a whole number 1..%zu",
                    r->path, name.line, shown[0], shown_token(&r->token, shown[1]), most);
    *promise = (struct promise){(size_t)count, name.line};
    return true;
}

static bool add_keyword(struct reader *r, struct cgats *file, const struct token *name)
{
    char shown[TEXT_SHOWN];
    if (file->keyword_count == KEYWORDS_MOST)
        return fail(r->err, ERROR_DATA, "%s:%d: more than %d keywords", r->path, r->line,
                    KEYWORDS_MOST);
    struct cgats_keyword *more = realloc(file->keywords, (file->keyword_count + 1) * sizeof *more);
    if (!more)
        return out_of_memory(r);
    file->keywords = more;
    struct cgats_keyword k = {strndup(name->text, name->size), copy_text(&r->token), name->line};
    more[file->keyword_count++] = k;
    if (!k.name || !k.value)
        return out_of_memory(r);
    for (size_t i = 0; i + 1 < file->keyword_count; i++)
        if (!strcmp(more[i].name, k.name) && strcmp(more[i].value, k.value))
            return fail(r->err, ERROR_DATA, "%s:%d: %s: \"%s\" contradicts line %d", r->path,
                        k.line, k.name, text_shown(shown, k.value, strlen(k.value)), more[i].line);
    return true;
}

static bool read_keyword(struct reader *r, struct cgats *file)
{
    struct token name = r->token;
    char shown[TEXT_SHOWN];
    if (!is_name(&name) || !name.first || begins(&name, "END_"))
        return fail(r->err, ERROR_DATA, "%s:%d: \"%s\"; allowed: a keyword and its value", r->path,
                    name.line, shown_token(&name, shown));
    if (!read_value(r, &name))
        return false;
    return is(&name, "KEYWORD") || add_keyword(r, file, &name);
}

// Programs leave blocks of their own between BEGIN_X and END_X lines.
static bool skip_block(struct reader *r)
{
    struct token begin = r->token;
    size_t size = begin.size - strlen("BEGIN_");
    while (r->at < r->end) {
        const char *stop = memchr(r->at, '\n', r->end - r->at);
        const char *line = r->at;
        r->at = stop ? stop : r->end;
        while (line < r->at && isspace((unsigned char)*line))
            line++;
        size_t left = r->at - line;
        if (left >= size + 4 && !memcmp(line, "END_", 4) &&
            !memcmp(line + 4, begin.text + strlen("BEGIN_"), size) &&
            (left == size + 4 || isspace((unsigned char)line[size + 4])))
            return true;
        r->line += stop != NULL;
        r->at += stop != NULL;
    }
    char shown[TEXT_SHOWN];
    return fail(r->err, ERROR_DATA, "%s:%d: %s: the file ends before its END", r->path, begin.line,
                shown_token(&begin, shown));
}

static bool add_field(struct reader *r, struct table *table)
{
    char shown[TEXT_SHOWN];
    shown_token(&r->token, shown);
    if (!is_name(&r->token))
        return fail(r->err, ERROR_DATA, "%s:%d: \"%s\" is no field name", r->path, r->token.line,
                    shown);
    if (table->columns == FIELDS_MOST)
        return fail(r->err, ERROR_DATA, "%s:%d: more than %d fields", r->path, r->token.line,
                    FIELDS_MOST);
    char **more = realloc(table->names, (table->columns + 1) * sizeof *more);
    if (!more)
        return out_of_memory(r);
    table->names = more;
    char *name = more[table->columns] = strndup(r->token.text, r->token.size);
    if (!name)
        return out_of_memory(r);
    table->columns++;
    return table_column(table, name) == (int)table->columns - 1 ||
           fail(r->err, ERROR_DATA, "%s:%d: field %s: given a second time; allowed: once", r->path,
                r->token.line, shown);
}

static bool is_text_field(const char *name)
{
    static const char *const TEXT_FIELDS[] = {"SAMPLE_ID", "SAMPLE_LOC", "SAMPLE_NAME", "STRING"};
    for (int i = 0; i < 4; i++)
        if (!strcmp(name, TEXT_FIELDS[i]))
            return true;
    return false;
}

static bool read_format(struct reader *r, struct building *b)
{
    struct table *table = &b->file->table;
    if (b->format_line)
        return fail(r->err, ERROR_DATA, "%s:%d: BEGIN_DATA_FORMAT: given a second time", r->path,
                    r->token.line);
    b->format_line = r->token.line;
    for (;;) {
        if (!need(r, "END_DATA_FORMAT"))
            return false;
        if (is(&r->token, "END_DATA_FORMAT"))
            break;
        if (!add_field(r, table))
            return false;
    }
    if (!table->columns)
        return fail(r->err, ERROR_DATA, "%s:%d: BEGIN_DATA_FORMAT: names no field", r->path,
                    b->format_line);
    b->label_column = table_column(table, "SAMPLE_ID");
    if (b->label_column < 0)
        b->label_column = table_column(table, "SAMPLE_NAME");
    return true;
}

static bool make_room(struct reader *r, struct building *b)
{
    struct table *t = &b->file->table;
    if (t->rows < b->room)
        return true;
    if ((t->rows + 1) * t->columns > CELLS_MOST)
        return fail(r->err, ERROR_DATA, "%s:%d: more than %d cells", r->path, r->line, CELLS_MOST);
    size_t rows = b->room ? 2 * b->room : 1;
    int *lines = realloc(t->lines, rows * sizeof *lines);
    if (lines)
        t->lines = lines;
    double *values = realloc(t->values, rows * t->columns * sizeof *values);
    if (values)
        t->values = values;
    char **labels = b->label_column < 0 ? NULL : realloc(t->labels, rows * sizeof *labels);
    if (labels)
        t->labels = labels;
    if (!lines || !values || (b->label_column >= 0 && !labels))
        return out_of_memory(r);
    b->room = rows;
    return true;
}

static bool add_cell(struct reader *r, struct building *b)
{
    struct table *t = &b->file->table;
    const struct token *token = &r->token;
    size_t column = b->cells % t->columns;
    if (token->first != !column && !b->odd_line)
        b->odd_line = token->line;
    if (!column) {
        if (!make_room(r, b))
            return false;
        if (t->labels)
            t->labels[t->rows] = NULL;
        t->lines[t->rows++] = token->line;
    }
    if ((int)column == b->label_column && !(t->labels[t->rows - 1] = copy_text(token)))
        return out_of_memory(r);
    char shown[TEXT_SHOWN];
    double *value = &t->values[b->cells++];
    *value = NAN;
    if (is_text_field(t->names[column]) ||
        text_number(token->text, token->size, value) == TEXT_NUMBER)
        return true;
    return fail(r->err, ERROR_DATA, "%s:%d: field %.60s: \"%s\" %s", r->path, token->line,
                t->names[column], shown_token(token, shown),
                text_number_fault(token->text, token->size));
}

static bool check_promises(struct reader *r, const struct building *b)
{
    const struct table *t = &b->file->table;
    char hint[64] = "";
    if (b->odd_line)
        snprintf(hint, sizeof hint, "; rows leave their lines at line %d", b->odd_line);
    if (b->cells % t->columns)
        return fail(r->err, ERROR_DATA,
                    "%s:%d: BEGIN_DATA..END_DATA holds %zu cells, which is not "
                    "a multiple of the %zu fields%s",
                    r->path, r->token.line, b->cells, t->columns, hint);
    if (b->sets.line && b->sets.count != t->rows)
        return fail(r->err, ERROR_DATA,
                    "%s:%d: NUMBER_OF_SETS: %zu contradicts the %zu rows of the data%s", r->path,
                    b->sets.line, b->sets.count, t->rows, hint);
    if (!t->rows)
        return fail(r->err, ERROR_DATA, "%s:%d: BEGIN_DATA..END_DATA holds no row", r->path,
                    r->token.line);
    return true;
}

static bool read_data(struct reader *r, struct building *b)
{
    const struct table *t = &b->file->table;
    if (!b->format_line)
        return fail(r->err, ERROR_DATA, "%s:%d: BEGIN_DATA: stands before BEGIN_DATA_FORMAT",
                    r->path, r->token.line);
    if (b->fields.line && b->fields.count != t->columns)
        return fail(r->err, ERROR_DATA,
                    "%s:%d: NUMBER_OF_FIELDS: %zu contradicts the %zu fields that line %d names",
                    r->path, b->fields.line, b->fields.count, t->columns, b->format_line);
    for (;;) {
        if (!need(r, "END_DATA"))
            return false;
        if (is(&r->token, "END_DATA"))
            return check_promises(r, b);
        if (!add_cell(r, b))
            return false;
    }
}

// From behind the identifier to END_DATA; the token that follows the
// identifier is at hand.
static bool read_table(struct reader *r, struct cgats *file)
{
    struct building b = {.file = file};
    for (;;) {
        bool ok;
        if (is(&r->token, "BEGIN_DATA"))
            return read_data(r, &b);
        if (is(&r->token, "NUMBER_OF_FIELDS"))
            ok = read_promise(r, &b.fields, FIELDS_MOST);
        else if (is(&r->token, "NUMBER_OF_SETS"))
            ok = read_promise(r, &b.sets, CELLS_MOST);
        else if (is(&r->token, "BEGIN_DATA_FORMAT"))
            ok = read_format(r, &b);
        else if (begins(&r->token, "BEGIN_"))
            ok = skip_block(r);
        else
            ok = read_keyword(r, file);
        if (!ok || !need(r, "BEGIN_DATA"))
            return false;
    }
}

static bool read_first(struct reader *r, struct cgats *file)
{
    char shown[TEXT_SHOWN];
    if (!need(r, "an identifier"))
        return false;
    if (!is_identifier(r))
        return fail(r->err, ERROR_DATA,
                    "%s:%d: \"%s\"; allowed: an identifier such as CTI3 or SPECT on its own line",
                    r->path, r->token.line, shown_token(&r->token, shown));
    memcpy(file->identifier, r->token.text, r->token.size);
    return need(r, "BEGIN_DATA") && read_table(r, file);
}

static bool read_others(struct reader *r, const struct cgats *file)
{
    bool end;
    while (next(r, &end)) {
        if (!strcmp(file->identifier, "SPECT"))
            return fail(r->err, ERROR_DATA, "%s:%d: a second table; allowed: one in a SPECT file",
                        r->path, r->token.line);
        struct cgats other = {0};
        bool ok = (!is_identifier(r) || need(r, "BEGIN_DATA")) && read_table(r, &other);
        cgats_fini(&other);
        if (!ok)
            return false;
    }
    return end;
}

static bool check_bytes(const char *path, const char *text, size_t size, struct error *err)
{
    const char *nul = memchr(text, 0, size);
    if (!nul)
        return true;
    int line = 1;
    for (const char *at = text; at < nul; at++)
        line += *at == '\n';
    return fail(err, ERROR_DATA, "%s:%d: byte 0x00 is not text", path, line);
}

// Line ends of the old Macintosh: a file without any other.
static void mend_line_ends(char *text, size_t size)
{
    if (memchr(text, '\n', size))
        return;
    for (char *at = text; (at = memchr(at, '\r', (size_t)(text + size - at)));)
        *at = '\n';
}

bool cgats_load(const char *path, struct cgats *file, struct error *err)
{
    *file = (struct cgats){0};
    snprintf(file->table.path, sizeof file->table.path, "%s", path);
    size_t size;
    char *text = file_read(path, BYTES_MOST, &size, err);
    bool ok = text && check_bytes(path, text, size, err);
    if (ok) {
        mend_line_ends(text, size);
        size_t mark = size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3) ? 3 : 0;
        struct reader r = {path, text + mark, text + size, 1, true, {0}, err};
        ok = read_first(&r, file) && read_others(&r, file);
    }
    free(text);
    if (!ok)
        cgats_fini(file);
    return ok;
}

bool cgats_load_as(const char *path, const char *identifier, struct cgats *file, struct error *err)
{
    if (!cgats_load(path, file, err))
        return false;
    if (!strcmp(file->identifier, identifier))
        return true;
    fail(err, ERROR_DATA, "%s:1: identifier \"%s\"; allowed: %s", path, file->identifier,
         identifier);
    cgats_fini(file);
    return false;
}

static const struct cgats_keyword *find_keyword(const struct cgats *file, const char *name)
{
    for (size_t i = 0; i < file->keyword_count; i++)
        if (!strcmp(file->keywords[i].name, name))
            return &file->keywords[i];
    return NULL;
}

const char *cgats_keyword(const struct cgats *file, const char *name)
{
    const struct cgats_keyword *keyword = find_keyword(file, name);
    return keyword ? keyword->value : NULL;
}

int cgats_line(const struct cgats *file, const char *name)
{
    const struct cgats_keyword *keyword = find_keyword(file, name);
    return keyword ? keyword->line : 0;
}

bool cgats_numbers(const struct cgats *file, const char *name, double *values, size_t count,
                   struct error *err)
{
    const struct cgats_keyword *keyword = find_keyword(file, name);
    if (!keyword)
        return fail(err, ERROR_DATA, "%s: %s is missing; it must give %zu finite number%s",
                    file->table.path, name, count, count == 1 ? "" : "s");
    const char *at = keyword->value;
    size_t found = 0;
    bool good = true;
    while (good && *(at += strspn(at, " \t"))) {
        size_t size = strcspn(at, " \t");
        double value;
        good = found < count && text_number(at, size, &value) == TEXT_NUMBER;
        if (good)
            values[found++] = value;
        at += size;
    }
    char shown[TEXT_SHOWN];
    return (good && found == count) ||
           fail(err, ERROR_DATA, "%s:%d: %s: \"%s\"; allowed: %zu finite number%s",
                file->table.path, keyword->line, name,
                text_shown(shown, keyword->value, strlen(keyword->value)), count,
                count == 1 ? "" : "s");
}
