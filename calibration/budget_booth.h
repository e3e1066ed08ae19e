// SPDX-License-Identifier: Apache-2.0
// How the light on the screen depends on where the screen is and on the shape
// of the lamp's luminance map, by dense integration of the map.
#ifndef CALIBRATION_BUDGET_BOOTH_H
#define CALIBRATION_BUDGET_BOOTH_H

#include "calibration/budget.h"
#include "render/lights.h"
#include "render/stand.h"

enum { MAP_SPOTS = 32 };

// Where a spot reading scaled the map.
struct map_spot {
    double x_m, z_m; // booth frame
};

struct booth_light {
    double lux;            // at the screen's centre
    double by_tilt;        // d ln lux / d degree
    double by_up, by_near; // d ln lux / d m
    double spots_by_shape; // relative standard deviation of the spots' scales for such fall-offs
    double by_shape[3];    // d ln lux for a fall-off of 1 at the map's edge along x, along z, and
                           // with the square of the radius, the map being right at the spots
};

// map in cd/m2. Without spots (count 0) the map is taken to be right on
// average over its light. Errors: RANGE when the screen gets no light, SYSTEM.
bool booth_light_at(const struct luminance_map *map, const struct stand *stand, double tilt_deg,
                    const struct map_spot *spots, int count, struct booth_light *out,
                    struct error *err);

// Relative standard uncertainty of the map's scale, the median of count spot
// readings over the map (relative standard deviation spread), less what the
// map's shape makes of their spread: that is counted by itself.
double map_scale_uncertainty(const struct booth_light *light, const struct uncertainties *u,
                             double spread, int count);

// Puts the light, and the scale of the map that it was computed from, into a
// budget's input, whose uncertainties are there already.
void booth_light_into(const struct booth_light *light, double spread, int count,
                      struct budget_input *input);

#endif
