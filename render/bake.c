// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>

#include "render/material.h"

// How a surface becomes tristimulus values under one lamp.
struct baker {
    const struct spectrum *lamp;
    enum observer observer;
    bool full;
    const struct band_set *set;
    struct band_matrix matrix;
};

static struct xyz relative(const struct baker *baker, const struct spectrum *reflectance)
{
    if (baker->full)
        return xyz_relative(baker->lamp, reflectance, baker->observer);
    struct bands c = bands_of(baker->set, reflectance);
    return band_xyz(&baker->matrix, &c);
}

static void store(struct xyz c, float out[3])
{
    out[0] = (float)(c.X / 100);
    out[1] = (float)(c.Y / 100);
    out[2] = (float)(c.Z / 100);
}

static void bake_palette(const struct material *material, const struct baker *baker, float *out)
{
    float colours[256][3];
    size_t texels = (size_t)material->width * material->height;
    for (int i = 0; i < material->palette_count; i++)
        store(relative(baker, &material->palette[i]), colours[i]);
    for (size_t i = 0; i < texels; i++)
        for (int k = 0; k < 3; k++)
            out[3 * i + k] = colours[material->index[i]][k];
}

static void bake_bands(const struct material *material, const struct baker *baker, float *out)
{
    size_t texels = (size_t)material->width * material->height;
    for (size_t i = 0; i < texels; i++) {
        struct bands c = {{0}};
        for (int j = 0; j < material->bands.count; j++)
            c.v[j] = material->coefficients[j * texels + i];
        store(band_xyz(&baker->matrix, &c), out + 3 * i);
    }
}

static bool prepare(struct baker *baker, const struct material *material, enum spectral_mode mode,
                    const struct band_set *bands, struct error *err)
{
    bool spectra = material->palette_count > 0;
    if (mode == SPECTRAL_FULL && !spectra)
        return fail(err, ERROR_CONFIG, "spectral = full: the material has bands, no spectra");
    baker->full = spectra && (mode == SPECTRAL_FULL || mode == SPECTRAL_AUTO);
    if (baker->full)
        return true;
    baker->set = spectra ? bands : &material->bands;
    if (!baker->set)
        return fail(err, ERROR_RANGE, "no bands are named for its spectra");
    return mode == SPECTRAL_PRODUCT
               ? band_matrix_product(baker->set, baker->lamp, baker->observer, &baker->matrix, err)
               : band_matrix_adapted(baker->set, baker->lamp, baker->observer, &baker->matrix, err);
}

static struct xyz perfect(const struct baker *baker)
{
    struct bands ones = {{0}};
    for (int i = 0; i < baker->matrix.count; i++)
        ones.v[i] = 1;
    struct xyz w = baker->full ? xyz_relative(baker->lamp, NULL, baker->observer)
                               : band_xyz(&baker->matrix, &ones);
    return (struct xyz){w.X / 100, w.Y / 100, w.Z / 100};
}

float *material_bake(const struct material *material, const struct spectrum *lamp,
                     enum observer observer, enum spectral_mode mode, const struct band_set *bands,
                     struct xyz *white, struct error *err)
{
    struct baker baker = {.lamp = lamp, .observer = observer};
    if (!(xyz_absolute(lamp, observer).Y > 0)) {
        fail(err, ERROR_DATA, "%s: the lamp is dark", material->name);
        return NULL;
    }
    if (!prepare(&baker, material, mode, bands, err)) {
        while_doing(err, "%s", material->name);
        return NULL;
    }
    size_t texels = (size_t)material->width * material->height;
    float *out = malloc(texels * 3 * sizeof *out);
    if (!out) {
        fail(err, ERROR_SYSTEM, "%s: no memory for %zu texels", material->name, texels);
        return NULL;
    }
    if (material->palette_count > 0)
        bake_palette(material, &baker, out);
    else
        bake_bands(material, &baker, out);
    *white = perfect(&baker);
    return out;
}
