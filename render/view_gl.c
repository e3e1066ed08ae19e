// SPDX-License-Identifier: Apache-2.0
#include "render/view_gl.h"

#include <epoxy/gl.h>

static GLint at(GLuint program, const char *uniform)
{
    return glGetUniformLocation(program, uniform);
}

void view_gl_upload(unsigned program, const struct display_view *view, struct texture places)
{
    float nodes[VIEW_DENSE * VIEW_DENSE][VIEW_CHANNELS];
    float angles[VIEW_CHANNELS * VIEW_TERMS];
    for (int i = 0; i < VIEW_DENSE * VIEW_DENSE; i++)
        for (int c = 0; c < VIEW_CHANNELS; c++)
            nodes[i][c] = (float)view->dense[c][i / VIEW_DENSE][i % VIEW_DENSE];
    for (int i = 0; i < VIEW_CHANNELS * VIEW_TERMS; i++)
        angles[i] = (float)view->angle[i / VIEW_TERMS][i % VIEW_TERMS];
    texture_upload(places, GL_RGBA32F, VIEW_DENSE, VIEW_DENSE, GL_RGBA, GL_FLOAT, nodes);
    glUseProgram(program);
    glUniform1fv(at(program, "view_angles"), VIEW_CHANNELS * VIEW_TERMS, angles);
    glUniform1f(at(program, "view_sine_most"), (float)view->sine_most);
}

void view_gl_uniforms(unsigned program, const struct scene *scene)
{
    const struct screen *s = &scene->screen;
    struct vec3 eye = rigid_apply(rigid_inverse(scene->booth_from_screen), scene->eye);
    glUniform1i(at(program, "viewed"), scene->view != NULL);
    glUniform3f(at(program, "eye"), (float)eye.x, (float)eye.y, (float)eye.z);
    glUniform2f(at(program, "pixel_m"), (float)(s->width_m / s->width_px),
                (float)(s->height_m / s->height_px));
    glUniform2f(at(program, "corner_m"), (float)(-s->width_m / 2), (float)(-s->height_m / 2));
}
