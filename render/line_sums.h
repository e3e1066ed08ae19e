// SPDX-License-Identifier: Apache-2.0
// Moments of the columns and of the rows of any rectangle of a luminance map,
// in time that grows with its border rather than with its area.
#ifndef RENDER_LINE_SUMS_H
#define RENDER_LINE_SUMS_H

#include "render/lights.h"

// Sums of L, L d and L d2 over the pixels of one line; d in metres from some
// middle, along the line.
struct line_sum {
    double energy, first, second;
};

// The sums of every column within each strip of LINE_SUMS_STRIP rows, about
// the strip's own middle, and likewise of every row. Everything else is added
// up from these and never subtracted: a summed-area table would cancel away
// the digits of small or faint rectangles.
struct line_sums {
    const struct luminance_map *map; // outlives the sums
    double step_x, step_z;           // m
    struct line_sum *columns;        // [height / LINE_SUMS_STRIP][width]
    struct line_sum *rows;           // [width / LINE_SUMS_STRIP][height]
};

enum { LINE_SUMS_STRIP = 32 };

bool line_sums_init(struct line_sums *sums, const struct luminance_map *map, struct error *err);

// Accepts a zeroed or half-built one.
void line_sums_fini(struct line_sums *sums);

// columns[right - left] about the rectangle's middle row, rows[bottom - top]
// about its middle column. The rectangle must not be empty. Relative error of
// every sum: 1e-13 of the sum of its terms' magnitudes.
void line_sums_of(const struct line_sums *sums, struct pixels of, struct line_sum *columns,
                  struct line_sum *rows);

#endif
