// SPDX-License-Identifier: Apache-2.0
// CIE tables as published, embedded as C arrays. Only colorimetry/ reads them;
// everybody else asks colorimetry/colour.h and colorimetry/illuminant.h.
#ifndef COLORIMETRY_TABLES_TABLES_H
#define COLORIMETRY_TABLES_TABLES_H

#include "colorimetry/colour.h"
#include "colorimetry/rendering.h"

// x, y, z of each observer on the inner grid.
extern const struct spectrum OBSERVER_CMF[OBSERVER_COUNT][3];

enum { TABLE_STEP_NM = 5, DAYLIGHT_BASIS_COUNT = 95 };

// S0, S1, S2 from 360 nm in steps of 5 nm.
extern const double DAYLIGHT_BASIS[3][DAYLIGHT_BASIS_COUNT];

// Test colours of CIE 13.3, reflectance 0..1 at the same wavelengths.
extern const double TEST_COLOUR[TEST_COLOURS][DAYLIGHT_BASIS_COUNT];

// Relative power from first_nm in steps of 5 nm.
struct illuminant_table {
    const char *name;
    int first_nm;
    size_t count; // <= DAYLIGHT_BASIS_COUNT
    const double *values;
    bool linear; // defined by straight lines between its values
};

extern const struct illuminant_table ILLUMINANT_TABLES[];
extern const size_t ILLUMINANT_TABLE_COUNT;

#endif
