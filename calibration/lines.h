// SPDX-License-Identifier: Apache-2.0
// Lines of numbers from a stream, as the filters of boothcal read them.
#ifndef CALIBRATION_LINES_H
#define CALIBRATION_LINES_H

#include <stdio.h>

#include "base/error.h"

enum { LINE_MOST = 1 << 20 };

struct lines {
    FILE *in;
    const char *name; // for errors
    int number;       // of the line taken last, 1-based
    char *text;       // that line without its end
    size_t room;
};

void lines_fini(struct lines *l);

// Takes the next line that says something: blank lines and lines that begin
// with '#' are passed over, so is a byte order mark. False at the end (*end) or
// with err: the stream cannot be read, a line is longer than LINE_MOST bytes,
// or holds a NUL byte.
bool lines_next(struct lines *l, bool *end, struct error *err);

// Exactly count finite decimal numbers, separated by blanks, commas or
// semicolons; names says what they are. Refuses (DATA) anything else, and
// commas that may be decimal ones ("1,5 2,5"). Errors do not name the line.
bool line_numbers(const char *text, int count, const char *names, double *v, struct error *err);

// Whether no field of a line is a number or begins like one, as in "L1,a1,b1,L2,a2,b2".
bool line_is_header(const char *text);

#endif
