// SPDX-License-Identifier: Apache-2.0
#include "simulator/stand.h"

static const double standard_gravity = 9.81;

struct easel easel_at(const struct scenario_stand *stand, double tilt_deg)
{
    double angle = tilt_deg * M_PI / 180;
    struct easel e = {
        .right = {1, 0, 0},
        .up = {0, sin(angle), -cos(angle)},
        .normal = {0, cos(angle), sin(angle)},
    };
    const double *h = stand->hinge_m, *c = stand->centre_from_hinge_m;
    e.centre = vec3_add((struct vec3){h[0], h[1], h[2]}, vec3_scale(e.right, c[0]));
    e.centre = vec3_add(e.centre, vec3_scale(e.up, c[1]));
    e.centre = vec3_add(e.centre, vec3_scale(e.normal, c[2]));
    return e;
}

struct vec3 easel_point(const struct easel *easel, const struct scenario_screen *screen,
                        double x_px, double y_px)
{
    double x = ((x_px + 0.5) / screen->width_px - 0.5) * screen->width_m;
    double y = (0.5 - (y_px + 0.5) / screen->height_px) * screen->height_m;
    return vec3_add(easel->centre, vec3_add(vec3_scale(easel->right, x), vec3_scale(easel->up, y)));
}

struct vec3 easel_gravity(const struct easel *easel)
{
    return vec3_scale((struct vec3){easel->right.y, easel->up.y, easel->normal.y},
                      standard_gravity);
}
