// SPDX-License-Identifier: Apache-2.0
// Irradiance from the raw columns of a Jaz file: dark D, reference R, sample S.
// Pure functions; see replay.md.
#ifndef DRIVERS_JAZ_H
#define DRIVERS_JAZ_H

#include "drivers/irradiance.h"
#include "drivers/vendor_files.h"

// What one count of a file's S is worth, in one of two ways, as the settings say.
struct jaz_worth {
    const struct table *calibration;     // as ocean_axis_make takes it, or NULL
    double collector_mm2;                // for that
    const struct vendor_file *reference; // irradiance of the light behind R, or NULL
    double reference_scale;              // its unit in W m-2 nm-1
};

struct jaz_light {
    struct spectrum irradiance, sigma; // W m-2 nm-1
    double peak;                       // highest count over full scale, 0..1
    bool saturated;                    // a used pixel at full scale
};

// Whether the file's P is 100 (S - D) / (R - D): per cent of R, no irradiance.
bool jaz_is_ratio(const struct vendor_file *file);

// S less D, D following the optically black pixels, through ocean_irradiance with the detector
// of a USB2000+ (the same Sony ILX511); no non-linearity, no stray light: such a file does not
// tell them. By calibration, or by reference: E = E_R (S - D) / (R - D), 0 where R - D is below 1 %
// of its highest; what R's own noise costs is in sigma. DATA: no raw columns, no exposure, not
// 2048 pixels, wavelengths that are no cubic of the pixel; as ocean_axis_make.
bool jaz_irradiance(const struct vendor_file *file, const struct jaz_worth *worth, int boxcar,
                    struct jaz_light *out, struct error *err);

#endif
