// SPDX-License-Identifier: Apache-2.0
// What a spectroradiometer's point sees of a spectrum through its slit.
#ifndef SIMULATOR_MODEL_SLIT_H
#define SIMULATOR_MODEL_SLIT_H

#include "colorimetry/spectrum.h"

// Mean over a triangle about centre_nm, bandpass_nm wide at half its height.
// Beyond the grid there is no light.
double slit_mean(const struct spectrum *light, double centre_nm, double bandpass_nm);

#endif
