// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/colour.h"

static const struct mat3 CONES[] = {
    [CAT_02] = {{{0.7328, 0.4296, -0.1624}, {-0.7036, 1.6975, 0.0061}, {0.0030, 0.0136, 0.9834}}},
    [CAT_16] = {{{0.401288, 0.650173, -0.051461},
                 {-0.250268, 1.204414, 0.045854},
                 {-0.002079, 0.048952, 0.953127}}},
};

static struct vec3 cones_of_white(struct mat3 cones, struct xyz white)
{
    return mat3_apply(cones, (struct vec3){white.X / white.Y, 1, white.Z / white.Y});
}

struct mat3 cat_matrix(enum cat cat, struct xyz from, struct xyz to, double degree)
{
    struct mat3 cones = CONES[cat], back;
    if (!(from.Y > 0 && to.Y > 0))
        return mat3_identity();
    struct vec3 a = cones_of_white(cones, from), b = cones_of_white(cones, to);
    if (!mat3_invert(cones, &back))
        return mat3_identity();
    double gain[3] = {
        degree * b.x / a.x + 1 - degree,
        degree * b.y / a.y + 1 - degree,
        degree * b.z / a.z + 1 - degree,
    };
    struct mat3 scaled = cones;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            scaled.m[i][j] *= gain[i];
    return mat3_mul(back, scaled);
}
