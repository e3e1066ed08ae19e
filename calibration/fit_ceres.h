// SPDX-License-Identifier: Apache-2.0
// Nonlinear least squares through Ceres, and linear ones through its Eigen: the
// one door to both. Plain data in and out; no exception leaves.
#ifndef CALIBRATION_FIT_CERES_H
#define CALIBRATION_FIT_CERES_H

#include <stdbool.h>

#include "base/error.h"

// Residuals of one group at x, and d residual / d x (row-major, group_size x
// parameters) when jacobian is not NULL. False gives this x up as impossible.
typedef bool residual_group(void *context, int group, const double *x, double *residuals,
                            double *jacobian);

#ifdef __cplusplus
extern "C" {
#endif

struct least_squares {
    int parameters; // >= 1
    int groups;     // >= 1; groups * group_size >= parameters
    int group_size; // residuals of a group, >= 1
    residual_group *evaluate;
    void *context;
    bool numeric;     // true: evaluate never gets a jacobian; central differences instead
    double robust;    // > 0: groups count by soft L1 of their norm beyond this; 0: squares
    double tolerance; // relative change of the cost that ends the search; 0: 1e-10
    int iterations;   // at most, >= 1
};

struct least_squares_result {
    int iterations;
    double cost_before, cost_after; // half the sum of (robust) squares
};

// Minimises from x (changed only on success). Anything but convergence is a
// failure (DATA) that says what the solver said.
bool least_squares_solve(const struct least_squares *problem, double *x,
                         struct least_squares_result *result, struct error *err);

// Covariance of the parameters at x, of residuals with unit variance:
// (J'J)^-1, without the robust loss, row-major parameters x parameters. Its
// scale is the caller's. DATA when the residuals do not decide every parameter.
bool least_squares_covariance(const struct least_squares *problem, const double *x,
                              double *covariance, struct error *err);

// Linear least squares with a penalty, several values at a time:
// sum of weight |value - design c|^2 + penalty |c|^2 is least.
// Source: Hoerl, Kennard 1970 (Technometrics 12, 55-67).
struct ridge_problem {
    int rows, unknowns, values; // each >= 1
    const double *design;       // rows x unknowns
    const double *value;        // rows x values
    const double *weight;       // rows, > 0
};

struct ridge;

// Decomposes once, for any penalty > 0. NULL on failure.
struct ridge *ridge_create(const struct ridge_problem *problem, struct error *err);
void ridge_destroy(struct ridge *ridge); // accepts NULL

// c: unknowns x values.
void ridge_solve(const struct ridge *ridge, double penalty, double *c);

// Each row as the other rows alone predict it, rows x values, in closed form
// (Allen 1974, Technometrics 16, 125-127).
void ridge_left_out(const struct ridge *ridge, double penalty, double *predicted);

// How many unknowns the rows decide: the trace of the hat matrix.
double ridge_freedom(const struct ridge *ridge, double penalty);

// (design' weight design + penalty)^-1, unknowns x unknowns: the covariance of c
// for values of variance 1 / weight.
void ridge_covariance(const struct ridge *ridge, double penalty, double *covariance);

// The `count` largest principal modes of an n x n covariance, each an eigenvector
// times the root of its eigenvalue, count x n; largest first. Source: Pearson
// 1901 (Phil. Mag. 2, 559-572).
bool principal_modes(const double *covariance, int n, int count, double *modes, struct error *err);

#ifdef __cplusplus
}
#endif

#endif
