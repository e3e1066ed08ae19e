// SPDX-License-Identifier: Apache-2.0
#include "simulator/screen_xvfb.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

// Words of an XWD header, all big-endian (X11/XWDfile.h).
enum xwd_word {
    XWD_HEADER_SIZE = 0,
    XWD_VERSION = 1,
    XWD_FORMAT = 2,
    XWD_WIDTH = 4,
    XWD_HEIGHT = 5,
    XWD_BYTE_ORDER = 7,
    XWD_BITS_PER_PIXEL = 11,
    XWD_BYTES_PER_LINE = 12,
    XWD_RED_MASK = 14,
    XWD_COLOURS = 19,
    XWD_WORDS = 25,
};
enum { XWD_FILE_VERSION = 7, XWD_ZPIXMAP = 2, XWD_COLOUR_SIZE = 12 };

static uint32_t word(const unsigned char *bytes, int index)
{
    const unsigned char *b = bytes + 4 * index;
    return (uint32_t)b[0] << 24 | (uint32_t)b[1] << 16 | (uint32_t)b[2] << 8 | b[3];
}

static bool understand(const char *path, struct xvfb_screen *s, struct error *err)
{
    const unsigned char *b = s->map;
    if (s->size < 4 * XWD_WORDS || word(b, XWD_VERSION) != XWD_FILE_VERSION ||
        word(b, XWD_FORMAT) != XWD_ZPIXMAP)
        return fail(err, ERROR_DATA, "%s: is not an XWD file of version 7 in ZPixmap format", path);
    uint32_t bits = word(b, XWD_BITS_PER_PIXEL);
    uint64_t width = word(b, XWD_WIDTH), height = word(b, XWD_HEIGHT);
    uint64_t line = word(b, XWD_BYTES_PER_LINE);
    uint64_t first = word(b, XWD_HEADER_SIZE) + (uint64_t)XWD_COLOUR_SIZE * word(b, XWD_COLOURS);
    if (bits != 16 && bits != 24 && bits != 32)
        return fail(err, ERROR_DATA, "%s: %u bits a pixel, not 16, 24 or 32", path, bits);
    if (!width || !height || width > 16384 || height > 16384 || line < width * bits / 8 ||
        line > 1 << 20 || first > s->size || height * line > s->size - first)
        return fail(err, ERROR_DATA, "%s: %zu bytes do not hold %llu x %llu pixels", path, s->size,
                    (unsigned long long)width, (unsigned long long)height);
    for (int c = 0; c < 3; c++) {
        s->mask[c] = word(b, XWD_RED_MASK + c);
        if (!s->mask[c])
            return fail(err, ERROR_DATA, "%s: no mask for channel %d: not TrueColor", path, c);
    }
    s->width = (int)width;
    s->height = (int)height;
    s->bytes_per_pixel = (int)bits / 8;
    s->bytes_per_line = (int)line;
    s->most_first = word(b, XWD_BYTE_ORDER) != 0;
    s->pixels = b + first;
    return true;
}

bool xvfb_screen_open(const char *path, struct xvfb_screen *out, struct error *err)
{
    struct xvfb_screen s = {0};
    struct stat about;
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return fail_errno(err, "opening %s", path);
    bool known = fstat(file, &about) == 0;
    if (known && about.st_size > 0) {
        s.size = (size_t)about.st_size;
        s.map = mmap(NULL, s.size, PROT_READ, MAP_SHARED, file, 0);
    }
    close(file);
    if (!s.map || s.map == MAP_FAILED)
        return known && !about.st_size ? fail(err, ERROR_DATA, "%s: is empty", path)
                                       : fail_errno(err, "mapping %s", path);
    if (!understand(path, &s, err)) {
        munmap(s.map, s.size);
        return false;
    }
    *out = s;
    return true;
}

void xvfb_screen_close(struct xvfb_screen *screen)
{
    if (screen->map)
        munmap(screen->map, screen->size);
    *screen = (struct xvfb_screen){0};
}

void xvfb_screen_pixel(const struct xvfb_screen *screen, int x, int y, double code[3])
{
    int size = screen->bytes_per_pixel;
    const unsigned char *at =
        screen->pixels + (size_t)y * screen->bytes_per_line + (size_t)x * size;
    uint32_t pixel = 0;
    for (int i = 0; i < size; i++)
        pixel |= (uint32_t)at[i] << 8 * (screen->most_first ? size - 1 - i : i);
    for (int c = 0; c < 3; c++) {
        uint32_t mask = screen->mask[c], low = mask & -mask;
        code[c] = (double)((pixel & mask) / low) / (double)(mask / low);
    }
}
