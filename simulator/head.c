// SPDX-License-Identifier: Apache-2.0
#include "simulator/head.h"

static const struct vec3 clip[3] = {{0, 0.040, -0.030}, {0, 0, 0}, {0, -0.070, -0.080}};

static double limited(double angle, double most_deg)
{
    double most = most_deg * M_PI / 180;
    return angle > most ? most : angle < -most ? -most : angle;
}

struct mat3 head_turn(const struct scenario_head *head, struct vec3 eye, struct vec3 at)
{
    struct vec3 gaze = vec3_sub(at, eye);
    double down = limited(atan2(-gaze.y, hypot(gaze.x, gaze.z)), head->turn_most_deg);
    double aside = limited(atan2(-gaze.x, -gaze.z), head->turn_most_deg);
    return mat3_mul(mat3_rotation(1, aside), mat3_rotation(0, -down));
}

void head_markers(const struct scenario_head *head, struct vec3 eye, struct vec3 at,
                  struct vec3 out[3])
{
    struct mat3 turn = head_turn(head, eye, at);
    const double *c = head->clip_from_eye_m;
    struct vec3 origin = {c[0], c[1], c[2]};
    for (int i = 0; i < 3; i++)
        out[i] = vec3_add(eye, mat3_apply(turn, vec3_add(origin, clip[i])));
}

struct rigid camera_pose(const struct scenario_camera *camera)
{
    double pitch = camera->pitch_deg * M_PI / 180, yaw = camera->yaw_deg * M_PI / 180;
    struct rigid booth_from_camera = {
        .rotation = mat3_mul(mat3_rotation(1, yaw), mat3_rotation(0, -pitch)),
        .translation = {camera->place_m[0], camera->place_m[1], camera->place_m[2]},
    };
    return rigid_inverse(booth_from_camera);
}
