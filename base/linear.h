// SPDX-License-Identifier: Apache-2.0
// Vectors, 3x3 matrices and rigid transforms, in double. Lengths are metres
// unless a name says otherwise; frames stand in names:
// p_screen = apply(screen_from_tracker, p_tracker).
#ifndef BASE_LINEAR_H
#define BASE_LINEAR_H

#include <math.h>
#include <stdbool.h>

struct vec3 {
    double x, y, z;
};

struct mat3 {
    double m[3][3]; // row, column
};

// A rotation followed by a translation.
struct rigid {
    struct mat3 rotation;
    struct vec3 translation; // m
};

static inline struct vec3 vec3_add(struct vec3 a, struct vec3 b)
{
    return (struct vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline struct vec3 vec3_sub(struct vec3 a, struct vec3 b)
{
    return (struct vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline struct vec3 vec3_scale(struct vec3 a, double k)
{
    return (struct vec3){a.x * k, a.y * k, a.z * k};
}

static inline double vec3_dot(struct vec3 a, struct vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct vec3 vec3_cross(struct vec3 a, struct vec3 b)
{
    return (struct vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double vec3_length(struct vec3 a)
{
    return sqrt(vec3_dot(a, a));
}

// Unit vector along a; (0, 0, 0) stays (0, 0, 0).
static inline struct vec3 vec3_unit(struct vec3 a)
{
    double length = vec3_length(a);
    return length > 0 ? vec3_scale(a, 1 / length) : a;
}

struct mat3 mat3_identity(void);
struct mat3 mat3_mul(struct mat3 a, struct mat3 b);
struct mat3 mat3_transpose(struct mat3 a);
struct vec3 mat3_apply(struct mat3 a, struct vec3 v);

// Rotation by angle (rad, right-handed) about the x, y or z axis (0, 1, 2).
struct mat3 mat3_rotation(int axis, double angle);

// Inverse by cofactors in double. False, and *out untouched, when the
// determinant is zero or not finite.
bool mat3_invert(struct mat3 a, struct mat3 *out);

// 2-norm condition number (largest over smallest singular value), >= 1, by
// one-sided Jacobi rotations; INFINITY for a singular matrix.
double mat3_condition(struct mat3 a);

struct vec3 rigid_apply(struct rigid t, struct vec3 p);
struct rigid rigid_mul(struct rigid a, struct rigid b); // first b, then a
struct rigid rigid_inverse(struct rigid t);

#endif
