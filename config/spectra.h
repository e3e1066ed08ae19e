// SPDX-License-Identifier: Apache-2.0
// Spectra from files: CSV "nm, v1, v2 …" or CGATS .sp, onto the inner grid.
#ifndef CONFIG_SPECTRA_H
#define CONFIG_SPECTRA_H

#include "colorimetry/spectrum.h"

struct spectra {
    int count;
    struct spectrum *spectra; // owned
    char (*names)[64];        // owned; column name, SAMPLE_ID or "1", "2", …
};

void spectra_fini(struct spectra *s);

// All spectra of a file. held: see spectrum_from_samples (true for
// reflectances). A .sp whose SPECTRAL_BANDS, SPECTRAL_START_NM,
// SPECTRAL_END_NM or SPECTRAL_NORM contradicts its SPEC_ fields is refused,
// naming file, line, key, value and what the fields say; so are negative
// lamp powers (beyond noise: 5 % of the peak), unsorted or repeated wavelengths
// and wrong units (a range that misses 400..700 nm, reflectances in per cent).
bool spectra_load(const char *path, bool held, struct spectra *out, struct error *err);

// Whether a text means a file: it has a '/' or ends in .csv or .sp.
bool spectra_is_path(const char *text);

// One spectrum by CIE name (see colorimetry/illuminant.h) or from a file's
// first spectrum, which must hold some light.
bool lamp_spectrum(const char *name_or_path, struct spectrum *out, struct error *err);

#endif
