// SPDX-License-Identifier: Apache-2.0
#include "files/png.h"

#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include "files/write.h"

enum { SIDE_MOST = 16384 };

struct complaint {
    char text[128];
    jmp_buf back;
};

static void on_error(png_structp png, png_const_charp text)
{
    struct complaint *complaint = png_get_error_ptr(png);
    snprintf(complaint->text, sizeof complaint->text, "%s", text);
    longjmp(complaint->back, 1);
}

static void on_warning(png_structp png, png_const_charp text)
{
    (void)png, (void)text;
}

// Between setjmp and longjmp nothing local changes.
static bool write_rows(png_structp png, png_infop info, FILE *out, int width, int height,
                       const uint8_t *rgb, struct complaint *complaint)
{
    if (setjmp(complaint->back))
        return false;
    png_init_io(png, out);
    png_set_IHDR(png, info, width, height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int y = 0; y < height; y++)
        png_write_row(png, rgb + (size_t)y * width * 3);
    png_write_end(png, info);
    return true;
}

static bool write_png(FILE *out, int width, int height, const uint8_t *rgb,
                      struct complaint *complaint)
{
    png_structp png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, complaint, on_error, on_warning);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    bool ok = info && write_rows(png, info, out, width, height, rgb, complaint);
    png_destroy_write_struct(&png, &info);
    return ok;
}

bool png_save_rgb8(const char *path, int width, int height, const uint8_t *rgb, struct error *err)
{
    struct whole_file file;
    struct complaint complaint = {.text = "out of memory"};
    if (width < 1 || width > SIDE_MOST || height < 1 || height > SIDE_MOST)
        return fail(err, ERROR_RANGE, "%s: picture of %d x %d pixels; allowed: 1..%d each", path,
                    width, height, SIDE_MOST);
    if (!whole_file_begin(&file, path, err))
        return false;
    if (write_png(file.stream, width, height, rgb, &complaint))
        return whole_file_commit(&file, err);
    whole_file_abandon(&file);
    return fail(err, ERROR_SYSTEM, "%s: writing failed, the file is as it was: %s", path,
                complaint.text);
}
