// SPDX-License-Identifier: Apache-2.0
#include "render/display_gl.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "colorimetry/display_table.h"

// Nodes a row of the table's texture, four texels each (inverse.glsl).
enum { NODES_A_ROW = 64, NODE_TEXELS = 4 };

static GLint at(GLuint program, const char *uniform)
{
    return glGetUniformLocation(program, uniform);
}

static void upload_curves(const struct display_model *model, struct texture curves)
{
    float nodes[3][DISPLAY_NODES];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < DISPLAY_NODES; k++)
            nodes[c][k] = (float)model->curve[c][k];
    texture_upload(curves, GL_R32F, DISPLAY_NODES, 3, GL_RED, GL_FLOAT, nodes);
}

static void give_matrix(GLuint program, const struct display_model *model)
{
    float rows[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            rows[i][j] = (float)model->inverse[i][j];
    glUniform3fv(at(program, "from_xyz"), 3, rows[0]);
    glUniform3f(at(program, "black"), (float)model->matrix[0][3], (float)model->matrix[1][3],
                (float)model->matrix[2][3]);
}

static void give_crosstalk(GLuint program, const struct display_model *model)
{
    float terms[DISPLAY_TERMS][3];
    for (int t = 0; t < DISPLAY_TERMS; t++)
        for (int i = 0; i < 3; i++)
            terms[t][i] = (float)model->crosstalk[i][t];
    glUniform3fv(at(program, "crosstalk"), DISPLAY_TERMS, terms[0]);
}

static bool upload_table(GLuint program, const struct display_model *model, struct texture table,
                         struct error *err)
{
    const int rows = (DISPLAY_TABLE_NODES + NODES_A_ROW - 1) / NODES_A_ROW;
    struct display_table *t = display_table_create(model, err);
    float(*padded)[NODE_TEXELS][3] = t ? calloc((size_t)rows * NODES_A_ROW, sizeof *padded) : NULL;
    if (!padded) {
        free(t);
        return fail(err, ERROR_SYSTEM, "no memory for the display's table");
    }
    memcpy(padded, t->node, sizeof t->node);
    texture_upload(table, GL_RGB32F, NODES_A_ROW * NODE_TEXELS, rows, GL_RGB, GL_FLOAT, padded);
    glUniform3f(at(program, "table_least"), (float)t->least[0], (float)t->least[1],
                (float)t->least[2]);
    glUniform3f(at(program, "table_scale"), (float)t->scale[0], (float)t->scale[1],
                (float)t->scale[2]);
    glUniform1i(at(program, "table_side"), DISPLAY_TABLE_SIDE);
    free(padded);
    free(t);
    return true;
}

bool display_gl_upload(unsigned program, const struct display_model *model, struct texture curves,
                       struct texture table, struct error *err)
{
    const double tolerance =
        model->kind == DISPLAY_RESIDUAL ? DISPLAY_TABLE_LIGHT : DISPLAY_GAMUT_TOLERANCE;
    glUseProgram(program);
    upload_curves(model, curves);
    give_matrix(program, model);
    glUniform1f(at(program, "tolerance"), (float)tolerance);
    switch (model->kind) {
    case DISPLAY_DAY:
        break;
    case DISPLAY_INTERACTION:
        give_crosstalk(program, model);
        break;
    case DISPLAY_RESIDUAL:
        return upload_table(program, model, table, err);
    }
    return true;
}
