// SPDX-License-Identifier: Apache-2.0
// A band set on disk (INI, section [bands]: count, centre_nm, width_nm), as
// `boothcal bands optimise` writes it.
#ifndef CONFIG_BANDS_FILE_H
#define CONFIG_BANDS_FILE_H

#include "colorimetry/bands.h"

// Errors name file, key, value and what is allowed; bands all but identical are
// refused.
bool bands_load(const char *path, struct band_set *out, struct error *err);
bool bands_save(const char *path, const struct band_set *set, struct error *err);

// By number of bands ("6": the shipped set) or by path.
bool bands_named(const char *count_or_path, struct band_set *out, struct error *err);

#endif
