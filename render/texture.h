// SPDX-License-Identifier: Apache-2.0
// Textures that shaders read texel by texel (texelFetch): no filter, one level.
#ifndef RENDER_TEXTURE_H
#define RENDER_TEXTURE_H

// An OpenGL texture and the unit it is bound to.
struct texture {
    unsigned name;
    int unit;
};

// Makes the texture anew of width x height texels, row 0 at the bottom; data may
// be NULL. inner, format and type are OpenGL's; data rows are not padded.
void texture_upload(struct texture texture, int inner, int width, int height, unsigned format,
                    unsigned type, const void *data);

#endif
