// SPDX-License-Identifier: Apache-2.0
#include "files/ini.h"

#include <ini.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "files/text.h"
#include "files/write.h"

enum { BYTES_MOST = 1 << 24, LINE_MOST = 65000 };

struct reading {
    const char *path;
    const struct settings_section *sections;
    bool *seen; // one per row of all sections, in order
    bool failed;
    struct error *err;
};

// systemd's convention: no comments after a value, no continuation by
// indentation. The library keeps these in its own variables.
static void configure_library(void)
{
    ini_allow_inline_comments = false;
    ini_allow_multiline = false;
    ini_stop_on_first_error = true;
    ini_use_stack = false;
    ini_allow_realloc = true;
    ini_max_line = LINE_MOST + 8;
}

static size_t count_rows(const struct settings_section *section)
{
    size_t count = 0;
    while (section->rows[count].name)
        count++;
    return count;
}

static const struct settings_section *find_section(const struct settings_section *sections,
                                                   const char *name, size_t size, size_t *first_row)
{
    *first_row = 0;
    for (; sections->name; sections++) {
        if (strlen(sections->name) == size && !memcmp(sections->name, name, size))
            return sections;
        *first_row += count_rows(sections);
    }
    return NULL;
}

static void list(char *text, size_t size, const char *word)
{
    size_t used = strlen(text);
    snprintf(text + used, size - used, "%s%s", used ? ", " : "", word);
}

static bool unknown_section(const struct reading *r, const char *name, size_t size,
                            struct error *err)
{
    char allowed[256] = "", shown[TEXT_SHOWN];
    for (const struct settings_section *s = r->sections; s->name; s++)
        list(allowed, sizeof allowed, s->name);
    if (!size)
        return fail(err, ERROR_CONFIG, "a setting before the first [section]; allowed: %s",
                    allowed);
    return fail(err, ERROR_CONFIG, "[%s]: no such section; allowed: %s",
                text_shown(shown, name, size), allowed);
}

static bool unknown_key(const struct settings_section *section, const char *key, const char *value,
                        struct error *err)
{
    char allowed[256] = "", shown[2][TEXT_SHOWN];
    for (const struct setting *row = section->rows; row->name; row++)
        list(allowed, sizeof allowed, row->name);
    return fail(err, ERROR_CONFIG, "[%s] %s = %s: no such setting; allowed: %s", section->name,
                text_shown(shown[0], key, strlen(key)), text_shown(shown[1], value, strlen(value)),
                allowed);
}

static bool take(struct reading *r, const char *name, const char *key, const char *value,
                 struct error *err)
{
    size_t first;
    const struct settings_section *section = find_section(r->sections, name, strlen(name), &first);
    if (!section)
        return unknown_section(r, name, strlen(name), err);
    const struct setting *row = settings_find(section->rows, key);
    if (!row)
        return unknown_key(section, key, value, err);
    bool *seen = &r->seen[first + (row - section->rows)];
    char shown[TEXT_SHOWN];
    if (*seen)
        return fail(err, ERROR_CONFIG, "[%s] %s = %s: given a second time; allowed: once",
                    section->name, key, text_shown(shown, value, strlen(value)));
    *seen = true;
    return settings_set(section->rows, section->target, key, value, err) ||
           while_doing(err, "[%s]", section->name);
}

static int on_setting(void *user, const char *section, const char *key, const char *value)
{
    struct reading *r = user;
    r->failed = !take(r, section, key, value, r->err);
    return !r->failed;
}

// One line before the library sees it: a section nobody knows or a second one
// of a name would otherwise pass when it holds no key.
static bool check_line(struct reading *r, const char *at, const char *end, bool *begun)
{
    char shown[TEXT_SHOWN];
    end -= end > at && end[-1] == '\r';
    size_t size = end - at, bad = text_utf8_end(at, size);
    const char *stray = memchr(at, '\r', size);
    bad = stray && (size_t)(stray - at) < bad ? (size_t)(stray - at) : bad;
    if (bad < size)
        return fail(r->err, ERROR_CONFIG, "byte 0x%02x is not text", (unsigned char)at[bad]);
    if (size > LINE_MOST)
        return fail(r->err, ERROR_CONFIG, "line is longer than %d bytes", LINE_MOST);
    at += strspn(at, " \t");
    const char *close = at < end && *at == '[' ? memchr(at, ']', end - at) : NULL;
    if (!close)
        return true;
    if (close + 1 + strspn(close + 1, " \t") < end)
        return fail(r->err, ERROR_CONFIG, "text after [section]; allowed: nothing");
    size_t first, length = close - at - 1;
    const struct settings_section *section = find_section(r->sections, at + 1, length, &first);
    if (!section)
        return unknown_section(r, length ? at + 1 : "?", length ? length : 1, r->err);
    bool *before = &begun[section - r->sections];
    if (*before)
        return fail(r->err, ERROR_CONFIG, "[%s]: section given a second time; allowed: once",
                    text_shown(shown, at + 1, length));
    return *before = true;
}

