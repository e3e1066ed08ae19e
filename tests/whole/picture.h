// SPDX-License-Identifier: Apache-2.0
// Reads a PNG back.
#ifndef TESTS_WHOLE_PICTURE_H
#define TESTS_WHOLE_PICTURE_H

#include <png.h>
#include <stdint.h>
#include <stdlib.h>

// [height][width][3] samples of 8 bits, malloc'd; NULL when it is no PNG.
static inline uint8_t *picture_read(const char *path, int *width, int *height)
{
    png_image image = {.version = PNG_IMAGE_VERSION};
    if (!png_image_begin_read_from_file(&image, path))
        return NULL;
    image.format = PNG_FORMAT_RGB;
    uint8_t *pixels = malloc(PNG_IMAGE_SIZE(image));
    *width = (int)image.width;
    *height = (int)image.height;
    if (pixels && png_image_finish_read(&image, NULL, pixels, 0, NULL))
        return pixels;
    free(pixels);
    return NULL;
}

#endif
