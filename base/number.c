// SPDX-License-Identifier: Apache-2.0
#include "base/number.h"

#include <stdio.h>
#include <stdlib.h>

const char *number_text(char text[NUMBER_TEXT], double value)
{
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, NUMBER_TEXT, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    return text;
}
