// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "calibration/fit_ceres.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

// NIST certifies eleven digits; the solver stops when the cost changes by less
// than 1e-10 of itself, and the minimum is flat.
#define CERTIFIED 1e-5
// The square root of that, where the minimum is as curved as it is high.
#define AT_MINIMUM 1e-4

// NIST StRD Misra1a: y = b1 (1 - exp(-b2 x)).
static const double misra_x[14] = {77.6,  114.9, 141.1, 190.8, 239.9, 289.0, 332.8,
                                   378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0};
static const double misra_y[14] = {10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02,
                                   44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78};

static bool misra(void *context, int group, const double *x, double *residuals, double *jacobian)
{
    (void)context;
    double fall = exp(-x[1] * 1e-4 * misra_x[group]);
    residuals[0] = x[0] * (1 - fall) - misra_y[group];
    if (jacobian) {
        jacobian[0] = 1 - fall;
        jacobian[1] = x[0] * misra_x[group] * 1e-4 * fall;
    }
    return true;
}

static bool rosenbrock(void *context, int group, const double *x, double *residuals,
                       double *jacobian)
{
    (void)context;
    (void)group;
    (void)jacobian;
    residuals[0] = 10 * (x[1] - x[0] * x[0]);
    residuals[1] = 1 - x[0];
    return true;
}

static bool line(void *context, int group, const double *x, double *residuals, double *jacobian)
{
    const double *y = context;
    residuals[0] = x[0] - y[group];
    if (jacobian)
        jacobian[0] = 1;
    return true;
}

static bool impossible(void *context, int group, const double *x, double *residuals,
                       double *jacobian)
{
    (void)context;
    (void)group;
    (void)x;
    (void)residuals;
    (void)jacobian;
    return false;
}

static void certified_values_of_misra1a_are_found(void **state)
{
    (void)state;
    struct least_squares p = {
        .parameters = 2, .groups = 14, .group_size = 1, .evaluate = misra, .iterations = 100};
    double x[2] = {500, 1};
    struct least_squares_result result;
    struct error err = {0};
    assert_true(least_squares_solve(&p, x, &result, &err));
    assert_near(x[0] / 2.3894212918E+02, 1, CERTIFIED);
    assert_near(x[1] * 1e-4 / 5.5015643181E-04, 1, CERTIFIED);
    assert_near(2 * result.cost_after / 1.2455138894E-01, 1, CERTIFIED);
}

static void numeric_derivatives_reach_the_valley_of_rosenbrock(void **state)
{
    (void)state;
    struct least_squares p = {.parameters = 2,
                              .groups = 1,
                              .group_size = 2,
                              .evaluate = rosenbrock,
                              .numeric = true,
                              .iterations = 200};
    struct least_squares_result result;
    double x[2] = {-1.2, 1};
    assert_true(least_squares_solve(&p, x, &result, NULL));
    assert_near(x[0], 1, AT_MINIMUM);
    assert_near(x[1], 1, AT_MINIMUM);
}

static void an_outlier_pulls_less_with_a_robust_loss(void **state)
{
    (void)state;
    double y[5] = {1, 1.01, 0.99, 1, 50};
    struct least_squares p = {.parameters = 1,
                              .groups = 5,
                              .group_size = 1,
                              .evaluate = line,
                              .context = y,
                              .iterations = 100};
    struct least_squares_result result;
    double x[1] = {0};
    assert_true(least_squares_solve(&p, x, &result, NULL));
    assert_near(x[0], 10.8, AT_MINIMUM);
    p.robust = 0.01;
    assert_true(least_squares_solve(&p, x, &result, NULL));
    assert_true(fabs(x[0] - 1) < 0.02);
}

static void failures_leave_the_start_alone_and_say_why(void **state)
{
    (void)state;
    struct least_squares p = {.parameters = 2,
                              .groups = 1,
                              .group_size = 2,
                              .evaluate = rosenbrock,
                              .numeric = true,
                              .iterations = 1};
    struct least_squares_result result;
    struct error err = {0};
    double x[2] = {-1.2, 1};
    assert_false(least_squares_solve(&p, x, &result, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "did not converge"));
    p.evaluate = impossible;
    p.iterations = 10;
    assert_false(least_squares_solve(&p, x, &result, &err));
    p.group_size = 1;
    assert_false(least_squares_solve(&p, x, &result, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_near(x[0], -1.2, 0);
    assert_near(x[1], 1, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(certified_values_of_misra1a_are_found),
        cmocka_unit_test(numeric_derivatives_reach_the_valley_of_rosenbrock),
        cmocka_unit_test(an_outlier_pulls_less_with_a_robust_loss),
        cmocka_unit_test(failures_leave_the_start_alone_and_say_why),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
