// SPDX-License-Identifier: Apache-2.0
#include "files/png.h"

#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include "files/write.h"

enum { SIDE_MOST = 16384 };

// A compressed picture is smaller than its samples, but for a few chunks.
static const size_t BYTES_MOST = (size_t)1 << 31;

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

static bool sides_fit(const char *path, int width, int height, struct error *err)
{
    if (width >= 1 && width <= SIDE_MOST && height >= 1 && height <= SIDE_MOST)
        return true;
    return fail(err, ERROR_RANGE, "%s: picture of %d x %d pixels; allowed: 1..%d each", path, width,
                height, SIDE_MOST);
}

void picture_fini(struct picture *image)
{
    free(image->samples);
    *image = (struct picture){0};
}

bool picture_init(struct picture *image, int width, int height, int channels, int bits,
                  struct error *err)
{
    if (!sides_fit("new", width, height, err))
        return false;
    if ((channels != 1 && channels != 3) || (bits != 8 && bits != 16))
        return fail(err, ERROR_RANGE,
                    "picture of %d channels of %d bits; allowed: 1 or 3 of 8 or 16", channels,
                    bits);
    uint16_t *samples = calloc((size_t)width * height * channels, sizeof *samples);
    if (!samples)
        return fail(err, ERROR_SYSTEM, "no memory for %d x %d pixels", width, height);
    *image = (struct picture){width, height, channels, bits, samples};
    return true;
}

// ---- writing ---------------------------------------------------------------

// A picture as it is handed to the library, row by row.
struct source {
    int width, height, channels, bits;
    const uint8_t *bytes;    // 8 bits, or
    const uint16_t *samples; // either
    uint8_t *row;
};

static const uint8_t *row_of(const struct source *s, int y)
{
    size_t length = (size_t)s->width * s->channels;
    if (s->bytes)
        return s->bytes + y * length;
    const uint16_t *from = s->samples + y * length;
    for (size_t i = 0; i < length; i++) {
        if (s->bits == 8)
            s->row[i] = (uint8_t)from[i];
        else
            s->row[2 * i] = (uint8_t)(from[i] >> 8), s->row[2 * i + 1] = (uint8_t)from[i];
    }
    return s->row;
}

// Between setjmp and longjmp nothing local changes.
static bool write_rows(png_structp png, png_infop info, FILE *out, const struct source *s,
                       struct complaint *complaint)
{
    if (setjmp(complaint->back))
        return false;
    png_init_io(png, out);
    png_set_IHDR(png, info, (png_uint_32)s->width, (png_uint_32)s->height, s->bits,
                 s->channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int y = 0; y < s->height; y++)
        png_write_row(png, row_of(s, y));
    png_write_end(png, info);
    return true;
}

static bool write_png(FILE *out, const struct source *s, struct complaint *complaint)
{
    png_structp png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, complaint, on_error, on_warning);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    bool ok = info && write_rows(png, info, out, s, complaint);
    png_destroy_write_struct(&png, &info);
    return ok;
}

static bool save(const char *path, const struct source *s, struct error *err)
{
    struct whole_file file;
    struct complaint complaint = {.text = "out of memory"};
    if (!sides_fit(path, s->width, s->height, err) || !whole_file_begin(&file, path, err))
        return false;
    if (write_png(file.stream, s, &complaint))
        return whole_file_commit(&file, err);
    whole_file_abandon(&file);
    return fail(err, ERROR_SYSTEM, "%s: writing failed, the file is as it was: %s", path,
                complaint.text);
}

bool png_save(const char *path, const struct picture *image, struct error *err)
{
    uint8_t *row = malloc((size_t)image->width * image->channels * 2);
    if (!row)
        return fail(err, ERROR_SYSTEM, "%s: no memory for a row", path);
    struct source s = {.width = image->width,
                       .height = image->height,
                       .channels = image->channels,
                       .bits = image->bits,
                       .samples = image->samples,
                       .row = row};
    bool ok = save(path, &s, err);
    free(row);
    return ok;
}

