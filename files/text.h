// SPDX-License-Identifier: Apache-2.0
// What readers of texts share: is a piece of text a number, is it text at all,
// how does it end, and how is it shown in an error.
#ifndef FILES_TEXT_H
#define FILES_TEXT_H

#include <stdbool.h>
#include <stddef.h>

enum text_number {
    TEXT_NUMBER,   // a finite decimal number
    TEXT_NOT_ONE,  // something else
    TEXT_INFINITE, // nan, inf, or too large for a double
};

// The whole of text as a decimal number: sign, digits, point, exponent; no
// decimal comma, no hexadecimal, no blanks. *value only for TEXT_NUMBER.
enum text_number text_number(const char *text, size_t size, double *value);

// Why a cell that text_number turned down is no good: "is not a number",
// "has a decimal comma (write a point)", "is not finite", "is empty".
const char *text_number_fault(const char *text, size_t size);

enum { TEXT_SHOWN = 64 };

// text for an error: one line, at most 40 bytes, anything unprintable as '?'.
const char *text_shown(char shown[TEXT_SHOWN], const char *text, size_t size);

// Whether text ends so and holds more than that; letter case does not count.
bool text_ends_with(const char *text, const char *end);

// Index of the first byte that is no UTF-8 text (NUL and control characters
// other than tab, line feed and carriage return included), or size.
size_t text_utf8_end(const char *text, size_t size);

#endif
