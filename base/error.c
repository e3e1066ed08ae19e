// SPDX-License-Identifier: Apache-2.0
#include "base/error.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const CODE_NAMES[] = {
#define X(name, text) text,
    ERROR_CODES(X)
#undef X
};

// Texts quote what others wrote; a terminal must not obey it. C1 controls are
// two bytes in UTF-8.
static void one_line(char *text)
{
    for (unsigned char *at = (unsigned char *)text; *at; at++) {
        if (*at == '\n' || *at == '\t')
            *at = ' ';
        else if (*at < ' ' || *at == 0x7f)
            *at = '?';
        else if (*at == 0xc2 && at[1] >= 0x80 && at[1] < 0xa0)
            at[0] = at[1] = '?';
    }
}

bool fail(struct error *err, enum error_code code, const char *format, ...)
{
    if (!err)
        return false;
    va_list args;
    va_start(args, format);
    char text[sizeof err->text];
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    one_line(text);
    err->code = code;
    memcpy(err->text, text, sizeof text);
    return false;
}

bool fail_errno(struct error *err, const char *format, ...)
{
    int saved = errno;
    if (!err)
        return false;
    va_list args;
    va_start(args, format);
    char text[sizeof err->text];
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return fail(err, ERROR_SYSTEM, "%s: %s", text, strerror(saved));
}

bool while_doing(struct error *err, const char *format, ...)
{
    if (!err)
        return false;
    va_list args;
    va_start(args, format);
    char context[sizeof err->text];
    vsnprintf(context, sizeof context, format, args);
    va_end(args);
    char text[sizeof err->text];
    memcpy(text, err->text, sizeof text);
    return fail(err, err->code, "%.200s: %s", context, text);
}

int error_exit_code(const struct error *err)
{
    switch (err->code) {
    case ERROR_DATA:
    case ERROR_RANGE:
    case ERROR_CONFIG:
        return 2;
    case ERROR_NONE:
    case ERROR_RETRY:
    case ERROR_GONE:
    case ERROR_SYSTEM:
        return 1;
    }
    return 1;
}

const char *error_code_name(enum error_code code)
{
    return CODE_NAMES[code];
}
