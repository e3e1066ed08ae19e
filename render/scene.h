// SPDX-License-Identifier: Apache-2.0
// What to show, complete: everything a renderer needs for one frame and
// nothing it must ask for.
#ifndef RENDER_SCENE_H
#define RENDER_SCENE_H

#include <stdint.h>

#include "colorimetry/display_view.h"
#include "render/lights.h"
#include "render/stand.h"

enum scene_kind {
    SCENE_DARK,    // black, nothing to proof (no lamp)
    SCENE_PATCH,   // uniform digital counts, never dithered
    SCENE_SURFACE, // a material under the lamp
};

// Pointers are borrowed for the call. A generation number changes whenever
// what it stands beside changes, so that a stage re-does its work only then.
struct scene {
    enum scene_kind kind;
    struct counts patch; // PATCH

    struct screen screen;
    struct rigid booth_from_screen;
    struct vec3 eye; // booth frame, m

    const struct light_points *lights;
    uint64_t lights_generation;
    double level; // live level over taught level of the lamp, 0..10

    const float *texels; // [height][width][3] relative XYZ, Y = 1 for the perfect diffuser
    int texels_width, texels_height;
    uint64_t texels_generation;
    struct vec3 texel_offset; // x, y in 0..1 (y from the top) of the material shown at the
                              // screen's centre
    double texel_scale_x;     // metres of screen a full material width covers, > 0
    double texel_scale_y;     // likewise its height

    struct xyz white;          // relative XYZ of the perfect diffuser under the lamp, Y = 1
    double screen_reflectance; // diffuse, 0..0.2 (0.002)

    const struct display_model *display;
    const struct display_view *view; // NULL: the model holds everywhere
    uint64_t display_generation;     // of both
    int bits; // of the display's input, 8 or 10
    bool dither;
};

// What a pixel should be, in double: see reference.h.
struct pixel {
    double illuminance; // lux on the screen plane there
    struct xyz surface; // cd/m2 that the surface would send
    struct xyz emitted; // surface less the screen's own reflection
    struct xyz asked;   // of the display model, so that emitted leaves towards the eye
    struct display_inverse inverse;
    struct view_gains gains; // of the display there
    struct xyz sent; // cd/m2 that then reaches the eye, by the models: counts clamped and, unless
                     // dithered, rounded; with the screen's own reflection
};

// Gains of the display at a pixel for the scene's eye; all 1 without a view.
// The formula of an eye at the place of a pixel itself: along the normal.
struct view_gains scene_gains(const struct scene *scene, int x_px, int y_px);

// The nearest texel of a SURFACE scene at a pixel's column or row, -1 outside
// the material: there the screen is black and nothing is out of gamut.
int scene_texel_column(const struct scene *scene, int x_px);
int scene_texel_row(const struct scene *scene, int y_px);

#endif
