// SPDX-License-Identifier: Apache-2.0
// What tests of config and daemon share.
#ifndef TESTS_FAKES_SUPPORT_H
#define TESTS_FAKES_SUPPORT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define assert_near(a, b, tolerance)                                                               \
    do {                                                                                           \
        double a_ = (a), b_ = (b), off_ = fabs(a_ - b_);                                           \
        if (!(off_ <= (tolerance))) {                                                              \
            print_error("%s: %.12g is not %.12g within %g\n", #a, a_, b_, (double)(tolerance));    \
            _fail(__FILE__, __LINE__);                                                             \
        }                                                                                          \
    } while (0)

#define assert_holds(text, part)                                                                   \
    do {                                                                                           \
        if (!strstr(text, part)) {                                                                 \
            print_error("\"%s\" does not hold \"%s\"\n", text, part);                              \
            _fail(__FILE__, __LINE__);                                                             \
        }                                                                                          \
    } while (0)

#endif
