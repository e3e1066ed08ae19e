// SPDX-License-Identifier: Apache-2.0
#include "calibration/lines.h"

#include <stdlib.h>
#include <string.h>

#include "files/text.h"

static const char GAP[] = " \t,;\r\v\f";

void lines_fini(struct lines *l)
{
    free(l->text);
    *l = (struct lines){0};
}

static bool make_room(struct lines *l, size_t size, struct error *err)
{
    if (size > LINE_MOST)
        return fail(err, ERROR_DATA, "%s:%d: the line is longer than %d bytes", l->name, l->number,
                    LINE_MOST);
    if (size < l->room)
        return true;
    size_t room = l->room ? 2 * l->room : 256;
    char *more = realloc(l->text, room);
    if (!more)
        return fail(err, ERROR_SYSTEM, "%s:%d: out of memory", l->name, l->number);
    l->text = more;
    l->room = room;
    return true;
}

static bool read_line(struct lines *l, bool *end, struct error *err)
{
    size_t size = 0;
    int c = getc_unlocked(l->in);
    l->number++;
    *end = c == EOF;
    for (; c != EOF && c != '\n'; c = getc_unlocked(l->in)) {
        if (!c)
            return fail(err, ERROR_DATA, "%s:%d: byte 0x00 is not text", l->name, l->number);
        if (!make_room(l, size + 1, err))
            return false;
        l->text[size++] = (char)c;
    }
    if (ferror(l->in)) {
        *end = false;
        return fail_errno(err, "%s", l->name);
    }
    if (*end || !make_room(l, size, err))
        return false;
    l->text[size] = 0;
    if (l->number == 1 && !strncmp(l->text, "\xef\xbb\xbf", 3))
        memmove(l->text, l->text + 3, size - 2);
    return true;
}

bool lines_next(struct lines *l, bool *end, struct error *err)
{
    while (read_line(l, end, err)) {
        const char *at = l->text + strspn(l->text, GAP);
        if (*at && *at != '#')
            return true;
    }
    return false;
}

// Commas with a digit at once behind them, in a line that also has other gaps.
static bool has_decimal_commas(const char *text)
{
    size_t size = strlen(text);
    while (size && strchr(GAP, text[size - 1]))
        size--;
    bool other = false, tail = false;
    for (size_t i = strspn(text, GAP); i < size; i++) {
        other |= text[i] != ',' && strchr(GAP, text[i]);
        tail |= text[i] == ',' && text[i + 1] >= '0' && text[i + 1] <= '9';
    }
    return other && tail;
}

bool line_numbers(const char *text, int count, const char *names, double *v, struct error *err)
{
    char shown[TEXT_SHOWN];
    if (has_decimal_commas(text))
        return fail(err, ERROR_DATA,
                    "\"%s\" may hold decimal commas; allowed: numbers with a decimal point, a blank "
                    "behind commas if there are blanks",
                    text_shown(shown, text, strlen(text)));
    const char *at = text + strspn(text, GAP);
    for (int i = 0; i < count; i++) {
        size_t size = strcspn(at, GAP);
        if (!size)
            return fail(err, ERROR_DATA, "%d number(s); allowed: %s", i, names);
        if (text_number(at, size, &v[i]) != TEXT_NUMBER)
            return fail(err, ERROR_DATA, "\"%s\" %s (%s)", text_shown(shown, at, size),
                        text_number_fault(at, size), names);
        at += size;
        at += strspn(at, GAP);
    }
    return !*at || fail(err, ERROR_DATA, "more than %d numbers; allowed: %s", count, names);
}

bool line_is_header(const char *text)
{
    double x;
    for (const char *at = text + strspn(text, GAP); *at; at += strspn(at, GAP)) {
        size_t size = strcspn(at, GAP);
        if (strchr("0123456789+-.", *at) || text_number(at, size, &x) != TEXT_NOT_ONE)
            return false;
        at += size;
    }
    return true;
}
