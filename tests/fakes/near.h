// SPDX-License-Identifier: Apache-2.0
// Closeness in double: cmocka's own assert_float_equal rounds both to float
// first. NaN is near nothing. Include after cmocka.h.
#ifndef TESTS_FAKES_NEAR_H
#define TESTS_FAKES_NEAR_H

#include <math.h>

static inline void near_in_double(double got, double wanted, double tolerance, const char *what,
                                  const char *file, int line)
{
    if (fabs(got - wanted) <= tolerance)
        return;
    print_error("%s is %.15g, not within %g of %.15g\n", what, got, tolerance, wanted);
    _fail(file, line);
}

#define assert_near(got, wanted, tolerance)                                                        \
    near_in_double(got, wanted, tolerance, #got, __FILE__, __LINE__)

#endif
