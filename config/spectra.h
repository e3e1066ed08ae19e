// SPDX-License-Identifier: Apache-2.0
// Spectra from files: CSV "nm, v1, v2 …" or CGATS .sp, onto the inner grid.
#ifndef CONFIG_SPECTRA_H
#define CONFIG_SPECTRA_H

#include "colorimetry/spectrum.h"

struct spectra {
    int count;
    struct spectrum *spectra; // owned
    char (*names)[64];        // owned; column name, SAMPLE_ID or "1", "2", …
    char warning[320];        // one line on what is sound but odd, "" when nothing is
};

void spectra_fini(struct spectra *s);

// All spectra of a file. held: see spectrum_from_samples (true for
// reflectances). Refused, naming file, line or column, value and what is
// allowed: a .sp whose SPECTRAL_BANDS, SPECTRAL_START_NM, SPECTRAL_END_NM or
// SPECTRAL_NORM contradicts its SPEC_ fields; unsorted or repeated wavelengths;
// samples that do not reach from 420 nm or below to 680 nm or above, or fewer
// than 8 in between (unless all are equal); lamp powers that are negative
// (beyond noise: 5 % of the peak) or have no peak within 1e-30..1e30;
// reflectances outside -0.02..1.3 (per cent?). A reflectance above 1.05
// (fluorescence) is a warning.
bool spectra_load(const char *path, bool held, struct spectra *out, struct error *err);

// Whether a text means a file: it has a '/', ends in .csv or .sp, or is no CIE
// name and a file of that name exists.
bool spectra_is_path(const char *text);

// One spectrum by CIE name (see colorimetry/illuminant.h) or from a file's
// first spectrum, which must hold some light. The error says how to name a file.
bool lamp_spectrum(const char *name_or_path, struct spectrum *out, struct error *err);

#endif
