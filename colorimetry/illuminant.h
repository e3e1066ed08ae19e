// SPDX-License-Identifier: Apache-2.0
// CIE illuminants as relative spectra on the inner grid.
#ifndef COLORIMETRY_ILLUMINANT_H
#define COLORIMETRY_ILLUMINANT_H

#include "colorimetry/spectrum.h"

// By name: "A", "D50", "D55", "D65", "D75", "E", "FL1".."FL12", "FL3.15",
// "LED-B1".."LED-B5", "LED-BH1", "LED-RGB1", "LED-V1", "LED-V2", "D<kelvin>K"
// (daylight series, "D5500K" 4000..25000), "P<kelvin>K" (Planck, "P2856K", 100..1e6).
// Relative power as published (A, D: 100 at 560 nm). Error CONFIG lists what
// there is.
bool illuminant(const char *name, struct spectrum *out, struct error *err);

// Names of the fixed ones, NULL-terminated.
const char *const *illuminant_names(void);

// Today's temperature of daylight over its nominal one.
#define DAYLIGHT_SCALE (1.4388 / 1.4380)

// Daylight from S0, S1, S2 for a nominal correlated colour temperature,
// 4000..25000 K (else RANGE), M1 and M2 rounded to three decimals.
// Source: CIE 015:2018 (4.1.2).
bool daylight(double kelvin, struct spectrum *out, struct error *err);

// Planck's law with c2 = 1.4388e-2 m K and n = 1, 1 at 560 nm. kelvin >= 100.
void planck(double kelvin, struct spectrum *out);

#endif
