// SPDX-License-Identifier: Apache-2.0
// The emulated panel: an IPS LCD with three narrow primaries that no display
// model knows. Each channel has an irregular curve of its own; its colour
// shifts a little with its drive; channels disturb each other; some light
// leaks at zero drive; light falls off with the angle, is not uniform, and
// grows as the panel warms up; the front surface reflects the booth's light.
#ifndef SIMULATOR_PANEL_H
#define SIMULATOR_PANEL_H

#include "base/linear.h"
#include "colorimetry/spectrum.h"
#include "simulator/scenario.h"

enum { PANEL_CODES_MOST = 1024 };

struct panel {
    struct scenario_panel settings;
    struct spectrum primary[3];        // R, G, B at full drive, W m-2 sr-1 nm-1
    struct spectrum shift[3];          // what half drive adds to that, times 4
    struct spectrum leak;              // at zero drive
    struct spectrum coating;           // reflectance of the front surface
    double curve[3][PANEL_CODES_MOST]; // code -> linear light 0..1
    double wave[3][4];                 // non-uniformity: slopes and phases
};

// Settles every chance from seed and scales white to settings->white_cdm2.
void panel_init(struct panel *panel, const struct scenario_panel *settings, int seed);

// Where on the panel and from where: x, y in -1..1 from the centre (x right,
// y up), sin2 = square of the sine of the angle to the normal.
struct panel_view {
    double x, y, sin2;
};

// Light of many pixels, summed.
struct panel_light {
    double full[3], shift[3], leak;
    long pixels;
};

// Adds one pixel of input codes 0..1 each; the panel rounds them to its bits.
void panel_add(const struct panel *panel, const double code[3], const struct panel_view *view,
               struct panel_light *light);

// Mean spectral radiance of what was added, W m-2 sr-1 nm-1, after the panel
// has been on for on_s seconds. Nothing added gives darkness.
void panel_emission(const struct panel *panel, const struct panel_light *light, double on_s,
                    struct spectrum *out);

// One pixel by itself, at the centre along the normal, warm.
void panel_patch(const struct panel *panel, const double code[3], struct spectrum *out);

// Light of one channel (0..2) at an angle over that along the normal.
double panel_angle_gain(int channel, double sin2);

// Radiance that the front surface adds under a spectral irradiance.
void panel_reflection(const struct panel *panel, const struct spectrum *irradiance,
                      struct spectrum *out);

#endif
