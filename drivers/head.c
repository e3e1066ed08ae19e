// SPDX-License-Identifier: Apache-2.0
#include "drivers/head.h"

#include <complex.h>
#include <math.h>
#include <string.h>

static const struct vec3 models[][POSE_POINTS] = {
    {{0, 0.040, -0.030}, {0, 0, 0}, {0, -0.070, -0.080}},           // clip: top, middle, bottom
    {{0, 0, 0}, {-0.040, -0.060, -0.100}, {0.040, -0.060, -0.100}}, // cap: top, left, right
};

static const double nearest_m = 0.15, farthest_m = 3;
static const double most_residual_px = 4;
static const double most_off_px = 15; // of a marker by the pose of three others, unrefined
static const double most_turn = 75 * M_PI / 180; // from facing the camera, any axis
static const double most_roll = 50 * M_PI / 180; // within the image
static const double most_unlike = 0.15;          // of the blobs' shape, 0..1
static const double nearly_alike = 0.04;         // orders worth a second look
static const double turn_step = 20 * M_PI / 180; // between the heads tried at first
static const double handicap_per_step = 0.005;   // so that a strange turn needs a reason
static const double pull_per_m = 5;              // rad of rotation a metre is worth
static const double alike = 0.1;                 // rad
static const double cost_per_px = 0.2;           // rad: four markers tell by themselves
static const double fourth_share = 0.1;          // of what is expected, then
static const double same_eye_m = 0.015;
static const double jump_m = 0.10, speed_m_s = 3; // faster is no head
static const int64_t memory_ns = NS_PER_S;
enum { JUMPS_BELIEVED = 3, MATCHES = 24, CANDIDATES = POSE_MOST + 1, CHOICES = 64 };

struct head_markers head_markers(int marker, const double fourth_m[3])
{
    struct head_markers m = {.count = POSE_POINTS};
    memcpy(m.at, models[marker], sizeof models[marker]);
    m.at[POSE_POINTS] = (struct vec3){fourth_m[0], fourth_m[1], fourth_m[2]};
    if (vec3_length(m.at[POSE_POINTS]) > 0)
        m.count = POSE_POINTS_MOST;
    return m;
}

// How far three blobs differ in shape from three projected markers, place,
// size and a turn within the image set aside: 0 alike .. 1; 1 when turned too far.
static double unlikeness(const double complex seen[POSE_POINTS],
                         const double complex model[POSE_POINTS])
{
    double complex seen_mean = 0, model_mean = 0, product = 0;
    double seen_size = 0, model_size = 0;
    for (int i = 0; i < POSE_POINTS; i++) {
        seen_mean += seen[i] / POSE_POINTS;
        model_mean += model[i] / POSE_POINTS;
    }
    for (int i = 0; i < POSE_POINTS; i++) {
        double complex a = seen[i] - seen_mean, b = model[i] - model_mean;
        product += a * conj(b);
        seen_size += creal(a * conj(a));
        model_size += creal(b * conj(b));
    }
    if (seen_size <= 0 || fabs(carg(product)) > most_roll)
        return 1;
    return 1 - creal(product * conj(product)) / (seen_size * model_size);
}

// A head upright at about arm's length that faces the camera along the ray to
// the blobs: what to expect when nothing is known.
static struct rigid facing(const double (*image)[2])
{
    double x = 0, y = 0;
    for (int i = 0; i < POSE_POINTS; i++) {
        x += image[i][0] / POSE_POINTS;
        y += image[i][1] / POSE_POINTS;
    }
    struct vec3 z = vec3_unit((struct vec3){x, y, 1});
    struct vec3 right = vec3_unit(vec3_cross((struct vec3){0, 1, 0}, z));
    struct vec3 up = vec3_cross(z, right);
    return (struct rigid){{{{right.x, up.x, z.x}, {right.y, up.y, z.y}, {right.z, up.z, z.z}}},
                          vec3_scale(z, 0.7)};
}

// One order of three blobs as the markers, and how well it fits.
struct match {
    double image[POSE_POINTS_MOST][2]; // the blob left over last, when there is one
    struct rigid guess;                // the pose whose projection it resembles most
    double unlike;
};

struct matches {
    struct match of[MATCHES]; // one per order of blobs, index = order
    int count;
};

// Every order of three blobs against one expected pose.
static void try_pose(const struct rigid *pose, double handicap, const struct vec3 *markers,
                     struct matches *m)
{
    double complex expected[POSE_POINTS], seen[POSE_POINTS];
    for (int i = 0; i < POSE_POINTS; i++) {
        struct vec3 p = rigid_apply(*pose, markers[i]);
        expected[i] = p.x / p.z + I * (p.y / p.z);
    }
    for (int order = 0; order < m->count; order++) {
        struct match *one = &m->of[order];
        for (int i = 0; i < POSE_POINTS; i++)
            seen[i] = one->image[i][0] + I * one->image[i][1];
        double unlike = unlikeness(seen, expected) + handicap;
        if (unlike < one->unlike) {
            one->unlike = unlike;
            one->guess = *pose;
        }
    }
}

