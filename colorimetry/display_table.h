// SPDX-License-Identifier: Apache-2.0
// What a residual changes about plain Day's inverse, as a table for the GPU:
// linear light to add to the linear light that plain Day needs for a target.
// Read with display_axis and display_find of display.glsl.
#ifndef COLORIMETRY_DISPLAY_TABLE_H
#define COLORIMETRY_DISPLAY_TABLE_H

#include "colorimetry/display.h"

// Nodes a side. Random colours of the measured panels tried were then found to
// 0.1 of an 8-bit code at worst and 0.0002 on average; channels below code 4,
// where a code is nothing to see, to DISPLAY_TABLE_LIGHT of full light.
enum {
    DISPLAY_TABLE_SIDE = 49,
    DISPLAY_TABLE_NODES = DISPLAY_TABLE_SIDE * DISPLAY_TABLE_SIDE * DISPLAY_TABLE_SIDE
};

// Of linear light: the least by which a colour is out of gamut for the table.
#define DISPLAY_TABLE_LIGHT 1e-4

struct display_table {
    // Of the axes red, green, blue: cube root of linear light at the first node,
    // nodes a unit of that root. The gamut and a little more lies within.
    double least[3], scale[3];
    // By (red * side + green) * side + blue: linear light to add to red, green
    // and blue, then its slopes a node along red, along green, along blue.
    float node[DISPLAY_TABLE_NODES][4][3];
};

// The table of a prepared RESIDUAL model, for free(). NULL (SYSTEM) without
// memory.
struct display_table *display_table_create(const struct display_model *model, struct error *err);

// Linear light through the table, in double, as the GPU does it in single
// precision: what display_invert(target).linear is for day =
// display_day_invert(target). Beyond the table's ends as at them.
struct counts display_table_linear(const struct display_table *table, struct counts day);

#endif
