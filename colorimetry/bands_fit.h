// SPDX-License-Identifier: Apache-2.0
// How band matrices are fitted: training reflectances as coefficients of a
// compact basis, so that each lamp costs a dozen integrals. Used by bands.c
// with the shipped training and by `boothcal bands optimise` with a new one.
#ifndef COLORIMETRY_BANDS_FIT_H
#define COLORIMETRY_BANDS_FIT_H

#include "colorimetry/bands.h"

enum {
    BASIS_VECTORS = 20, // at least BANDS_MOST, or many bands are not decided
    BASIS_SAMPLES = 69, // of a vector as it ships: 390, 395 .. 730 nm, held outside
    BASIS_FIRST_NM = 390,
    BASIS_STEP_NM = 5,
    TRAINING_ROWS = 128,
    BAND_RESIDUALS = 3 * (TRAINING_ROWS + BANDS_MOST),
};

// reflectance of row i = sum over v of coefficients[i][v] * basis[v].
struct band_training {
    struct spectrum basis[BASIS_VECTORS];
    double coefficients[TRAINING_ROWS][BASIS_VECTORS];
    double weights[TRAINING_ROWS]; // on differences, not their squares
};

// The training that ships, onto the inner grid.
void band_training_shipped(struct band_training *out);

// The training's colours under one lamp: relative XYZ and, per row, the
// quadratic form of CIEDE2000 there times the row's weight.
struct band_aim {
    struct xyz white;
    struct xyz xyz[TRAINING_ROWS];
    struct mat3 slopes[TRAINING_ROWS]; // |slopes dXYZ| = weighted dE00
    struct mat3 noise; // |noise m_j|: weighted dE00 over all rows from noise in coefficient j
};

// Error DATA for a lamp that is dark to this observer.
bool band_aim_at(const struct band_training *training, const struct spectrum *lamp,
                 enum observer observer, struct band_aim *out, struct error *err);

// Band coefficients of all rows.
void band_rows(const struct band_training *training, const struct band_set *set,
               struct bands rows[TRAINING_ROWS]);

// Least squares over the rows with the perfect diffuser exact. Coefficients
// are taken to carry noise (half floats, cameras), so that bands lying close
// together do not end up as differences of large numbers.
bool band_matrix_solve(const struct band_aim *aim, const struct bands *rows, int count,
                       struct band_matrix *out, struct error *err);

// Weighted residuals of a matrix: three per row, three per coefficient's noise.
void band_residuals(const struct band_aim *aim, const struct bands *rows,
                    const struct band_matrix *matrix, double residuals[BAND_RESIDUALS]);

#endif
