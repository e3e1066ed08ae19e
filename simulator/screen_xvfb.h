// SPDX-License-Identifier: Apache-2.0
// What the X server shows: Xvfb keeps its screen as a memory-mapped XWD file
// (-fbdir), so an emulated panel sees the pixels without asking the program
// that drew them.
#ifndef SIMULATOR_SCREEN_XVFB_H
#define SIMULATOR_SCREEN_XVFB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct xvfb_screen {
    int width, height;
    int bytes_per_pixel, bytes_per_line;
    bool most_first;  // byte order of a pixel
    uint32_t mask[3]; // red, green, blue
    const unsigned char *pixels;
    void *map; // owned
    size_t size;
};

// Maps a file. Errors: SYSTEM; DATA for anything but a TrueColor ZPixmap of 16
// to 32 bits a pixel with three masks and room for all its lines.
bool xvfb_screen_open(const char *path, struct xvfb_screen *out, struct error *err);

// Accepts a zeroed screen.
void xvfb_screen_close(struct xvfb_screen *screen);

// Input codes 0..1 of the pixel (x, y) as it is now; both must lie inside.
void xvfb_screen_pixel(const struct xvfb_screen *screen, int x, int y, double code[3]);

#endif
