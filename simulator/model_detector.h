// SPDX-License-Identifier: Apache-2.0
// The bench and detector inside the emulated spectrometer: from irradiance on
// the cosine corrector to raw counts of its pixels, with everything that a
// driver has to undo (non-linearity, offset, noise) or has to live with
// (stray light, hot pixels, drift, line width).
#ifndef SIMULATOR_MODEL_DETECTOR_H
#define SIMULATOR_MODEL_DETECTOR_H

#include "colorimetry/spectrum.h"
#include "simulator/model_noise.h"

enum { MODEL_PIXELS_MOST = 3840, DETECTOR_ZONES_MOST = 7 };

enum detector_kind_of_pixel {
    DETECTOR_BLACK = 1,  // covered
    DETECTOR_TRANSITION, // partly covered
    DETECTOR_ACTIVE,
    DETECTOR_UNUSABLE,   // dark and restless
    DETECTOR_FILLER,     // no pixel at all: 0
};

// The pixels after the zone before, up to last; kind 0 ends the list.
struct detector_zone {
    int last;
    enum detector_kind_of_pixel kind;
};

struct detector_options {
    const struct detector_zone *zones;
    double wavelength[4];   // nm = sum of wavelength[i] p^i, p = 0..
    double nonlinearity[8]; // polynomial P(c), c = counts above dark on the axis that ends at
                            // full: light is proportional to c / P(c)
    double full;            // 65535 unless the vendor counts otherwise
    int saturation;         // raw counts at which the converter ends
    double collector_mm2;
    uint64_t seed;          // of the fixed pattern; readings take their own noise
};

struct detector_model;

// NULL when out of memory.
struct detector_model *detector_create(const struct detector_options *options);
void detector_destroy(struct detector_model *detector);

// One exposure to a mean irradiance (W m-2 nm-1) of exposure_s, age_s after
// power came on. raw gets 0..saturation, one for each pixel.
void detector_expose(const struct detector_model *detector, const struct spectrum *irradiance,
                     double exposure_s, double age_s, struct noise *noise,
                     uint16_t *raw);

// The true calibration k(nm) in uJ per linearised count on an axis to 65535 (times
// 65535 / full on another):
// E = k (counts) / (collector_mm2 exposure_s nm_per_pixel), W m-2 nm-1.
double detector_calibration(double nm);

#endif