static bool check_lines(struct reading *r, const char *text, size_t size)
{
    size_t count = 0;
    while (r->sections[count].name)
        count++;
    bool *begun = calloc(count + 1, sizeof *begun), ok = begun;
    if (!begun)
        return fail(r->err, ERROR_SYSTEM, "%s: out of memory", r->path);
    const char *end = text + size;
    if (size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3))
        text += 3;
    for (int line = 1; ok && text < end; line++) {
        const char *stop = memchr(text, '\n', end - text);
        stop = stop ? stop : end;
        ok = check_line(r, text, stop, begun) || while_doing(r->err, "%s:%d", r->path, line);
        text = stop + 1;
    }
    free(begun);
    return ok;
}

bool ini_complete(const char *path, const struct settings_section *sections, const bool *given,
                  struct error *err)
{
    for (const struct settings_section *s = sections; s->name; s++)
        for (const struct setting *row = s->rows; row->name; row++, given++)
            if (!row->preset && !*given)
                return fail(err, ERROR_CONFIG, "%s: [%s] %s is missing and must be given: %s", path,
                            s->name, row->name, row->help);
    return true;
}

// The line a syntax error stands on, for its text.
static void show_line(char shown[TEXT_SHOWN], const char *text, int line)
{
    while (--line > 0)
        text = strchr(text, '\n') + 1;
    text_shown(shown, text, strcspn(text, "\r\n"));
}

static bool parse(struct reading *r, const char *text)
{
    char shown[TEXT_SHOWN];
    int line = ini_parse_string(text, on_setting, r);
    if (r->failed)
        return while_doing(r->err, "%s:%d", r->path, line);
    if (line < 0)
        return fail(r->err, ERROR_SYSTEM, "%s: out of memory", r->path);
    if (!line)
        return true;
    show_line(shown, text, line);
    return fail(r->err, ERROR_CONFIG,
                "%s:%d: \"%s\" is neither [section], key = value nor a # comment", r->path, line,
                shown);
}

size_t ini_rows(const struct settings_section *sections)
{
    size_t rows = 0;
    for (const struct settings_section *s = sections; s->name; s++)
        rows += count_rows(s);
    return rows;
}

static bool read_onto(const char *path, const struct settings_section *sections, bool *seen,
                      struct error *err)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, configure_library);
    struct error own;
    size_t size;
    char *text = file_read(path, BYTES_MOST, &size, err);
    if (!text)
        return false;
    struct reading r = {path, sections, seen, false, err ? err : &own};
    bool ok = check_lines(&r, text, size) && parse(&r, text);
    free(text);
    return ok;
}

static bool *nothing_seen(const char *path, const struct settings_section *sections,
                          struct error *err)
{
    bool *seen = calloc(ini_rows(sections) + 1, sizeof *seen);
    if (!seen)
        fail(err, ERROR_SYSTEM, "%s: out of memory", path);
    return seen;
}

bool ini_load_onto(const char *path, const struct settings_section *sections, bool *given,
                   struct error *err)
{
    bool *seen = nothing_seen(path, sections, err);
    bool ok = seen && read_onto(path, sections, seen, err);
    for (size_t i = 0; ok && given && i < ini_rows(sections); i++)
        given[i] = given[i] || seen[i];
    free(seen);
    return ok;
}

bool ini_load(const char *path, const struct settings_section *sections, struct error *err)
{
    bool *seen = nothing_seen(path, sections, err);
    for (const struct settings_section *s = sections; s->name; s++)
        settings_preset(s->rows, s->target);
    bool ok =
        seen && read_onto(path, sections, seen, err) && ini_complete(path, sections, seen, err);
    free(seen);
    return ok;
}

// Would ini_load take this value back?
static bool check_value(const struct setting *row, const char *text, struct error *err)
{
    size_t size = strlen(text);
    bool stripped = size && (strchr(" \t", *text) || strchr(" \t", text[size - 1]));
    if (stripped || text_utf8_end(text, size) < size || strpbrk(text, "\r\n"))
        return fail(err, ERROR_CONFIG,
                    "%s: text must be one line of UTF-8 without blanks at its ends", row->name);
    struct setting alone[2] = {*row, {0}};
    alone->offset = 0;
    size_t room = row->type == SETTING_VECTOR ? row->size * sizeof(double) : row->size + 1;
    void *scratch = malloc(room < sizeof(double) ? sizeof(double) : room);
    if (!scratch)
        return fail(err, ERROR_SYSTEM, "%s: out of memory", row->name);
    bool ok = settings_set(alone, scratch, row->name, text, err);
    free(scratch);
    return ok;
}

static bool check_section(const struct settings_section *section, struct error *err)
{
    for (const struct setting *row = section->rows; row->name; row++) {
        size_t room = 64 + row->size * (row->type == SETTING_VECTOR ? 32 : 1);
        char *text = malloc(room);
        if (!text)
            return fail(err, ERROR_SYSTEM, "out of memory");
        settings_get(row, section->target, text, room);
        bool ok = check_value(row, text, err) || while_doing(err, "[%s]", section->name);
        free(text);
        if (!ok)
            return false;
    }
    return true;
}

bool ini_save(const char *path, const struct settings_section *sections, struct error *err)
{
    for (const struct settings_section *s = sections; s->name; s++)
        if (!check_section(s, err))
            return while_doing(err, "%s: not written", path);
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    for (const struct settings_section *s = sections; s->name; s++) {
        if (s != sections)
            fputc('\n', file.stream);
        settings_write(s, file.stream);
    }
    return whole_file_commit(&file, err);
}
