// SPDX-License-Identifier: Apache-2.0
// OpenEXR images of float channels through OpenEXRCore: scan-line, lossless
// (ZIP written; NONE, RLE, ZIPS, ZIP, PIZ read).
#ifndef FILES_EXR_H
#define FILES_EXR_H

#include <stdbool.h>

#include "base/error.h"

#define EXR_CHANNELS_MOST 64
#define EXR_ATTRIBUTES_MOST 64 // of a kind

// Planar floats: plane c starts at pixels + c * width * height; row 0 is the
// top. Owned by the caller of exr_load; free with exr_fini.
struct exr {
    int width, height; // 1..16384
    int channels;
    char names[EXR_CHANNELS_MOST][32];
    float *pixels;
    // Attributes, optional; a name of "" ends the list.
    struct exr_number {
        char name[64];
        double value;
    } numbers[EXR_ATTRIBUTES_MOST]; // double attributes such as "boothd.width_m"
    struct exr_text {
        char name[64], value[256];
    } texts[EXR_ATTRIBUTES_MOST]; // string attributes such as "boothd.lamp"
};

void exr_fini(struct exr *image);

// Zeroed image of that size with pixels allocated. False when out of range or memory.
bool exr_init(struct exr *image, int width, int height, int channels, struct error *err);

// Reads a file. Lossy compressions (DWA, B44, PXR24) are refused, since a light
// map must be exact; so are tiled, deep and multi-part files and images whose
// pixels are not finite (error DATA gives channel, x, y). Attributes that there
// is no room for are left out.
bool exr_load(const char *path, struct exr *image, struct error *err);

// Writes float channels, ZIP, by write-fsync-rename.
bool exr_save(const char *path, const struct exr *image, struct error *err);

// Index of a channel by name, or -1.
int exr_channel(const struct exr *image, const char *name);

// A double attribute; false when there is none of that name.
bool exr_number(const struct exr *image, const char *name, double *value);

// Sets a double or a text attribute. False when there is no room for it:
// EXR_ATTRIBUTES_MOST others of its kind, or a name or a text that is too long.
bool exr_set_number(struct exr *image, const char *name, double value);
bool exr_set_text(struct exr *image, const char *name, const char *value);

#endif
