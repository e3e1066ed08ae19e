// SPDX-License-Identifier: Apache-2.0
// What the instruments and the set-up of one booth are off by, and nobody in
// it knows: drawn once from a seed, normal about zero. The standard deviations
// are those that such instruments' documents give as half of their limits.
#ifndef SIMULATOR_HIDDEN_H
#define SIMULATOR_HIDDEN_H

#include <stdint.h>

#include "base/linear.h"
#include "colorimetry/spectrum.h"

enum { HIDDEN_WAVES = 4 };

// An instrument that reads spectra. Ripple: waves over the wavelength of
// periods 150..500 nm, as an ageing lamp leaves in what it calibrated.
struct hidden_instrument {
    double shift_nm, stretch_nm; // of the wavelength scale; the latter at 380 and 780 nm
    double level, slope;         // relative; slope over 180 nm about 560 nm
    double ripple[HIDDEN_WAVES], period_nm[HIDDEN_WAVES], phase[HIDDEN_WAVES];
};

struct hidden {
    struct hidden_instrument spectrometer, radiometer;
    double tilt_deg;     // the screen's own less what the inclinometer says
    double up_m, near_m; // the screen's own place less what was measured
    double map_fall[3];  // fall-off that the camera's map keeps at its edges: x, z, radius squared
    double level;        // of the lamp since it was taught, relative
    struct vec3 eye_m;   // its own place less what the tracker says
    double drift;        // of the panel since it was characterised, relative
    double reflection;   // of the panel's reflectance, relative
};

void hidden_draw(uint64_t seed, struct hidden *out);

// Light as such an instrument takes it to be.
void hidden_sees(const struct hidden_instrument *instrument, const struct spectrum *light,
                 struct spectrum *seen);

#endif
