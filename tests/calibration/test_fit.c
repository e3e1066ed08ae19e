// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/cholesky.h"
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

static void certified_deviations_of_misra1a_follow_from_the_covariance(void **state)
{
    (void)state;
    struct least_squares p = {
        .parameters = 2, .groups = 14, .group_size = 1, .evaluate = misra, .iterations = 100};
    double x[2] = {2.3894212918E+02, 5.5015643181};
    double c[2][2];
    struct error err = {0};
    assert_true(least_squares_covariance(&p, x, c[0], &err));
    const double deviation = 1.0187876330E-01; // of the residuals
    assert_near(deviation * sqrt(c[0][0]) / 2.7070075241E+00, 1, CERTIFIED);
    assert_near(deviation * sqrt(c[1][1]) * 1e-4 / 7.2668688436E-06, 1, CERTIFIED);
    assert_near(c[0][1], c[1][0], 1e-9 * fabs(c[0][1]));
}

static bool only_the_sum(void *context, int group, const double *x, double *residuals,
                         double *jacobian)
{
    (void)context;
    residuals[0] = x[0] + x[1] - group;
    if (jacobian)
        jacobian[0] = jacobian[1] = 1;
    return true;
}

static void what_residuals_do_not_decide_has_no_covariance(void **state)
{
    (void)state;
    struct least_squares p = {
        .parameters = 2, .groups = 5, .group_size = 1, .evaluate = only_the_sum, .iterations = 10};
    double x[2] = {1, 1}, c[4];
    struct error err = {0};
    assert_false(least_squares_covariance(&p, x, c, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

// NIST StRD Norris: y = b0 + b1 x.
static const double norris[36][2] = {
    {0.1, 0.2},     {338.8, 337.4}, {118.1, 118.2}, {888.0, 884.6}, {9.2, 10.1},    {228.1, 226.5},
    {668.5, 666.3}, {998.5, 996.3}, {449.1, 448.6}, {778.9, 777.0}, {559.2, 558.2}, {0.3, 0.4},
    {0.1, 0.6},     {778.1, 775.5}, {668.8, 666.9}, {339.3, 338.0}, {448.9, 447.5}, {10.8, 11.6},
    {557.7, 556.0}, {228.3, 228.1}, {998.0, 995.8}, {888.8, 887.6}, {119.6, 120.2}, {0.3, 0.3},
    {0.6, 0.3},     {557.6, 556.8}, {339.3, 339.1}, {888.0, 887.2}, {998.5, 999.0}, {778.9, 779.0},
    {10.2, 11.1},   {117.6, 118.3}, {228.9, 229.2}, {668.4, 669.1}, {449.2, 448.9}, {0.2, 0.5},
};

struct line_fit {
    double design[36][2], value[36][1], weight[36];
};

static struct ridge *norris_without(int left_out, struct line_fit *l)
{
    int n = 0;
    for (int i = 0; i < 36; i++) {
        if (i == left_out)
            continue;
        l->design[n][0] = 1;
        l->design[n][1] = norris[i][1];
        l->value[n][0] = norris[i][0];
        l->weight[n++] = 0.5 + 0.05 * i;
    }
    const struct ridge_problem p = {.rows = n,
                                    .unknowns = 2,
                                    .values = 1,
                                    .design = l->design[0],
                                    .value = l->value[0],
                                    .weight = l->weight};
    struct ridge *r = ridge_create(&p, NULL);
    assert_non_null(r);
    return r;
}

static void the_certified_line_through_norris_is_found(void **state)
{
    (void)state;
    struct line_fit l;
    double c[2];
    ridge_destroy(norris_without(-1, &l));
    for (int i = 0; i < 36; i++)
        l.weight[i] = 1;
    const struct ridge_problem p = {.rows = 36,
                                    .unknowns = 2,
                                    .values = 1,
                                    .design = l.design[0],
                                    .value = l.value[0],
                                    .weight = l.weight};
    struct ridge *r = ridge_create(&p, NULL);
    assert_non_null(r);
    ridge_solve(r, 1e-12, c);
    assert_near(c[0], -0.262323073774029, CERTIFIED);
    assert_near(c[1], 1.00211681802045, CERTIFIED);
    assert_near(ridge_freedom(r, 1e-12), 2, CERTIFIED);
    ridge_solve(r, 1e15, c);
    assert_near(c[1], 0, CERTIFIED);
    assert_near(ridge_freedom(r, 1e15), 0, CERTIFIED);
    ridge_destroy(r);
}

static void rows_left_out_in_closed_form_are_rows_left_out(void **state)
{
    (void)state;
    struct line_fit l, less;
    double left_out[36], c[2];
    struct ridge *whole = norris_without(-1, &l);
    for (double penalty = 1e-3; penalty < 1e6; penalty *= 100) {
        ridge_left_out(whole, penalty, left_out);
        for (int i = 0; i < 36; i += 5) {
            struct ridge *r = norris_without(i, &less);
            ridge_solve(r, penalty, c);
            assert_near(left_out[i], c[0] + c[1] * norris[i][1], CERTIFIED);
            ridge_destroy(r);
        }
    }
    ridge_destroy(whole);
    ridge_destroy(NULL);
}

static void a_textbook_matrix_has_its_textbook_factor(void **state)
{
    (void)state;
    double a[9] = {4, 99, 99, 12, 37, 99, -16, -43, 98};
    const double factor[9] = {2, 0, 0, 6, 1, 0, -8, 5, 3};
    assert_true(cholesky(a, 3));
    for (int i = 0; i < 9; i++)
        assert_near(a[i], factor[i], 1e-12);
    double b[4] = {1, 0, 2, 1}; // eigenvalues -1 and 3
    assert_false(cholesky(b, 2));
    double none[1] = {NAN};
    assert_false(cholesky(none, 1));
}

static void pivoted_columns_come_nearer_until_nothing_is_left(void **state)
{
    (void)state;
    enum { N = 12 };
    double a[N][N], factor[N * N], last = INFINITY;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            a[i][j] = exp(-0.3 * abs(i - j)) + 1e-3 * (i == j);
    for (int rank = 1; rank <= N; rank++) {
        double off = 0;
        assert_int_equal(cholesky_pivoted(a[0], N, rank, 1e-12, factor), rank);
        for (int i = 0; i < N; i++)
            for (int j = 0; j < N; j++) {
                double sum = 0;
                for (int k = 0; k < rank; k++)
                    sum += factor[i * rank + k] * factor[j * rank + k];
                off = fmax(off, fabs(sum - a[i][j]));
            }
        assert_true(off < last);
        last = off;
    }
    assert_near(last, 0, 1e-12);
    const double one[4] = {1, 2, 2, 4}; // of rank 1
    assert_int_equal(cholesky_pivoted(one, 2, 2, 1e-9, factor), 1);
    assert_near(factor[2], 2, 1e-12);
    assert_near(factor[0], 1, 1e-12);
    assert_near(factor[1], 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(certified_values_of_misra1a_are_found),
        cmocka_unit_test(numeric_derivatives_reach_the_valley_of_rosenbrock),
        cmocka_unit_test(an_outlier_pulls_less_with_a_robust_loss),
        cmocka_unit_test(certified_deviations_of_misra1a_follow_from_the_covariance),
        cmocka_unit_test(what_residuals_do_not_decide_has_no_covariance),
        cmocka_unit_test(the_certified_line_through_norris_is_found),
        cmocka_unit_test(rows_left_out_in_closed_form_are_rows_left_out),
        cmocka_unit_test(a_textbook_matrix_has_its_textbook_factor),
        cmocka_unit_test(pivoted_columns_come_nearer_until_nothing_is_left),
        cmocka_unit_test(failures_leave_the_start_alone_and_say_why),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
