// SPDX-License-Identifier: Apache-2.0
// The driver of the Ocean Optics spectrometers in ocean_models.h; see ocean.md.
#ifndef DRIVERS_OCEAN_H
#define DRIVERS_OCEAN_H

#include "drivers/spectrometer.h"

extern const struct spectrometer_driver ocean_driver;

#endif
