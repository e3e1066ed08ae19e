// SPDX-License-Identifier: Apache-2.0
// Nonlinear least squares through Ceres: the one door to it. Plain data in and
// out; no exception leaves.
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

#ifdef __cplusplus
}
#endif

#endif
