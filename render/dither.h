// SPDX-License-Identifier: Apache-2.0
// A blue-noise tile of thresholds for dithering: every level appears once, so
// that over a tile the mean of the rounded codes is the wanted value.
#ifndef RENDER_DITHER_H
#define RENDER_DITHER_H

#include <stdint.h>

enum { DITHER_SIDE = 64, DITHER_LEVELS = DITHER_SIDE * DITHER_SIDE };

// Ranks 0..DITHER_LEVELS-1, each once, [row][column]; the tile repeats without
// a seam. A threshold is (rank + 0.5) / DITHER_LEVELS and a code is
// floor(value + threshold). The same on every call; takes some 50 ms.
// Source: Ulichney 1993 (The void-and-cluster method for dither array
// generation, Proc. SPIE 1913).
void dither_tile(uint16_t rank[DITHER_LEVELS]);

#endif
