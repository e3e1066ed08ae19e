// SPDX-License-Identifier: Apache-2.0
// What is to be shown: a flat surface whose reflectance is known per texel,
// either as one of a few full spectra or as band coefficients.
#ifndef RENDER_MATERIAL_H
#define RENDER_MATERIAL_H

#include "colorimetry/bands.h"
#include "files/exr.h"

enum spectral_mode {
    SPECTRAL_AUTO,    // full where spectra are known, else bands
    SPECTRAL_BANDS,   // lamp-adapted 3xN matrix
    SPECTRAL_PRODUCT, // published fixed matrix on channel products
    SPECTRAL_FULL,    // 1 nm spectra; refused for a material without
};

struct material {
    char name[64];
    int width, height; // texels, 1..8192
    // Either a palette of full spectra …
    int palette_count; // 0..256
    struct spectrum *palette;
    char (*palette_names)[64];
    unsigned char *index; // [height][width] into palette
    // … or coefficients of a band set.
    struct band_set bands;
    float *coefficients; // [bands.count][height][width]
    // How it lies on the screen, metres; 0 = fills the screen.
    double width_m, height_m;
};

// A palette laid out as columns x rows patches with a gap of `gap` (0..0.5) of
// a patch's width between and around them; the gap is palette entry
// `background`. count = columns*rows <= palette entries.
bool material_chart(const char *name, const struct spectrum *palette, char (*names)[64], int count,
                    int columns, int rows, double gap, int background, struct material *out,
                    struct error *err);

// One uniform surface.
bool material_flat(const char *name, const struct spectrum *reflectance, struct material *out,
                   struct error *err);

// Band coefficients from an EXR with channels "band0", "band1", … that holds
// attributes boothd.centre_nm<j> and boothd.width_nm<j> for its set, else the
// shipped set of that count.
bool material_from_exr(const char *name, const char *path, struct material *out, struct error *err);

void material_fini(struct material *material);

// Relative XYZ per texel under a lamp, Y = 1 for the perfect diffuser:
// [height][width][3] floats, malloc'd. Done once per lamp change.
// white is the perfect diffuser's XYZ by the same mode. bands: those that
// spectra become in the modes BANDS and PRODUCT; NULL when no mode needs them.
float *material_bake(const struct material *material, const struct spectrum *lamp,
                     enum observer observer, enum spectral_mode mode, const struct band_set *bands,
                     struct xyz *white, struct error *err);

#endif
