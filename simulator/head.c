// SPDX-License-Identifier: Apache-2.0
#include "simulator/head.h"

static const struct vec3 models[2][3] = {
    [HEAD_CLIP] = {{0, 0.040, -0.030}, {0, 0, 0}, {0, -0.070, -0.080}},
    [HEAD_CAP] = {{0, 0, 0}, {-0.040, -0.060, -0.100}, {0.040, -0.060, -0.100}},
};

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

static struct vec3 on_head(const struct scenario_head *head, const struct mat3 *turn,
                           struct vec3 eye, struct vec3 marker)
{
    const double *c = head->clip_from_eye_m;
    struct vec3 origin = {c[0], c[1], c[2]};
    return vec3_add(eye, mat3_apply(*turn, vec3_add(origin, marker)));
}

void clip_markers(const struct scenario_head *head, struct vec3 eye, struct vec3 at,
                  struct vec3 out[3])
{
    struct mat3 turn = head_turn(head, eye, at);
    for (int i = 0; i < 3; i++)
        out[i] = on_head(head, &turn, eye, models[head->markers][i]);
}

struct rigid head_pose(const struct scenario_head *head, struct vec3 eye, struct vec3 at)
{
    struct mat3 turn = head_turn(head, eye, at);
    return (struct rigid){.rotation = turn,
                          .translation = on_head(head, &turn, eye, (struct vec3){0, 0, 0})};
}

bool head_fourth_marker(const struct scenario_head *head, struct vec3 eye, struct vec3 at,
                        struct vec3 *out)
{
    if (!head->fourth)
        return false;
    struct mat3 turn = head_turn(head, eye, at);
    struct vec3 marker = {head->fourth_m[0], head->fourth_m[1], head->fourth_m[2]};
    *out = on_head(head, &turn, eye, marker);
    return true;
}

struct rigid camera_pose(const struct scenario_camera *camera)
{
    double pitch = camera->pitch_deg * M_PI / 180, yaw = camera->yaw_deg * M_PI / 180;
    double roll = camera->roll_deg * M_PI / 180;
    struct rigid booth_from_camera = {
        .rotation = mat3_mul(mat3_mul(mat3_rotation(1, yaw), mat3_rotation(0, -pitch)),
                             mat3_rotation(2, roll)),
        .translation = {camera->place_m[0], camera->place_m[1], camera->place_m[2]},
    };
    return rigid_inverse(booth_from_camera);
}
