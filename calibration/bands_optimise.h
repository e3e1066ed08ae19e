// SPDX-License-Identifier: Apache-2.0
// Derives what ships of the six bands: the compact reflectance basis, and the
// shapes of 3..16 Gaussian bands that leave the least colour error.
#ifndef CALIBRATION_BANDS_OPTIMISE_H
#define CALIBRATION_BANDS_OPTIMISE_H

#include "calibration/reflectances.h"
#include "colorimetry/bands_fit.h"

// The basis: leading singular vectors of the weighted reflectances at 390, 395
// .. 730 nm; the rows: those reflectances that lie farthest apart (Gonzalez
// 1985), projected onto the basis. samples[v] is what ships of basis vector v.
// Deterministic. Error DATA with fewer reflectances than rows.
bool band_training_derive(const struct reflectances *r, struct band_training *out,
                          double samples[BASIS_VECTORS][BASIS_SAMPLES], struct error *err);

// Centres and widths with the least sum of squared linearised CIEDE2000 over
// the training's rows and nine lamps (daylight and tungsten in full,
// fluorescent and LED lamps less), each lamp with its own adapted matrix
// (variable projection). Several starts, the best one wins; sorted by centre.
// *rms is the residual over rows and lamps.
bool band_set_optimise(const struct band_training *training, int count, struct band_set *out,
                       double *rms, struct error *err);

#endif
