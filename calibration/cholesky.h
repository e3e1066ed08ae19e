// SPDX-License-Identifier: Apache-2.0
// Cholesky factors of small symmetric matrices, row-major.
#ifndef CALIBRATION_CHOLESKY_H
#define CALIBRATION_CHOLESKY_H

#include <stdbool.h>

// Turns the lower triangle of an n x n matrix into L with L L' = matrix, and
// zeroes the rest. False, with matrix spoilt, when it is not positive definite.
bool cholesky(double *matrix, int n);

// The first `rank` columns of a Cholesky factor with pivots, largest first: the
// best that so few columns can do step by step. factor is n x rank; returns how
// many columns it holds (the rest 0), fewer than rank once what is left of every
// diagonal is below tolerance. matrix (lower and upper triangle) is not changed.
// Source: Harbrecht, Peters, Schneider 2012 (Appl. Numer. Math. 62, 428-440).
int cholesky_pivoted(const double *matrix, int n, int rank, double tolerance, double *factor);

#endif
