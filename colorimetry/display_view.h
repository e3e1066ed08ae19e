// SPDX-License-Identifier: Apache-2.0
// What a display model leaves out: that the light of each channel, and black's,
// depends on the direction that it is seen from and on the place on the
// screen. A display model describes the centre along its normal; this leads
// there and back. The scalar steps stand in display_view.glsl.
//
//   XYZ(u, v, x, y) = M (g_r r, g_g g, g_b b) + g_k black
//   g_c = place_c(x, y) exp(a0 u + a1 v + a2 u^2 + a3 u v + a4 v^2 + a5 s^2 + a6 s^3)
//
// s = u^2 + v^2; u, v: cosines of the direction to the eye with the screen's x (right) and y
// (up); x, y: 0..1 from the left and from the top; M, r, g, b: matrix and linear
// light of the display model.
#ifndef COLORIMETRY_DISPLAY_VIEW_H
#define COLORIMETRY_DISPLAY_VIEW_H

#include "colorimetry/display.h"

enum {
    VIEW_CHANNELS = 4, // red, green, blue, black
    VIEW_TERMS = 7,
    VIEW_GRID = 5,
    VIEW_DENSE = 33
};

// Where the measured places of a row or a column lie, 0..1 of the screen.
extern const double VIEW_PLACES[VIEW_GRID];

struct display_view {
    double angle[VIEW_CHANNELS][VIEW_TERMS];
    double sine_most; // sine of the outermost measured angle, 0..0.99; beyond it the gain is held
    double place[VIEW_CHANNELS][VIEW_GRID][VIEW_GRID];   // [row from the top][column]; centre = 1
    double dense[VIEW_CHANNELS][VIEW_DENSE][VIEW_DENSE]; // filled by display_view_prepare
};

// A view that changes nothing.
void display_view_none(struct display_view *view);

// Checks, and fills dense by the polynomial of fourth degree through each row
// and column. Refuses (DATA), naming channel and place: what is not finite, a
// gain outside 0.05..20 anywhere on the screen or in the measured directions, a
// centre that is not 1, sine_most outside 0..0.99.
bool display_view_prepare(struct display_view *view, struct error *err);

struct view_gains {
    double c[VIEW_CHANNELS];
};

// Gains at a place for a direction. Directions outside the measured ones are
// taken as the nearest measured one; places outside the screen as its border.
struct view_gains display_view_gains(const struct display_view *view, double u, double v, double x,
                                     double y);

// What the display model must be asked for, so that target (cd/m2) leaves the
// screen with these gains; and what leaves when the model says at_centre. Each
// undoes the other. No range: what is out of gamut stays so.
struct xyz display_view_ask(const struct display_model *model, struct view_gains gains,
                            struct xyz target);
struct xyz display_view_leaves(const struct display_model *model, struct view_gains gains,
                               struct xyz at_centre);

#endif
