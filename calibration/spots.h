// SPDX-License-Identifier: Apache-2.0
// Spot readings of the lit ceiling: what makes a luminance map absolute.
#ifndef CALIBRATION_SPOTS_H
#define CALIBRATION_SPOTS_H

#include "calibration/bench.h"
#include "render/lights.h"

enum { SPOTS_MOST = 7 };

struct spot_scale {
    double scale;              // median of the ratios
    int count;                 // 1..SPOTS_MOST
    double ratios[SPOTS_MOST]; // reading over map
    double x_m[SPOTS_MOST], z_m[SPOTS_MOST]; // where, booth frame
};

// Aims the radiometer at even places of the map, from the brightest down, and
// reads each. A place that overloads the radiometer makes it go on at 60 % of
// that. lamp names it among the readings. Errors: those of the bench; DATA when
// no place is even, or when a ratio is more than 2 % from the median: the map
// is not of this light.
bool spots_scale(struct bench *b, const char *lamp, const struct luminance_map *map,
                 struct spot_scale *out, struct error *err);

// A reading that somebody took: luminance of a disc of 10 mm.
struct spot_reading {
    double x_m, z_m, cdm2; // booth frame
};

// The same from readings at hand, 1..SPOTS_MOST. Errors: DATA for a place that
// is dark in the map or outside it, or when they contradict each other by more
// than 2 %.
bool spots_apply(const struct luminance_map *map, const struct spot_reading *readings, int count,
                 struct spot_scale *out, struct error *err);

#endif
