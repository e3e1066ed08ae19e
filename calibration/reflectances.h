// SPDX-License-Identifier: Apache-2.0
// Reflectance sets of Debian's psychtoolbox-3-common (sur_*.mat), through
// libmatio: what bands are trained on. Never the Macbeth chart: that one and
// the ColorChecker are held out.
#ifndef CALIBRATION_REFLECTANCES_H
#define CALIBRATION_REFLECTANCES_H

#include "colorimetry/spectrum.h"

struct reflectances {
    int count;
    struct spectrum *spectra; // owned; ends held
    double *weights;          // owned; 1 for Munsell chips, less for natural objects
};

void reflectances_fini(struct reflectances *r);

// Loads sur_nickerson (Munsell), sur_vrhel, sur_krinov and sur_koivisto from a
// folder. Samples at the ends that are 0 or repeat their neighbour in every
// spectrum are padding and count as missing. Errors name file and variable.
bool reflectances_load(const char *folder, struct reflectances *out, struct error *err);

#endif
