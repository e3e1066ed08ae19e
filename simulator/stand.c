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

// Two of three axes turned towards each other.
static void turn(struct vec3 *a, struct vec3 *b, double deg)
{
    double c = cos(deg * M_PI / 180), s = sin(deg * M_PI / 180);
    struct vec3 was = *a;
    *a = vec3_add(vec3_scale(was, c), vec3_scale(*b, s));
    *b = vec3_sub(vec3_scale(*b, c), vec3_scale(was, s));
}

struct vec3 easel_gravity(const struct easel *easel, const double turned_deg[3])
{
    struct vec3 x = easel->right, y = easel->up, z = easel->normal;
    turn(&y, &z, turned_deg[0]);
    turn(&z, &x, turned_deg[1]);
    turn(&x, &y, turned_deg[2]);
    return vec3_scale((struct vec3){x.y, y.y, z.y}, standard_gravity);
}