bool png_save_rgb8(const char *path, int width, int height, const uint8_t *rgb, struct error *err)
{
    struct source s = {.width = width, .height = height, .channels = 3, .bits = 8, .bytes = rgb};
    return save(path, &s, err);
}

// ---- reading ---------------------------------------------------------------

struct bytes {
    const uint8_t *at;
    size_t left;
};

static void take_bytes(png_structp png, png_bytep to, size_t size)
{
    struct bytes *bytes = png_get_io_ptr(png);
    if (size > bytes->left)
        png_error(png, "the file ends too soon");
    memcpy(to, bytes->at, size);
    bytes->at += size;
    bytes->left -= size;
}

// What is read, in one place that longjmp leaves alone.
struct reading {
    png_structp png;
    png_infop info;
    struct complaint complaint;
    struct picture image;
    uint8_t *rows;
    png_bytep *lines;
    struct error err;
};

static bool read_head(struct reading *r, const char *path)
{
    png_read_info(r->png, r->info);
    png_uint_32 width = png_get_image_width(r->png, r->info);
    png_uint_32 height = png_get_image_height(r->png, r->info);
    int colour = png_get_color_type(r->png, r->info);
    if (width > SIDE_MOST || height > SIDE_MOST)
        return sides_fit(path, (int)width, (int)height, &r->err);
    if ((colour & PNG_COLOR_MASK_ALPHA) || png_get_valid(r->png, r->info, PNG_INFO_tRNS))
        return fail(&r->err, ERROR_DATA, "%s: has an alpha channel", path);
    png_set_expand(r->png);
    png_read_update_info(r->png, r->info);
    return picture_init(&r->image, (int)width, (int)height, png_get_channels(r->png, r->info),
                        png_get_bit_depth(r->png, r->info), &r->err) ||
           while_doing(&r->err, "%s", path);
}

static void unpack(struct reading *r)
{
    size_t count = (size_t)r->image.width * r->image.height * r->image.channels;
    for (size_t i = 0; i < count; i++)
        r->image.samples[i] =
            r->image.bits == 8 ? r->rows[i] : (uint16_t)(r->rows[2 * i] << 8 | r->rows[2 * i + 1]);
}

static bool read_rows(struct reading *r, const char *path, struct bytes *bytes)
{
    if (setjmp(r->complaint.back))
        return fail(&r->err, ERROR_DATA, "%s: %s", path, r->complaint.text);
    png_set_read_fn(r->png, bytes, take_bytes);
    if (!read_head(r, path))
        return false;
    size_t row = png_get_rowbytes(r->png, r->info);
    r->rows = malloc(row * (size_t)r->image.height);
    r->lines = malloc((size_t)r->image.height * sizeof *r->lines);
    if (!r->rows || !r->lines)
        return fail(&r->err, ERROR_SYSTEM, "%s: no memory for its pixels", path);
    for (int y = 0; y < r->image.height; y++)
        r->lines[y] = r->rows + y * row;
    png_read_image(r->png, r->lines);
    png_read_end(r->png, NULL);
    unpack(r);
    return true;
}

static bool read_png(const char *path, struct bytes *bytes, struct picture *out, struct error *err)
{
    struct reading *r = calloc(1, sizeof *r);
    if (!r)
        return fail(err, ERROR_SYSTEM, "%s: out of memory", path);
    r->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &r->complaint, on_error, on_warning);
    r->info = r->png ? png_create_info_struct(r->png) : NULL;
    bool ok = r->info ? read_rows(r, path, bytes)
                      : fail(&r->err, ERROR_SYSTEM, "%s: out of memory", path);
    png_destroy_read_struct(&r->png, &r->info, NULL);
    free(r->rows);
    free(r->lines);
    if (ok)
        *out = r->image;
    else {
        picture_fini(&r->image);
        fail(err, r->err.code, "%s", r->err.text);
    }
    free(r);
    return ok;
}

bool png_load(const char *path, struct picture *image, struct error *err)
{
    size_t size;
    char *all = file_read(path, BYTES_MOST, &size, err);
    if (!all)
        return false;
    struct bytes bytes = {(const uint8_t *)all, size};
    bool ok = read_png(path, &bytes, image, err);
    free(all);
    return ok;
}
