// SPDX-License-Identifier: Apache-2.0
// Written by `boothcal bands optimise` (bands.c, reflectance_basis.c): band
// shapes for 3..16 bands, and the training reflectances.
#ifndef COLORIMETRY_TABLES_BANDS_H
#define COLORIMETRY_TABLES_BANDS_H

#include "colorimetry/bands_fit.h"

struct band_shapes {
    double centre_nm[BANDS_MOST], width_nm[BANDS_MOST];
};

extern const struct band_shapes BAND_SHAPES[BANDS_MOST - BANDS_LEAST + 1];
extern const double REFLECTANCE_BASIS[BASIS_VECTORS][BASIS_SAMPLES];
extern const double REFLECTANCE_ROWS[TRAINING_ROWS][BASIS_VECTORS];
extern const double REFLECTANCE_WEIGHTS[TRAINING_ROWS];

#endif
