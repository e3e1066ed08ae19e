// SPDX-License-Identifier: Apache-2.0
// The double-precision reference of one pixel, from the same formula files
// that the GPU compiles.
#ifndef RENDER_REFERENCE_H
#define RENDER_REFERENCE_H

#include "render/scene.h"

// Pixel (x, y) of a SURFACE scene before dither and rounding; texels are taken
// from the nearest texel, as the renderer does. Pure.
struct pixel reference_pixel(const struct scene *scene, int x_px, int y_px);

#endif
