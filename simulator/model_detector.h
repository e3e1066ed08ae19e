// SPDX-License-Identifier: Apache-2.0
// The bench and detector inside the emulated spectrometer: from irradiance on
// the cosine corrector to raw counts of 2048 pixels, with everything that a
// driver has to undo (non-linearity, offset, noise) or has to live with
// (stray light, hot pixels, drift, line width).
#ifndef SIMULATOR_MODEL_DETECTOR_H
#define SIMULATOR_MODEL_DETECTOR_H

#include "colorimetry/spectrum.h"
#include "simulator/model_noise.h"

enum {
    DETECTOR_PIXELS = 2048,
    DETECTOR_FIRST_TRANSITION = 18, // below: optically black
    DETECTOR_FIRST_ACTIVE = 20,
};

struct detector_options {
    double wavelength[4];   // nm = sum of wavelength[i] p^i, p = 0..2047
    double nonlinearity[8]; // polynomial P(c), c = counts on the 65535 axis above dark:
                            // light is proportional to c / P(c)
    int saturation;         // raw counts at which the converter ends
    double collector_mm2;
    uint64_t seed;          // of the fixed pattern; readings take their own noise
};

struct detector;

// NULL when out of memory.
struct detector *detector_create(const struct detector_options *options);
void detector_destroy(struct detector *detector);

// One exposure to a mean irradiance (W m-2 nm-1) of exposure_s, age_s after
// power came on. raw gets 0..saturation.
void detector_expose(const struct detector *detector, const struct spectrum *irradiance,
                     double exposure_s, double age_s, struct noise *noise,
                     uint16_t raw[DETECTOR_PIXELS]);

// The true calibration k(nm) in uJ per linearised count on the 65535 axis:
// E = k (counts) / (collector_mm2 exposure_s nm_per_pixel), W m-2 nm-1.
double detector_calibration(double nm);

#endif
