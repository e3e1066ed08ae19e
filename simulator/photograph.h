// SPDX-License-Identifier: Apache-2.0
// An exposure series of the lit ceiling, as a still camera on the booth's
// floor takes it, and what it ought to have shown.
#ifndef SIMULATOR_PHOTOGRAPH_H
#define SIMULATOR_PHOTOGRAPH_H

#include <jansson.h>

#include "simulator/world.h"

// Takes the series at one moment and leaves in the folder (made when missing):
//   light-NN.png                every exposure
//   dark-NN.png                 the longest ones with a capped lens
//   flat-NN.png                 a field of equal luminance
//   list.csv                    "file,exposure_s,light|dark|flat" a line
//   camera.ini                  the lens as a calibration would find it, and how
//                               far the ceiling's dark trim reaches in
//   truth.exr                   luminance of the ceiling, cd/m2, averaged over
//                               the pixels of the camera map
// A new object with folder, frames (of light), corners_px: where the ceiling's
// corners fall (far left, far right, near right, near left).
// Errors: SYSTEM when a file cannot be written.
json_t *photograph(struct world *world, int64_t at_ns, const char *folder, struct error *err);

#endif
