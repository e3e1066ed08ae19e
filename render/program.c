// SPDX-License-Identifier: Apache-2.0
#include "render/program.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name, *text;
} FILES[] = {
#include "render/shaders_embedded.inc"
};

static const char *text_of(const char *name)
{
    for (size_t i = 0; i < sizeof FILES / sizeof FILES[0]; i++)
        if (strcmp(FILES[i].name, name) == 0)
            return FILES[i].text;
    return "#error this shader was not embedded\n";
}

static GLuint compile(GLenum stage, const char *name, enum display_kind kind, struct error *err)
{
    char definition[40];
    snprintf(definition, sizeof definition, "#define DISPLAY_KIND %d\n", (int)kind);
    const char *parts[] = {
        text_of("head.glsl"),    definition,
        text_of("display.glsl"), text_of("diffuse.glsl"),
        text_of("output.glsl"),  text_of("display_view.glsl"),
        text_of("view.glsl"),    text_of("inverse.glsl"),
        text_of(name),
    };
    GLuint shader = glCreateShader(stage);
    GLint good = GL_FALSE;
    glShaderSource(shader, sizeof parts / sizeof parts[0], parts, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (good)
        return shader;
    char log[400] = "";
    glGetShaderInfoLog(shader, sizeof log, NULL, log);
    glDeleteShader(shader);
    fail(err, ERROR_SYSTEM, "shader %s: %s", name, log);
    return 0;
}

static bool link_program(GLuint program, const char *fragment, struct error *err)
{
    GLint good = GL_FALSE;
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &good);
    if (good)
        return true;
    char log[400] = "";
    glGetProgramInfoLog(program, sizeof log, NULL, log);
    return fail(err, ERROR_SYSTEM, "program of %s: %s", fragment, log);
}

unsigned program_make(const char *fragment, enum display_kind kind, struct error *err)
{
    GLuint vertex = compile(GL_VERTEX_SHADER, "frame.vert.glsl", kind, err);
    GLuint pixel = vertex ? compile(GL_FRAGMENT_SHADER, fragment, kind, err) : 0;
    GLuint program = 0;
    if (pixel) {
        program = glCreateProgram();
        glAttachShader(program, vertex);
        glAttachShader(program, pixel);
        if (!link_program(program, fragment, err)) {
            glDeleteProgram(program);
            program = 0;
        }
    }
    glDeleteShader(pixel);
    glDeleteShader(vertex);
    return program;
}
