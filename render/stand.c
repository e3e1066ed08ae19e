// SPDX-License-Identifier: Apache-2.0
#include "render/stand.h"

struct rigid stand_pose(const struct stand *stand, double tilt_deg)
{
    double tilt = fmod(tilt_deg, 360) * (M_PI / 180), s = sin(tilt), c = cos(tilt);
    const double *hinge = stand->hinge_m, *centre = stand->centre_from_hinge_m;
    struct rigid pose = {{{{1, 0, 0}, {0, s, c}, {0, -c, s}}}, {hinge[0], hinge[1], hinge[2]}};
    struct vec3 centre_screen = {centre[0], centre[1], centre[2]};
    pose.translation = rigid_apply(pose, centre_screen);
    return pose;
}

struct vec3 screen_point(const struct screen *screen, double x_px, double y_px)
{
    return (struct vec3){
        ((x_px + 0.5) / screen->width_px - 0.5) * screen->width_m,
        (0.5 - (y_px + 0.5) / screen->height_px) * screen->height_m,
        0,
    };
}
