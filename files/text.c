// SPDX-License-Identifier: Apache-2.0
#include "files/text.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool is_word(const char *text, size_t size, const char *word)
{
    if (size && (*text == '+' || *text == '-'))
        text++, size--;
    return size == strlen(word) && !strncasecmp(text, word, size);
}

enum text_number text_number(const char *text, size_t size, double *value)
{
    if (is_word(text, size, "nan") || is_word(text, size, "inf") || is_word(text, size, "infinity"))
        return TEXT_INFINITE;
    char copy[512];
    if (!size || size >= sizeof copy)
        return TEXT_NOT_ONE;
    memcpy(copy, text, size);
    copy[size] = 0;
    if (strspn(copy, "0123456789+-.eE") != size)
        return TEXT_NOT_ONE;
    char *end;
    double x = strtod(copy, &end);
    if (*end || end == copy)
        return TEXT_NOT_ONE;
    if (!isfinite(x))
        return TEXT_INFINITE;
    *value = x;
    return TEXT_NUMBER;
}

static bool has_decimal_comma(const char *text, size_t size)
{
    char copy[64];
    if (size >= sizeof copy)
        return false;
    memcpy(copy, text, size);
    copy[size] = 0;
    char *comma = strchr(copy, ',');
    double x;
    if (!comma || strchr(comma + 1, ','))
        return false;
    *comma = '.';
    return text_number(copy, size, &x) == TEXT_NUMBER;
}

const char *text_number_fault(const char *text, size_t size)
{
    double x;
    if (!size)
        return "is empty; allowed: a finite number";
    if (text_number(text, size, &x) == TEXT_INFINITE)
        return "is not finite; allowed: a finite number";
    if (has_decimal_comma(text, size))
        return "has a decimal comma; allowed: a number with a decimal point";
    return "is not a number; allowed: a finite number";
}

const char *text_shown(char shown[TEXT_SHOWN], const char *text, size_t size)
{
    size_t kept = size > 40 ? 37 : size;
    for (size_t i = 0; i < kept; i++)
        shown[i] = text[i] >= ' ' && text[i] <= '~' ? text[i] : '?';
    strcpy(shown + kept, size > 40 ? "..." : "");
    return shown;
}

bool text_ends_with(const char *text, const char *end)
{
    size_t size = strlen(text), tail = strlen(end);
    return size > tail && !strcasecmp(text + size - tail, end);
}

// Bytes of the UTF-8 character at s, 0 when it is none (RFC 3629).
static size_t character(const uint8_t *s, size_t size)
{
    if (*s < 0x80)
        return *s >= ' ' ? *s != 0x7f : *s == '\t' || *s == '\n' || *s == '\r';
    size_t bytes = *s >= 0xf0 ? 4 : *s >= 0xe0 ? 3 : 2;
    if (*s < 0xc2 || *s > 0xf4 || size < bytes)
        return 0;
    for (size_t i = 1; i < bytes; i++)
        if ((s[i] & 0xc0) != 0x80)
            return 0;
    bool overlong = (*s == 0xe0 && s[1] < 0xa0) || (*s == 0xf0 && s[1] < 0x90);
    bool beyond = (*s == 0xed && s[1] > 0x9f) || (*s == 0xf4 && s[1] > 0x8f);
    return overlong || beyond ? 0 : bytes;
}

size_t text_utf8_end(const char *text, size_t size)
{
    size_t at = 0;
    while (at < size) {
        size_t bytes = character((const uint8_t *)text + at, size - at);
        if (!bytes)
            break;
        at += bytes;
    }
    return at;
}