static void list_orders(const double (*blobs)[2], int count, struct matches *m)
{
    m->count = 0;
    for (int order = 0; order < count * count * count; order++) {
        int at[POSE_POINTS] = {order % count, order / count % count, order / count / count};
        if (at[0] == at[1] || at[1] == at[2] || at[0] == at[2])
            continue;
        struct match *one = &m->of[m->count++];
        one->unlike = 1;
        for (int i = 0; i < POSE_POINTS; i++) {
            one->image[i][0] = blobs[at[i]][0];
            one->image[i][1] = blobs[at[i]][1];
        }
        if (count == HEAD_BLOBS)
            memcpy(one->image[POSE_POINTS], blobs[6 - at[0] - at[1] - at[2]], sizeof *blobs);
    }
}

// Against the last pose, or else against heads turned this way and that.
// Returns the unlikeness of the best order.
static double assign(const struct head_memory *memory, const struct vec3 *markers,
                     const double (*blobs)[2], int count, struct matches *m)
{
    double best = 1;
    list_orders(blobs, count, m);
    const struct rigid front = facing(blobs);
    if (memory->known)
        try_pose(&memory->pose, 0, markers, m);
    for (int yaw = -2; yaw <= 2 && !memory->known; yaw++)
        for (int pitch = -2; pitch <= 1; pitch++) {
            struct rigid turned = front;
            turned.rotation =
                mat3_mul(front.rotation, mat3_mul(mat3_rotation(1, yaw * turn_step),
                                                  mat3_rotation(0, pitch * turn_step)));
            try_pose(&turned, handicap_per_step * (yaw * yaw + pitch * pitch), markers, m);
        }
    for (int i = 0; i < m->count; i++)
        best = fmin(best, m->of[i].unlike);
    return best;
}

// Root mean square distance between blobs and projected markers.
static double residual(const struct vec3 *markers, const double (*image)[2], int count,
                       const struct rigid *pose)
{
    double sum = 0;
    for (int i = 0; i < count; i++) {
        struct vec3 p = rigid_apply(*pose, markers[i]);
        if (!(p.z > 0))
            return INFINITY;
        sum += pow(p.x / p.z - image[i][0], 2) + pow(p.y / p.z - image[i][1], 2);
    }
    return sqrt(sum / count);
}

static double angle_between(struct mat3 a, struct mat3 b)
{
    struct mat3 turn = mat3_mul(mat3_transpose(a), b);
    double cosine = (turn.m[0][0] + turn.m[1][1] + turn.m[2][2] - 1) / 2;
    return acos(fmin(fmax(cosine, -1), 1));
}

struct choice {
    struct rigid pose;
    double cost; // rad
    double residual_px;
};

static bool plausible(const struct choice *one, const struct rigid *front)
{
    double z = one->pose.translation.z;
    return one->residual_px <= most_residual_px && z >= nearest_m && z <= farthest_m &&
           angle_between(one->pose.rotation, front->rotation) <= most_turn;
}

static double cost_of(const struct head_memory *memory, const struct rigid *pose,
                      const struct rigid *front)
{
    if (!memory->known)
        return angle_between(pose->rotation, front->rotation);
    struct vec3 moved = vec3_sub(pose->translation, memory->pose.translation);
    return angle_between(pose->rotation, memory->pose.rotation) + pull_per_m * vec3_length(moved);
}

static int insert(struct choice *choices, int kept, const struct choice *one)
{
    int at = kept;
    if (kept == CHOICES)
        return kept;
    for (; at > 0 && choices[at - 1].cost > one->cost; at--)
        choices[at] = choices[at - 1];
    choices[at] = *one;
    return kept + 1;
}

// The plausible poses of an order, cheapest first.
static int choose(const struct head_memory *memory, const struct head_markers *markers,
                  const struct match *match, double focal_px, struct choice *choices, int kept)
{
    const double(*image)[2] = match->image;
    struct rigid found[CANDIDATES], front = facing(image);
    int count = pose_candidates(markers->at, image, found);
    found[count++] = match->guess;
    for (int i = 0; i < count && kept < CHOICES; i++) {
        if (!pose_refine(markers->at, image, POSE_POINTS, &found[i]))
            continue;
        struct choice one = {found[i], cost_of(memory, &found[i], &front),
                             focal_px * residual(markers->at, image, POSE_POINTS, &found[i])};
        if (plausible(&one, &front))
            kept = insert(choices, kept, &one);
    }
    return kept;
}

// Poses of three of four markers.
static int candidates_of(const struct head_markers *markers, const double (*image)[2],
                         const int which[POSE_POINTS], struct rigid out[POSE_MOST])
{
    struct vec3 model[POSE_POINTS];
    double three[POSE_POINTS][2];
    for (int i = 0; i < POSE_POINTS; i++) {
        model[i] = markers->at[which[i]];
        memcpy(three[i], image[which[i]], sizeof three[i]);
    }
    return pose_candidates(model, three, out);
}

