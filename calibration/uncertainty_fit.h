// SPDX-License-Identifier: Apache-2.0
// The uncertainty of a fitted display model's predictions
// (colorimetry/display_uncertainty.h), from the covariance of its parameters
// and from the patches that cross-validation left out.
#ifndef CALIBRATION_UNCERTAINTY_FIT_H
#define CALIBRATION_UNCERTAINTY_FIT_H

#include "calibration/display_choice.h"
#include "colorimetry/display_uncertainty.h"

// Keeps the principal modes of a covariance of L*, a*, b* at the places of
// display_uncertainty (3 * UNCERTAINTY_PLACES square), to a ten-thousandth of a
// CIELAB unit.
bool uncertainty_modes(const double *covariance, struct display_uncertainty *out,
                       struct error *err);

// Counts of a place of display_uncertainty.
struct counts uncertainty_place(int place);

// Estimates smooth, local and noise from the predictions of `kind` for the
// patches that were left out, beyond what the modes (filled before) explain;
// noise from patches of equal counts when at least four readings repeat.
bool uncertainty_rest(const struct measurements *m, const struct display_cross *cross,
                      const struct display_model *model, struct display_uncertainty *out,
                      struct error *err);

#endif
