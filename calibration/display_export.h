// SPDX-License-Identifier: Apache-2.0
// A display model for other software: an ICC v4 profile, and a 3D LUT in the
// .cube format.
#ifndef CALIBRATION_DISPLAY_EXPORT_H
#define CALIBRATION_DISPLAY_EXPORT_H

#include "colorimetry/display.h"

// An ICC v4.3 display profile: A2B0 and B2A0 between RGB and CIELAB D50, both
// sampled from the model (33 and 41 nodes a side), relative to the display's
// white, which is adapted by linear Bradford (tag chad); luminance of white in
// tag lumi. Black is not lifted. Colours out of gamut are clipped channel by
// channel. Written whole or not at all.
// Sources: ICC.1:2010 (v4.3); lcms2 writes it.
bool display_export_icc(const struct display_model *model, const char *path, struct error *err);

enum { CUBE_LEAST = 2, CUBE_MOST = 129 };

// A .cube of size nodes a side that turns sRGB values (IEC 61966-2-1: its curve,
// its primaries) into counts of the display, so that sRGB's white is the
// display's own luminance of white and keeps its chromaticity (D65): nothing is
// adapted. Where the display does not reach sRGB's white, all is scaled down
// until it does; *scale (may be NULL) tells by how much. Colours out of gamut
// are clipped channel by channel. Errors: RANGE for the size.
// Source: Cube LUT Specification 1.0 (Adobe, 2013).
bool display_export_cube(const struct display_model *model, int size, const char *path,
                         double *scale, struct error *err);

// boothcal display export: argv[0] is the command's own name.
int display_exporting(int argc, char **argv);

#endif
