// SPDX-License-Identifier: Apache-2.0
// The Day/Taplin/Berns display model, both ways: three monotone curves, one
// 3x4 matrix, absolute cd/m2. The scalar steps stand in display.glsl, which
// the GPU, the CPU back end and this file all read.
// Source: Day, Taplin, Berns 2004 (Color Res. Appl. 29, 365-373).
#ifndef COLORIMETRY_DISPLAY_H
#define COLORIMETRY_DISPLAY_H

#include "colorimetry/colour.h"

// Nodes stand at k/1020, so that every 8-bit code is a node.
enum { DISPLAY_NODES = 1021 };

// In linear light: what is outside 0..1 by no more than this is in gamut. Below
// it the GPU's single precision cannot tell.
#define DISPLAY_GAMUT_TOLERANCE 1e-6

// Digital counts as fractions of full code, 0..1.
struct counts {
    double r, g, b;
};

struct display_model {
    char name[128];                 // panel and serial
    double curve[3][DISPLAY_NODES]; // linear light 0..1, strictly increasing, curve[c][0] = 0, last
                                    // = 1
    double matrix[3][4];            // XYZ = matrix (r g b 1): cd/m2
    double inverse[3][3];           // of the left 3x3; filled by display_model_prepare
    double condition;               // of the left 3x3, 2-norm, columns as they are
};

// Checks curves and matrix, fills inverse and condition. Refuses (DATA):
// curves that do not rise, non-finite numbers, a primary whose Y is not above 0
// or whose X or Z is below -5 % of its Y, condition > 50. A condition > 10 is
// the caller's to warn about.
bool display_model_prepare(struct display_model *model, struct error *err);

// Makes three curves strictly increasing: pool adjacent violators, then a
// least slope of 1e-6 of full scale per node, ends pinned to 0 and 1. Returns
// the number of pooled nodes.
int display_curve_repair(double curve[DISPLAY_NODES]);

// Counts to XYZ in cd/m2; curves are linear between nodes. counts are clamped
// to 0..1.
struct xyz display_forward(const struct display_model *model, struct counts counts);

struct display_inverse {
    struct counts counts; // clamped to 0..1
    struct counts linear; // before clamping: < 0 or > 1 where out of gamut
    bool in_gamut;        // decided on linear with DISPLAY_GAMUT_TOLERANCE
};

// XYZ in cd/m2 to counts by the inverse matrix and a search of each curve.
// display_inverse(display_forward(c)) = c within 1e-5 of a code.
struct display_inverse display_invert(const struct display_model *model, struct xyz target);

// Black of the model: its fourth column.
struct xyz display_black(const struct display_model *model);

#endif
