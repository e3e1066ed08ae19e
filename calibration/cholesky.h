// SPDX-License-Identifier: Apache-2.0
// Cholesky factors of small symmetric matrices, row-major.
#ifndef CALIBRATION_CHOLESKY_H
#define CALIBRATION_CHOLESKY_H

#include <stdbool.h>

// Turns the lower triangle of an n x n matrix into L with L L' = matrix, and
// zeroes the rest. False, with matrix spoilt, when it is not positive definite.
bool cholesky(double *matrix, int n);

#endif
