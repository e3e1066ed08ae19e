// SPDX-License-Identifier: Apache-2.0
// A smooth map from a box of three coordinates to three values: uniform cubic
// B-splines, twice continuously differentiable, constant beyond the box.
// Source: de Boor 1978, A Practical Guide to Splines, ch. IX; tensor product.
#ifndef COLORIMETRY_LATTICE_H
#define COLORIMETRY_LATTICE_H

#include <stdbool.h>

#include "base/linear.h"

// Coefficients a side; they span LATTICE_SIDE - 3 intervals of the box.
enum { LATTICE_SIDE = 6, LATTICE_NODES = LATTICE_SIDE * LATTICE_SIDE * LATTICE_SIDE };

struct lattice {
    struct vec3 least, most;       // corners of the box, least < most
    double node[LATTICE_NODES][3]; // coefficients, by lattice_node
};

static inline int lattice_node(int x, int y, int z)
{
    return (x * LATTICE_SIDE + y) * LATTICE_SIDE + z;
}

// The 64 coefficients that count at a place: those of x = first[0] + i, y =
// first[1] + j, z = first[2] + k with weight[0][i] * weight[1][j] *
// weight[2][k], i, j, k in 0..3. Weights are >= 0 and sum to 1 on each axis. slope: of weight by
// the coordinate, 0 beyond the box.
struct lattice_place {
    int first[3];
    double weight[3][4], slope[3][4];
};

// A coordinate that is not a number counts as least.
struct lattice_place lattice_find(const struct lattice *lattice, struct vec3 at);

// The value, and d value / d coordinate (row: value) when slopes is not NULL.
struct vec3 lattice_at(const struct lattice *lattice, struct vec3 at, struct mat3 *slopes);

// The largest sum of the absolute slopes of any value, of 13 places a side:
// four an interval, between which it may be exceeded by some 5 %. Infinite when a
// coefficient is not finite.
double lattice_slope_most(const struct lattice *lattice);

// Where coefficient i of an axis (0..2) has its weight: its Greville abscissa.
double lattice_abscissa(const struct lattice *lattice, int axis, int i);

#endif
