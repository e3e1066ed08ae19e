// SPDX-License-Identifier: Apache-2.0
// From readings of red, green, blue, black and white at several directions and
// places to the gains of colorimetry/display_view.h.
#ifndef CALIBRATION_VIEW_FIT_H
#define CALIBRATION_VIEW_FIT_H

#include "colorimetry/display_view.h"

enum view_patch { VIEW_RED, VIEW_GREEN, VIEW_BLUE, VIEW_BLACK, VIEW_WHITE, VIEW_PATCHES };

// The five patches at one place from one direction.
struct view_spot {
    double u, v; // cosines of the direction with the screen's x and y; 0, 0 along the normal
    double x, y; // 0..1 from the left and from the top
    struct xyz xyz[VIEW_PATCHES]; // cd/m2
};

struct view_fit {
    int directions, places;
    double before_de00, after_de00; // largest of white over the directions, and what the fit leaves
    double before_percent,
        after_percent;                // likewise of white's luminance, signed, the largest by size
    double place_de00, place_percent; // largest of white over the places, which are met exactly
};

// spots[0] is the centre along the normal, what all others are compared with.
// Directions are the spots at the centre; places those along the normal, one of
// them the centre again: either none or one at each of VIEW_PLACES by
// VIEW_PLACES. Refuses (DATA), naming what is missing: fewer than twelve
// directions off the normal, fewer than three angles to it at least 5 degrees apart, a gap of more
// than 120 degrees around it, primaries that no matrix can be made of, a channel that grows more
// than twentyfold or vanishes.
bool view_fit(const struct view_spot *spots, int count, struct display_view *view,
              struct view_fit *found, struct error *err);

#endif
