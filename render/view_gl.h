// SPDX-License-Identifier: Apache-2.0
// A display's dependence on direction and place as OpenGL reads it (view.glsl).
#ifndef RENDER_VIEW_GL_H
#define RENDER_VIEW_GL_H

#include "render/scene.h"
#include "render/texture.h"

// Fills the texture and the coefficients.
void view_gl_upload(unsigned program, const struct display_view *view, struct texture places);

// Eye and screen of a scene; whether its view counts.
void view_gl_uniforms(unsigned program, const struct scene *scene);

#endif
