// SPDX-License-Identifier: Apache-2.0
// PNG pictures (libpng): what the screen showed, exactly as counts.
#ifndef FILES_PNG_H
#define FILES_PNG_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"

// Writes width x height x 3 interleaved samples of 8 bits (row 0 on top), by
// write-fsync-rename. No colour space is claimed. 1..16384 pixels a side.
bool png_save_rgb8(const char *path, int width, int height, const uint8_t *rgb, struct error *err);

#endif
