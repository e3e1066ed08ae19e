// SPDX-License-Identifier: Apache-2.0
// PNG pictures (libpng): what the screen showed, exactly as counts; what a
// camera saw.
#ifndef FILES_PNG_H
#define FILES_PNG_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"

// Samples as counts, [height][width][channels], row 0 on top.
struct picture {
    int width, height; // 1..16384
    int channels;      // 1 (grey) or 3 (RGB)
    int bits;          // 8 or 16
    uint16_t *samples; // owned, 0..255 or 0..65535
};

// Accepts a zeroed image.
void picture_fini(struct picture *image);

// Zeroed samples. False (RANGE, SYSTEM) for a size that is not allowed, or
// without memory.
bool picture_init(struct picture *image, int width, int height, int channels, int bits,
                  struct error *err);

// Reads a picture: grey of fewer bits and palettes become 8 bits; an alpha
// channel is refused, since counts beside it may have been multiplied by it.
// Gamma and colour space chunks are left alone. Errors: CONFIG when there is no
// such file, DATA when it is no sound PNG, RANGE when it is too large.
bool png_load(const char *path, struct picture *image, struct error *err);

// Writes by write-fsync-rename. No colour space is claimed.
bool png_save(const char *path, const struct picture *image, struct error *err);

// Writes width x height x 3 interleaved samples of 8 bits (row 0 on top), by
// write-fsync-rename. No colour space is claimed. 1..16384 pixels a side.
bool png_save_rgb8(const char *path, int width, int height, const uint8_t *rgb, struct error *err);

#endif
