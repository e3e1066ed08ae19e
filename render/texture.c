// SPDX-License-Identifier: Apache-2.0
#include "render/texture.h"

#include <epoxy/gl.h>

void texture_upload(struct texture texture, int inner, int width, int height, unsigned format,
                    unsigned type, const void *data)
{
    glActiveTexture(GL_TEXTURE0 + (unsigned)texture.unit);
    glBindTexture(GL_TEXTURE_2D, texture.name);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, inner, width, height, 0, format, type, data);
}
