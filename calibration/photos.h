// SPDX-License-Identifier: Apache-2.0
// An exposure series: pictures of one still scene from one place, and how long
// each was exposed.
#ifndef CALIBRATION_PHOTOS_H
#define CALIBRATION_PHOTOS_H

#include "files/png.h"

enum { PHOTOS_MOST = 256 };

enum photo_kind {
    PHOTO_LIGHT, // of the scene
    PHOTO_DARK,  // with the lens capped
    PHOTO_FLAT,  // of a field of equal luminance
};

struct photo {
    char path[512];
    double seconds; // 1e-6..3600
    enum photo_kind kind;
    struct picture picture; // owned
};

// Ordered by kind, then by exposure, then by name.
struct photos {
    int count;
    struct photo *photos; // owned
    int width, height, channels, bits;
    int light_count; // the first ones
};

void photos_fini(struct photos *p); // accepts a zeroed one

// Reads a list, "FILE, SECONDS" or "FILE, SECONDS, light|dark|flat" a line ('#'
// begins a comment line; files lie beside the list), and the PNG pictures it
// names. Refuses, naming list, line and file: pictures that differ in size,
// channels or depth; a list without light; exposures that contradict the
// pictures: one that is longer but darker on the whole than another of its kind;
// a series whose shortest picture is clipped over half of it, or whose longest
// is dark all over; more than 4 GiB.
bool photos_load(const char *list, struct photos *out, struct error *err);

#endif
