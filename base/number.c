// SPDX-License-Identifier: Apache-2.0
#include "base/number.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *number_text(char text[NUMBER_TEXT], double value)
{
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, NUMBER_TEXT, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    return text;
}

bool number_parse(const char *text, const char **end, double *value)
{
    char *stop;
    size_t decimal = strspn(text, "0123456789+-.eE");
    double x = strtod(text, &stop);
    if (stop == text || !decimal || (size_t)(stop - text) > decimal || !isfinite(x))
        return false;
    *end = stop;
    *value = x;
    return true;
}
