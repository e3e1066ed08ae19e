// SPDX-License-Identifier: Apache-2.0
// Surfaces as a few band coefficients, and the matrix that turns them into
// tristimulus values under one lamp. A band set is N smooth sensitivities;
// c_j = sum(s_j R) / sum(s_j) lies in 0..1; XYZ = M_S c with the 3xN matrix
// M_S computed from the lamp's full-resolution spectrum whenever it changes.
#ifndef COLORIMETRY_BANDS_H
#define COLORIMETRY_BANDS_H

#include "colorimetry/colour.h"

enum { BANDS_LEAST = 3, BANDS_MOST = 16, BANDS_SHIPPED = 6 };

// Band coefficients of a surface, 0..1 each; v[count..] are 0.
struct bands {
    double v[BANDS_MOST];
};

// Gaussian sensitivities on the inner grid, each normalised to sum 1.
struct band_set {
    int count; // 3..16
    double centre_nm[BANDS_MOST];
    double width_nm[BANDS_MOST]; // standard deviation
    struct spectrum sensitivity[BANDS_MOST];
};

// 3 rows (X, Y, Z; Y = 100 for the perfect diffuser) by count columns.
struct band_matrix {
    int count;
    double m[3][BANDS_MOST];
};

// The optimised set that ships for a count (made by `boothcal bands optimise`).
// Error RANGE outside 3..16.
bool band_set_shipped(int count, struct band_set *out, struct error *err);

// A set from centres (360..830) and widths (1..200 nm). Errors: RANGE.
bool band_set_make(int count, const double *centre_nm, const double *width_nm, struct band_set *out,
                   struct error *err);

struct bands bands_of(const struct band_set *set, const struct spectrum *reflectance);

// M_S for a lamp: least squares over the shipped training reflectances (a
// compact basis and its coefficients), each weighted by the slope of CIELAB
// under that very lamp, with the perfect diffuser exact. Error DATA for a dark
// lamp.
bool band_matrix_adapted(const struct band_set *set, const struct spectrum *lamp,
                         enum observer observer, struct band_matrix *out, struct error *err);

// The published method, for comparison: one fixed Nx3 matrix, fitted once over
// CIE A, D50, D65, FL2, FL8 and FL11, applied to products of lamp and surface channels
// (papers: Darling et al. 2011), normalised to Y = 100 for the perfect
// diffuser.
bool band_matrix_product(const struct band_set *set, const struct spectrum *lamp,
                         enum observer observer, struct band_matrix *out, struct error *err);

// Relative XYZ of a surface.
struct xyz band_xyz(const struct band_matrix *matrix, const struct bands *c);

#endif
