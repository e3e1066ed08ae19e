// SPDX-License-Identifier: Apache-2.0
// Models of a display, both ways, in absolute cd/m2: Day/Taplin/Berns (three
// monotone curves and one 3x4 matrix), and that with one thing more: either
// channels that disturb each other, or a smooth residual over the predicted
// colour. The scalar steps stand in display.glsl, which the GPU, the CPU back
// end and this file all read.
//
//   l = curves(counts)                                     linear light, 0..1
//   day           XYZ = matrix (l 1)
//   interaction   XYZ = matrix (l 1) + interaction terms(l)
//   residual      Lab = Lab_day + shift(Lab_day), Lab_day = Lab(matrix (l 1))
//
// terms(l) = h(r, g), h(g, b), h(b, r), r (1 - r), g (1 - g), b (1 - b), where
// h(x, y) = 2 x y / (x + y + 0.001) is what two channels share: their harmonic
// mean, of finite slope everywhere. The first three describe channels that do
// not add, the last three primaries whose chromaticity moves along their ramp.
// The white of CIELAB is that of the model's own matrix. What is not included:
// viewing angle, uniformity, warm-up.
//
// Sources: Day, Taplin, Berns 2004 (Color Res. Appl. 29, 365-373); cross-talk
// of two primaries at a time: Wen, Wu 2006 (Displays 27, 176-185), the shape of
// the terms is our own; a residual over the predicted colour: as radial basis
// functions in Poljicak, Dolic, Pibernik 2016 (Displays 41), here a lattice.
#ifndef COLORIMETRY_DISPLAY_H
#define COLORIMETRY_DISPLAY_H

#include "colorimetry/colour.h"
#include "colorimetry/lattice.h"

// Nodes stand at k/1020, so that every 8-bit code is a node.
enum { DISPLAY_NODES = 1021 };

// In linear light: what is outside 0..1 by no more than this is in gamut. Below
// it the GPU's single precision cannot tell.
#define DISPLAY_GAMUT_TOLERANCE 1e-6

// Digital counts as fractions of full code, 0..1.
struct counts {
    double r, g, b;
};

// What a model adds to plain Day, and its name in files and on the command
// line.
#define DISPLAY_KINDS(X)                                                                           \
    X(DAY, "day")                                                                                  \
    X(INTERACTION, "interaction")                                                                  \
    X(RESIDUAL, "residual")

enum display_kind {
#define X(name, text) DISPLAY_##name,
    DISPLAY_KINDS(X)
#undef X
};

// Ends with NULL.
extern const char *const display_kind_names[];

// Terms of the interaction, in the order given above.
enum { DISPLAY_TERMS = 6 };

struct display_model {
    char name[128]; // panel and serial
    enum display_kind kind;
    double curve[3][DISPLAY_NODES]; // linear light 0..1, strictly increasing, curve[c][0] = 0, last
                                    // = 1
    double matrix[3][4];            // XYZ = matrix (r g b 1): cd/m2
    double interaction[3][DISPLAY_TERMS]; // INTERACTION: XYZ += interaction terms, cd/m2
    struct lattice residual;              // RESIDUAL: shift of L*, a*, b* over L*, a*, b*

    // Filled by display_model_prepare.
    double inverse[3][3];               // of the left 3x3
    double condition;                   // of the left 3x3, 2-norm, columns as they are
    double crosstalk[3][DISPLAY_TERMS]; // inverse * interaction: linear light
    struct xyz white;                   // matrix (1 1 1 1): cd/m2, white of CIELAB
};

// Checks what the kind uses and fills the rest. Refuses (DATA): curves that do
// not rise, non-finite numbers, a primary whose Y is not above 0 or whose X or
// Z is below -5 % of its Y, condition > 50; an interaction or a residual that
// might fold, so that two inputs give one colour (see display_fold). A
// condition > 10 is the caller's to warn about.
bool display_model_prepare(struct display_model *model, struct error *err);

// How far what the model adds can move its result per unit that its argument
// moves: 0 for DAY; a bound over all inputs, computed from the coefficients.
// Below DISPLAY_FOLD_MOST the forward model is one to one, and the inverse is
// found from anywhere (Banach's fixed point). Needs a prepared model, or one
// whose inverse, crosstalk and residual are filled.
#define DISPLAY_FOLD_MOST 0.9
double display_fold(const struct display_model *model);

// Makes a prepared model emit k > 0 times as much light, black too; it stays
// prepared.
void display_model_scale(struct display_model *model, double k);

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

// XYZ in cd/m2 to counts: Newton's method with a fall-back that always
// converges takes off what the model adds, then the inverse matrix and a search
// of each curve. Deterministic; beyond the gamut continuous. For finite
// counts display_invert(display_forward(c)) = c within 1e-5 of a code.
struct display_inverse display_invert(const struct display_model *model, struct xyz target);

// Linear light that plain Day, the model's matrix alone, needs for a target;
// unclamped.
struct counts display_day_invert(const struct display_model *model, struct xyz target);

// The terms of the interaction at linear lights, each clamped to 0..1; slopes
// (term by channel) unless NULL.
void display_terms(struct counts linear, double terms[DISPLAY_TERMS],
                   double slopes[DISPLAY_TERMS][3]);

// What the model emits at zero counts.
struct xyz display_black(const struct display_model *model);

#endif
