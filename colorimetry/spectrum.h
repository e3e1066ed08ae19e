// SPDX-License-Identifier: Apache-2.0
// Spectra on the one grid used inside: 1 nm, 360..830 nm. Tables and readings
// are interpolated or binned onto it before they go anywhere else.
// Source: CIE 015:2018 (interpolation, extrapolation, 7.2).
#ifndef COLORIMETRY_SPECTRUM_H
#define COLORIMETRY_SPECTRUM_H

#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

enum { SPECTRUM_FIRST_NM = 360, SPECTRUM_LAST_NM = 830, SPECTRUM_COUNT = 471 };

// values[i] belongs to (360 + i) nm: spectral irradiance in W m-2 nm-1,
// spectral radiance in W m-2 sr-1 nm-1, reflectance (0..1) or relative power,
// as the name of the variable says.
struct spectrum {
    double v[SPECTRUM_COUNT];
};

// Onto the grid from count (>= 2) samples at strictly increasing nm:
// - equal steps of 2..20 nm: Sprague (5th order) as CIE 167 says, cubic with
//   fewer than six samples; when all samples are >= 0, what undershoots is cut
//   and paid for by the peak beside it, so that energy is kept;
// - steps finer than 1 nm anywhere: binned by overlap (mean over each 1 nm
//   bin), so that energy is kept;
// - anything else: linear.
// Outside the samples: 0 when held is false (lamps), the end value when true
// (reflectances, CIE 015 7.2.3).
// Errors (DATA) name nm and index: unsorted, duplicate or non-finite
// wavelengths, non-finite values, a range that does not touch 400..700 nm.
bool spectrum_from_samples(const double *nm, const double *values, size_t count, bool held,
                           struct spectrum *out, struct error *err);

double spectrum_sum(const struct spectrum *s);
void spectrum_scale(struct spectrum *s, double k);

#endif
