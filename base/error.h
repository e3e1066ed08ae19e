// SPDX-License-Identifier: Apache-2.0
// One error, filled where it happens, given context on its way up, and logged
// once at the top. Library folders never print.
#ifndef BASE_ERROR_H
#define BASE_ERROR_H

#include <stdbool.h>

// The code names the remedy, the text names the fact.
#define ERROR_CODES(X)                                                                             \
    X(NONE, "none")     /* nothing went wrong */                                                   \
    X(RETRY, "retry")   /* the same call may succeed later (time-out, busy) */                     \
    X(GONE, "gone")     /* the device or peer is no longer there: reopen */                        \
    X(DATA, "data")     /* what was read is not what it claims to be */                            \
    X(RANGE, "range")   /* an argument or a value lies outside its range */                        \
    X(CONFIG, "config") /* a setting or an input file must be corrected */                         \
    X(SYSTEM, "system") /* the operating system said no */

enum error_code {
#define X(name, text) ERROR_##name,
    ERROR_CODES(X)
#undef X
};

// Holds one failure. A caller passes it zeroed or re-used; every failing
// function overwrites it. May be NULL wherever a function takes one.
struct error {
    enum error_code code;
    char text[512]; // one line without control characters ('?'), cut at the end if longer
};

// Fills err (when not NULL) with a printf-style text. Always returns false, so
// that a function can end with `return fail(...)`.
bool fail(struct error *err, enum error_code code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// As fail(ERROR_SYSTEM, ...) with ": " and strerror(errno) appended.
bool fail_errno(struct error *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Puts context before the text of a filled err: "context: text". Keeps the
// code. Always returns false.
bool while_doing(struct error *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

// What a program ends with after this error, one rule for all of them: 2 when a
// setting, an input file or an argument must be corrected (CONFIG, DATA,
// RANGE), else 1.
int error_exit_code(const struct error *err);

// The lower-case name of a code, such as "retry". Never NULL.
const char *error_code_name(enum error_code code);

#endif
