// SPDX-License-Identifier: Apache-2.0
// Where the screen is. Booth frame: metres, x right and y up as the observer
// sees them, z towards the observer. Screen frame: origin at the centre of the
// active area, x right, y up along the screen, z out of it.
#ifndef RENDER_STAND_H
#define RENDER_STAND_H

#include "base/linear.h"
#include "base/settings.h"

struct screen {
    double width_m, height_m; // active area, 0.05..5
    int width_px, height_px;  // 16..16384
};

struct stand {
    double hinge_m[3];             // a point of the hinge line (parallel to x), booth frame
    double centre_from_hinge_m[3]; // screen centre, in screen axes
};

// Pose for a tilt in degrees: 0 lies flat, face up; 90 stands upright facing
// the observer. Pure rotation about the hinge, no tangents: valid at any angle.
struct rigid stand_pose(const struct stand *stand, double tilt_deg);

// Centre of a pixel in the screen frame; (0, 0) is the top left pixel.
struct vec3 screen_point(const struct screen *screen, double x_px, double y_px);

#endif
