// SPDX-License-Identifier: Apache-2.0
#include "render/material.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PALETTE_MOST = 256, SIDE_MOST = 8192, PATCH_TEXELS = 100 };

static bool check_palette(const struct spectrum *palette, int count, struct error *err)
{
    if (count < 1 || count > PALETTE_MOST)
        return fail(err, ERROR_RANGE, "%d reflectances: allowed are 1..%d", count, PALETTE_MOST);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < SPECTRUM_COUNT; k++)
            if (!isfinite(palette[i].v[k]))
                return fail(err, ERROR_DATA, "reflectance %d at %d nm is not finite", i,
                            SPECTRUM_FIRST_NM + k);
    return true;
}

// A zeroed material with its palette copied and its index allocated.
static bool with_palette(const char *name, const struct spectrum *palette, char (*names)[64],
                         int count, int width, int height, struct material *out, struct error *err)
{
    struct material made = {.width = width, .height = height, .palette_count = count};
    snprintf(made.name, sizeof made.name, "%s", name);
    made.palette = malloc(count * sizeof *made.palette);
    made.palette_names = calloc(count, sizeof *made.palette_names);
    made.index = malloc((size_t)width * height);
    if (!made.palette || !made.palette_names || !made.index) {
        material_fini(&made);
        return fail(err, ERROR_SYSTEM, "%s: no memory for %d x %d texels", name, width, height);
    }
    memcpy(made.palette, palette, count * sizeof *palette);
    for (int i = 0; names && i < count; i++)
        snprintf(made.palette_names[i], sizeof made.palette_names[i], "%s", names[i]);
    *out = made;
    return true;
}

// Which patch a texel along one side belongs to, or -1 for the gap.
static int patch_along(int texel, int patch, int gap)
{
    int within = texel % (patch + gap);
    return within < gap ? -1 : texel / (patch + gap);
}

static int gap_of(double gap, int patch)
{
    return (int)lround(gap * patch);
}

static int side_of(int patches, int patch, int gap)
{
    return patches * (patch + gap) + gap;
}

bool material_chart(const char *name, const struct spectrum *palette, char (*names)[64], int count,
                    int columns, int rows, double gap, int background, struct material *out,
                    struct error *err)
{
    if (!check_palette(palette, count, err))
        return while_doing(err, "%s", name);
    if (columns < 1 || rows < 1 || columns > count || rows > count || columns * rows > count)
        return fail(err, ERROR_RANGE, "%s: %d x %d patches, but %d reflectances", name, columns,
                    rows, count);
    if (!(gap >= 0 && gap <= 0.5) || background < 0 || background >= count)
        return fail(err, ERROR_RANGE, "%s: gap %g or background %d is outside 0..0.5, 0..%d", name,
                    gap, background, count - 1);
    int longest = columns > rows ? columns : rows, patch = PATCH_TEXELS;
    while (side_of(longest, patch, gap_of(gap, patch)) > SIDE_MOST)
        patch--;
    int between = gap_of(gap, patch);
    int width = side_of(columns, patch, between), height = side_of(rows, patch, between);
    if (!with_palette(name, palette, names, count, width, height, out, err))
        return false;
    for (int y = 0; y < height; y++) {
        int row = patch_along(y, patch, between);
        for (int x = 0; x < width; x++) {
            int column = patch_along(x, patch, between);
            bool inside = row >= 0 && column >= 0;
            out->index[(size_t)y * width + x] = inside ? row * columns + column : background;
        }
    }
    return true;
}

bool material_flat(const char *name, const struct spectrum *reflectance, struct material *out,
                   struct error *err)
{
    if (!check_palette(reflectance, 1, err))
        return while_doing(err, "%s", name);
    if (!with_palette(name, reflectance, NULL, 1, 1, 1, out, err))
        return false;
    out->index[0] = 0;
    return true;
}

static int band_channels(const struct exr *image, int *channels)
{
    int count = 0;
    for (; count < BANDS_MOST; count++) {
        char name[32];
        snprintf(name, sizeof name, "band%d", count);
        channels[count] = exr_channel(image, name);
        if (channels[count] < 0)
            break;
    }
    return count;
}

static bool band_set_of(const struct exr *image, int count, struct band_set *set, struct error *err)
{
    double centre[BANDS_MOST], width[BANDS_MOST];
    int given = 0;
    for (int i = 0; i < count; i++) {
        char name[64];
        snprintf(name, sizeof name, "boothd.centre_nm%d", i);
        given += exr_number(image, name, &centre[i]);
        snprintf(name, sizeof name, "boothd.width_nm%d", i);
        given += exr_number(image, name, &width[i]);
    }
    if (given == 0)
        return band_set_shipped(count, set, err);
    if (given != 2 * count)
        return fail(err, ERROR_DATA,
                    "%d bands, but %d of the attributes boothd.centre_nm<j>, "
                    "boothd.width_nm<j>: all or none are needed",
                    count, given);
    return band_set_make(count, centre, width, set, err);
}

static bool bands_material(const char *name, const struct exr *image, struct material *out,
                           struct error *err)
{
    int channels[BANDS_MOST];
    struct material made = {.width = image->width, .height = image->height};
    int count = band_channels(image, channels);
    if (count < BANDS_LEAST)
        return fail(err, ERROR_DATA, "%d of the channels band0, band1, ...: at least %d are needed",
                    count, BANDS_LEAST);
    if (image->width > SIDE_MOST || image->height > SIDE_MOST)
        return fail(err, ERROR_RANGE, "%d x %d texels: at most %d a side", image->width,
                    image->height, SIDE_MOST);
    if (!band_set_of(image, count, &made.bands, err))
        return false;
    snprintf(made.name, sizeof made.name, "%s", name);
    size_t texels = (size_t)image->width * image->height;
    made.coefficients = malloc(count * texels * sizeof *made.coefficients);
    if (!made.coefficients)
        return fail(err, ERROR_SYSTEM, "no memory for %d bands of %zu texels", count, texels);
    for (int i = 0; i < count; i++)
        memcpy(made.coefficients + i * texels, image->pixels + channels[i] * texels,
               texels * sizeof *made.coefficients);
    *out = made;
    return true;
}

bool material_from_exr(const char *name, const char *path, struct material *out, struct error *err)
{
    struct exr image = {0};
    if (!exr_load(path, &image, err))
        return while_doing(err, "material %s", name);
    bool good = bands_material(name, &image, out, err);
    exr_fini(&image);
    return good || while_doing(err, "material %s: %s", name, path);
}

void material_fini(struct material *material)
{
    free(material->palette);
    free(material->palette_names);
    free(material->index);
    free(material->coefficients);
    material->palette = NULL;
    material->palette_names = NULL;
    material->index = NULL;
    material->coefficients = NULL;
}
