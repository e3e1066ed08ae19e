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

bool fail(struct error *err, enum error_code code, const char *format, ...)
{
    if (!err)
        return false;
    va_list args;
    va_start(args, format);
    char text[sizeof err->text];
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
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

const char *error_code_name(enum error_code code)
{
    return CODE_NAMES[code];
}
