// SPDX-License-Identifier: Apache-2.0
// Numbers as text in files that people read.
#ifndef BASE_NUMBER_H
#define BASE_NUMBER_H

#include <stdbool.h>

enum { NUMBER_TEXT = 32 };

// The shortest of 15, 16 or 17 significant digits that reads back to the very
// same double: 0.1, not 0.10000000000000001. Returns text.
const char *number_text(char text[NUMBER_TEXT], double value);

// The decimal number that text begins with: no blank before it, no hexadecimal,
// no nan, no infinity. *end is set behind it. False, both untouched, when there
// is none.
bool number_parse(const char *text, const char **end, double *value);

#endif
