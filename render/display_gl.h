// SPDX-License-Identifier: Apache-2.0
// A display model as shaders/inverse.glsl takes it.
#ifndef RENDER_DISPLAY_GL_H
#define RENDER_DISPLAY_GL_H

#include "colorimetry/display.h"
#include "render/texture.h"

// Gives a program that was made for its kind a prepared model: its curves and, for a
// RESIDUAL, its table (colorimetry/display_table.h, some 0.1 s of work) in these
// textures, the rest as uniforms. The context is current; SYSTEM without
// memory.
bool display_gl_upload(unsigned program, const struct display_model *model, struct texture curves,
                       struct texture table, struct error *err);

#endif
