// SPDX-License-Identifier: Apache-2.0
#include "simulator/lens.h"

enum { ROUNDS = 30 };
static const double NEAR_ENOUGH = 1e-14, STEP = 1e-6;

struct lens lens_make(const struct scenario_ceiling_camera *s)
{
    // Columns: the camera's x, y and z at zero angles, in the booth.
    struct mat3 up = {{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}};
    struct mat3 turn = mat3_mul(mat3_rotation(0, s->pitch_deg * M_PI / 180),
                                mat3_mul(mat3_rotation(1, s->yaw_deg * M_PI / 180),
                                         mat3_rotation(2, s->roll_deg * M_PI / 180)));
    return (struct lens){
        .settings = s,
        .place = {s->place_m[0], s->place_m[1], s->place_m[2]},
        .booth_from_camera = mat3_mul(up, turn),
        .axis_px = {(s->width_px - 1) / 2.0 + s->axis_px[0],
                    (s->height_px - 1) / 2.0 + s->axis_px[1]},
    };
}

struct tangent lens_distort(const struct lens *lens, struct tangent i)
{
    const double *k = lens->settings->radial, *d = lens->settings->decentred;
    double r2 = i.x * i.x + i.y * i.y;
    double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]));
    return (struct tangent){
        i.x * radial + d[0] * (r2 + 2 * i.x * i.x) + 2 * d[1] * i.x * i.y,
        i.y * radial + 2 * d[0] * i.x * i.y + d[1] * (r2 + 2 * i.y * i.y),
    };
}

struct tangent lens_undistort(const struct lens *lens, struct tangent real)
{
    struct tangent at = real;
    for (int round = 0; round < ROUNDS; round++) {
        struct tangent here = lens_distort(lens, at);
        struct tangent right = lens_distort(lens, (struct tangent){at.x + STEP, at.y});
        struct tangent below = lens_distort(lens, (struct tangent){at.x, at.y + STEP});
        double a = (right.x - here.x) / STEP, b = (below.x - here.x) / STEP;
        double c = (right.y - here.y) / STEP, d = (below.y - here.y) / STEP;
        double ex = real.x - here.x, ey = real.y - here.y, det = a * d - b * c;
        if (fabs(ex) + fabs(ey) < NEAR_ENOUGH || det == 0)
            break;
        at.x += (d * ex - b * ey) / det;
        at.y += (a * ey - c * ex) / det;
    }
    return at;
}

struct tangent lens_ideal(const struct lens *lens, double x_px, double y_px)
{
    double f = lens->settings->focal_px;
    return lens_undistort(
        lens, (struct tangent){(x_px - lens->axis_px[0]) / f, (y_px - lens->axis_px[1]) / f});
}

struct vec3 lens_direction(const struct lens *lens, double x_px, double y_px)
{
    struct tangent ideal = lens_ideal(lens, x_px, y_px);
    return mat3_apply(lens->booth_from_camera, (struct vec3){ideal.x, ideal.y, 1});
}

bool lens_project(const struct lens *lens, struct vec3 at, double *x_px, double *y_px)
{
    struct vec3 p = mat3_apply(mat3_transpose(lens->booth_from_camera), vec3_sub(at, lens->place));
    if (!(p.z > 0))
        return false;
    struct tangent real = lens_distort(lens, (struct tangent){p.x / p.z, p.y / p.z});
    *x_px = lens->axis_px[0] + lens->settings->focal_px * real.x;
    *y_px = lens->axis_px[1] + lens->settings->focal_px * real.y;
    return true;
}

double lens_falloff(const struct lens *lens, struct tangent ideal)
{
    double tan2 = ideal.x * ideal.x + ideal.y * ideal.y;
    double cosine2 = 1 / (1 + tan2);
    return cosine2 * cosine2 * (1 + lens->settings->vignetting * tan2);
}
