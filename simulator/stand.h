// SPDX-License-Identifier: Apache-2.0
// The emulated stand: a screen that turns about a hinge parallel to x. Screen
// axes: x right, y up along the screen, z out of it.
#ifndef SIMULATOR_STAND_H
#define SIMULATOR_STAND_H

#include "base/linear.h"
#include "simulator/scenario.h"

// The screen in the booth at one tilt.
struct easel {
    struct vec3 centre, right, up, normal; // booth frame; the last three of unit length
};

struct easel easel_at(const struct scenario_stand *stand, double tilt_deg);

// Centre of a pixel in the booth; (0, 0) is the top left pixel.
struct vec3 easel_point(const struct easel *easel, const struct scenario_screen *screen,
                        double x_px, double y_px);

// What an accelerometer on the screen reads at rest, m/s2, in its own axes: the
// screen's, turned by three angles, each about an axis as the turns before left it: x,
// y, z.
struct vec3 easel_gravity(const struct easel *easel, const double turned_deg[3]);

#endif
