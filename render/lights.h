// SPDX-License-Identifier: Apache-2.0
// From a luminance image of the booth's ceiling to light points by median cut.
#ifndef RENDER_LIGHTS_H
#define RENDER_LIGHTS_H

#include "base/error.h"
#include "base/linear.h"
#include "files/exr.h"

// A horizontal rectangle that emits downwards.
struct ceiling {
    double centre_m[3]; // booth frame
    double width_m;     // along x, 0.01..20
    double depth_m;     // along z, 0.01..20
};

// Luminance in cd/m2, [height][width]; row 0 is the edge far from the observer
// (least z), column 0 the left edge (least x).
struct luminance_map {
    struct ceiling ceiling;
    int width, height; // 1..16384
    double *luminance; // owned
};

// From an EXR with channel "Y" (cd/m2). Size in metres from the attributes
// boothd.width_m and boothd.depth_m when present (they must agree with
// ceiling within 1 %), else from ceiling. ceiling may be NULL: then both
// attributes must be there, and the centre is the origin. What camera noise put
// below zero is set to 0. Error DATA without "Y" or without a size.
bool luminance_map_load(const char *path, const struct ceiling *ceiling, struct luminance_map *map,
                        struct error *err);
void luminance_map_fini(struct luminance_map *map);

// Mean luminance of the map in a disc about a booth point on the ceiling, cd/m2.
double luminance_map_spot(const struct luminance_map *map, double x_m, double z_m,
                          double diameter_m);

void luminance_map_scale(struct luminance_map *map, double k);

struct light_point {
    struct vec3 at;      // booth frame, m
    double intensity_cd; // towards straight down: (A/P) * sum of luminance
};

struct light_points {
    int count;
    struct light_point *points; // owned
};

// Pixels of a map; right and bottom lie outside.
struct pixels {
    int left, top, right, bottom;
};

enum median_cut { CUT_VARIANCE, CUT_ENERGY };
enum { MEDIAN_CUT_MOST = 1 << 20 };

// Exactly `most` points (1..MEDIAN_CUT_MOST), or as many as the map has lit pixels when
// those are fewer; an all-dark map gives none. The region of the greatest
// energy (CUT_ENERGY) or second moment (CUT_VARIANCE) is split next. Sums in
// double about each region's own middle, so that small and faint regions keep
// their digits (see line_sums.h). Dark edges are trimmed, so that no part is
// ever dark; a single pixel is never split; ties, even those that rounding
// hides, keep the lower index. Error RANGE.
// Sources: Debevec 2005 (equal energy); Viriyothai, Debevec 2009 (variance).
bool median_cut(const struct luminance_map *map, enum median_cut how, int most,
                struct light_points *out, struct error *err);

// The same, and of every point the pixels it stands for: disjoint, together
// all that are lit. *regions has out->count elements and is the caller's to free.
bool median_cut_regions(const struct luminance_map *map, enum median_cut how, int most,
                        struct light_points *out, struct pixels **regions, struct error *err);

void light_points_fini(struct light_points *lights);

// Illuminance on a surface at p with unit normal n (booth frame), lux. Sum
// over the points: I max(0, w.n) max(0, -w.down) / d^2 (see
// shaders/diffuse.glsl). level scales every intensity.
double light_points_illuminance(const struct light_points *lights, double level, struct vec3 p,
                                struct vec3 n);

// The same by dense integration over every pixel of the map: the reference.
double luminance_map_illuminance(const struct luminance_map *map, struct vec3 p, struct vec3 n);

#endif
