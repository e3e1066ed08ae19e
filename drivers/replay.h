// SPDX-License-Identifier: Apache-2.0
// A spectrometer that is a file of another program; see replay.md.
#ifndef DRIVERS_REPLAY_H
#define DRIVERS_REPLAY_H

#include "drivers/spectrometer.h"
#include "drivers/vendor_files.h"

extern const struct spectrometer_driver replay_driver;

// The file's values as W m-2 nm-1 on the inner grid. DATA as
// spectrum_from_samples.
bool replay_irradiance(const struct vendor_file *file, enum file_unit unit, struct spectrum *out,
                       struct error *err);

#endif