// Four markers as one order of four blobs: any three may be in one line for the camera.
static int choose_four(const struct head_memory *memory, const struct head_markers *markers,
                       const struct match *match, double focal_px, struct choice *choices, int kept)
{
    static const int threes[][POSE_POINTS] = {{0, 2, 3}, {1, 2, 3}, {0, 1, 3}};
    const double(*image)[2] = match->image;
    struct rigid found[POSE_MOST], front = facing(image);
    for (size_t t = 0; t < sizeof threes / sizeof *threes; t++) {
        int count = candidates_of(markers, image, threes[t], found);
        for (int i = 0; i < count; i++) {
            struct rigid *pose = &found[i];
            if (focal_px * residual(markers->at, image, POSE_POINTS_MOST, pose) > most_off_px ||
                !pose_refine(markers->at, image, POSE_POINTS_MOST, pose))
                continue;
            struct choice one = {*pose, 0,
                                 focal_px * residual(markers->at, image, POSE_POINTS_MOST, pose)};
            one.cost = cost_per_px * one.residual_px + fourth_share * cost_of(memory, pose, &front);
            if (plausible(&one, &front))
                kept = insert(choices, kept, &one);
        }
    }
    return kept;
}

// The order that the last pose would show.
static int expected_order(const struct head_memory *memory, const struct head_markers *markers,
                          const struct matches *m)
{
    int nearest = 0;
    double least = INFINITY;
    for (int i = 0; i < m->count; i++) {
        double off = residual(markers->at, m->of[i].image, POSE_POINTS_MOST, &memory->pose);
        nearest = off < least ? i : nearest;
        least = fmin(off, least);
    }
    return nearest;
}

static int choose_of_four(const struct head_memory *memory, const struct head_markers *markers,
                          const struct matches *m, double focal_px, struct choice *choices)
{
    int found = 0;
    if (memory->known)
        found = choose_four(memory, markers, &m->of[expected_order(memory, markers, m)], focal_px,
                            choices, 0);
    for (int i = 0; i < m->count && !(memory->known && found); i++)
        found = choose_four(memory, markers, &m->of[i], focal_px, choices, found);
    return found;
}

static int choose_of_three(const struct head_memory *memory, const struct head_markers *markers,
                           const struct matches *m, double best, double focal_px,
                           struct choice *choices)
{
    int found = 0;
    for (int i = 0; i < m->count; i++)
        if (m->of[i].unlike <= best + nearly_alike)
            found = choose(memory, markers, &m->of[i], focal_px, choices, found);
    return found;
}

static bool undecided(const struct choice *choices, int count, struct vec3 eye_from_marker)
{
    struct vec3 eye = rigid_apply(choices[0].pose, eye_from_marker);
    for (int i = 1; i < count; i++) {
        struct vec3 other = rigid_apply(choices[i].pose, eye_from_marker);
        if (choices[i].cost - choices[0].cost < alike &&
            vec3_length(vec3_sub(other, eye)) > same_eye_m)
            return true;
    }
    return false;
}

static bool jumped(struct head_memory *memory, struct vec3 moved, int64_t now_ns)
{
    double seconds = (double)(now_ns - memory->seen_ns) / NS_PER_S;
    if (!memory->known || vec3_length(moved) <= jump_m + speed_m_s * seconds)
        return false;
    return ++memory->jumps <= JUMPS_BELIEVED;
}

void head_solve(struct head_memory *memory, const struct head_markers *markers,
                struct vec3 eye_from_marker, const double (*blobs)[2], int count, double focal_px,
                int64_t now_ns, struct head_sample *out)
{
    struct matches matches;
    struct choice choices[CHOICES];
    out->markers = count;
    out->eye = (struct vec3){0, 0, 0};
    out->reprojection_px = 0;
    out->status = TRACKER_LOST;
    if (now_ns - memory->seen_ns > memory_ns)
        *memory = (struct head_memory){0};
    if (count < POSE_POINTS)
        return;
    double best = assign(memory, markers->at, blobs, count, &matches);
    int found = 0;
    if (count == HEAD_BLOBS && markers->count == POSE_POINTS_MOST)
        found = choose_of_four(memory, markers, &matches, focal_px, choices);
    if (!found && best > most_unlike)
        return;
    out->status = TRACKER_AMBIGUOUS;
    if (!found)
        found = choose_of_three(memory, markers, &matches, best, focal_px, choices);
    if (!found || undecided(choices, found, eye_from_marker))
        return;
    struct rigid pose = choices[0].pose;
    out->reprojection_px = choices[0].residual_px;
    if (jumped(memory, vec3_sub(pose.translation, memory->pose.translation), now_ns))
        return;
    *memory = (struct head_memory){true, pose, now_ns, 0};
    out->eye = rigid_apply(pose, eye_from_marker);
    out->status = TRACKER_SEEN;
}
