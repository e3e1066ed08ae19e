// SPDX-License-Identifier: Apache-2.0
// The true luminance of the booth's ceiling under one lamp, and what light
// that ceiling sheds. A horizontal rectangle that emits downwards, alike in
// all directions. Row 0 is the edge far from the observer (least z), column 0
// the left edge (least x).
#ifndef SIMULATOR_CEILING_H
#define SIMULATOR_CEILING_H

#include "base/linear.h"
#include "files/exr.h"
#include "simulator/scenario.h"

struct ceiling_image {
    struct vec3 centre;
    double width_m, depth_m;
    int width, height;
    double *luminance; // cd/m2, [height][width], owned
};

// The pattern of a lamp, of any scale (greatest about 1): tubes with darker
// ends, or round hot spots, on a dim diffuse ceiling with a dark trim. The
// differences between tubes are drawn from seed.
bool ceiling_make(const struct scenario_ceiling *ceiling, const struct scenario_lamp *lamp,
                  int seed, struct ceiling_image *out, struct error *err);

// Width of the dark trim.
double ceiling_trim_m(void);

// Accepts a zeroed image.
void ceiling_fini(struct ceiling_image *image);

void ceiling_scale(struct ceiling_image *image, double k);

// Illuminance (lux) at p on a surface of unit normal n, booth frame: the sum
// over all pixels of L cos cos dA / d2. Points at or above the ceiling get 0.
double ceiling_illuminance(const struct ceiling_image *image, struct vec3 p, struct vec3 n);

// Mean luminance in a disc about a point of the ceiling, cd/m2; 0 where the
// disc lies outside.
double ceiling_spot(const struct ceiling_image *image, double x_m, double z_m, double diameter_m);

// Its luminance times k averaged onto a map of the given pixels. Channel "Y",
// attributes boothd.width_m, boothd.depth_m.
bool ceiling_true_map(const struct ceiling_image *image, double k, const int map_px[2],
                      struct exr *out, struct error *err);

// What a camera makes of it: averaged onto the map's pixels, off by a scale
// error of the lamp's own, with noise that makes some dark pixels negative.
// Channel "Y" in cd/m2, attributes boothd.width_m, boothd.depth_m, boothd.lamp.
bool ceiling_camera_map(const struct ceiling_image *image, const struct scenario_ceiling *settings,
                        const char *lamp, int seed, struct exr *out, struct error *err);

#endif
