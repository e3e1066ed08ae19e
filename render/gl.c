// SPDX-License-Identifier: Apache-2.0
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/context.h"
#include "render/display_gl.h"
#include "render/dither.h"
#include "render/program.h"
#include "render/renderer.h"
#include "render/view_gl.h"

// A texture's number is also its unit.
enum place {
    LIGHTS,
    ILLUMINANCE,
    TEXELS,
    PLACES,
    CURVES,
    TABLE,
    RANKS,
    VIEW,
    EMITTED,
    COUNTS,
    TEXTURE_COUNT
};

static const char *const SAMPLERS[] = {
    [LIGHTS] = "lights", [ILLUMINANCE] = "illuminance", [TEXELS] = "texels",
    [PLACES] = "places", [CURVES] = "curves",           [TABLE] = "table",
    [RANKS] = "ranks",   [VIEW] = "view_places",
};

enum { LIGHTS_A_ROW = 64 };

struct renderer {
    struct context *context;
    int width, height;
    char name[256];
    GLuint vertices, light_program, light_target, frame_target;
    GLuint frame_programs[DISPLAY_RESIDUAL + 1]; // by kind of display model, 0 until it is shown
    GLuint frame_program;                        // that of the display shown
    GLuint textures[TEXTURE_COUNT];
    int bits_wanted;   // by the options
    int code_bits;     // of the counts texture
    struct scene last; // what is shown
    bool shown;        // last is valid
    struct scene seen; // the inputs that lights, texels and curves were last made from
    bool seen_lights, seen_places, seen_texels, seen_display;
    bool surface;   // a SURFACE frame has been drawn
    double outside; // its share out of gamut, < 0 when not counted yet
};

// ---- set-up ----------------------------------------------------------------

static void upload(struct renderer *r, enum place which, GLint inner, int width, int height,
                   GLenum format, GLenum type, const void *data)
{
    texture_upload((struct texture){r->textures[which], which}, inner, width, height, format, type,
                   data);
}

static void upload_ranks(struct renderer *r)
{
    uint16_t ranks[DITHER_LEVELS];
    dither_tile(ranks);
    upload(r, RANKS, GL_R16I, DITHER_SIDE, DITHER_SIDE, GL_RED_INTEGER, GL_SHORT, ranks);
}

static void name_samplers(GLuint program)
{
    glUseProgram(program);
    for (size_t i = 0; i < sizeof SAMPLERS / sizeof SAMPLERS[0]; i++)
        glUniform1i(glGetUniformLocation(program, SAMPLERS[i]), (GLint)i);
}

static bool complete(struct error *err)
{
    GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    return status == GL_FRAMEBUFFER_COMPLETE ||
           fail(err, ERROR_SYSTEM, "OpenGL: frame buffer incomplete: 0x%x", status);
}

// Takes every error that OpenGL has kept; a lost context keeps one for ever.
static bool no_error(const char *doing, struct error *err)
{
    GLenum first = glGetError();
    if (first == GL_NO_ERROR)
        return true;
    for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; i++)
        ;
    return fail(err, ERROR_SYSTEM, "OpenGL: %s: error 0x%x", doing, first);
}

static void attach(int place, GLuint texture)
{
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0 + place, GL_TEXTURE_2D, texture, 0);
}

static bool size_counts(struct renderer *r, int bits, struct error *err)
{
    if (r->code_bits == bits)
        return true;
    upload(r, COUNTS, bits == 10 ? GL_RGB10_A2 : GL_RGBA8, r->width, r->height, GL_RGBA,
           GL_UNSIGNED_BYTE, NULL);
    glBindFramebuffer(GL_FRAMEBUFFER, r->frame_target);
    attach(0, r->textures[EMITTED]);
    attach(1, r->textures[COUNTS]);
    glDrawBuffers(2, (GLenum[]){GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1});
    r->code_bits = bits;
    return complete(err);
}

static bool choose_program(struct renderer *r, enum display_kind kind, struct error *err)
{
    GLuint *program = &r->frame_programs[kind];
    if (!*program && !(*program = program_make("frame.frag.glsl", kind, err)))
        return false;
    name_samplers(*program);
    r->frame_program = *program;
    return true;
}

static bool set_up(struct renderer *r, struct error *err)
{
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    if (r->width < 1 || r->height < 1 || r->width > most || r->height > most)
        return fail(err, ERROR_RANGE, "screen of %d x %d pixels: this OpenGL allows 1..%d",
                    r->width, r->height, most);
    r->light_program = program_make("light.frag.glsl", DISPLAY_DAY, err);
    if (!r->light_program || !choose_program(r, DISPLAY_DAY, err))
        return false;
    name_samplers(r->light_program);
    glGenVertexArrays(1, &r->vertices);
    glBindVertexArray(r->vertices);
    glGenTextures(TEXTURE_COUNT, r->textures);
    glGenFramebuffers(1, &r->light_target);
    glGenFramebuffers(1, &r->frame_target);
    upload_ranks(r);
    upload(r, ILLUMINANCE, GL_R32F, r->width, r->height, GL_RED, GL_FLOAT, NULL);
    upload(r, EMITTED, GL_RGBA32F, r->width, r->height, GL_RGBA, GL_FLOAT, NULL);
    glBindFramebuffer(GL_FRAMEBUFFER, r->light_target);
    attach(0, r->textures[ILLUMINANCE]);
    return complete(err) && size_counts(r, 8, err);
}

struct renderer *renderer_create(const struct renderer_options *options, struct error *err)
{
    struct renderer *r = calloc(1, sizeof *r);
    if (!r) {
        fail(err, ERROR_SYSTEM, "no memory for a renderer");
        return NULL;
    }
    r->width = options->width;
    r->height = options->height;
    r->bits_wanted = options->bits;
    r->context = options->window ? window_open(options, err) : headless_open(err);
    if (!r->context || !set_up(r, err)) {
        renderer_destroy(r);
        return NULL;
    }
    snprintf(r->name, sizeof r->name, "%s%s%s", (const char *)glGetString(GL_RENDERER),
             r->context->note[0] ? ", " : "", r->context->note);
    return r;
}

void renderer_destroy(struct renderer *r)
{
    if (!r)
        return;
    if (r->context && r->context->use(r->context, NULL)) {
        glDeleteProgram(r->light_program);
        for (int k = 0; k <= DISPLAY_RESIDUAL; k++)
            glDeleteProgram(r->frame_programs[k]);
        glDeleteTextures(TEXTURE_COUNT, r->textures);
        glDeleteFramebuffers(1, &r->light_target);
        glDeleteFramebuffers(1, &r->frame_target);
        glDeleteVertexArrays(1, &r->vertices);
    }
    if (r->context)
        r->context->close(r->context);
    free(r);
}

const char *renderer_name(const struct renderer *r)
{
    return r->name;
}

// ---- stages: each does its work when its inputs change ----------------------

static bool same_lights(const struct scene *a, const struct scene *b)
{
    return a->lights == b->lights && a->lights_generation == b->lights_generation &&
           memcmp(&a->booth_from_screen, &b->booth_from_screen, sizeof a->booth_from_screen) == 0 &&
           memcmp(&a->screen, &b->screen, sizeof a->screen) == 0;
}

static bool same_places(const struct scene *a, const struct scene *b)
{
    return memcmp(&a->screen, &b->screen, sizeof a->screen) == 0 &&
           a->texels_width == b->texels_width && a->texels_height == b->texels_height &&
           a->texel_offset.x == b->texel_offset.x && a->texel_offset.y == b->texel_offset.y &&
           a->texel_scale_x == b->texel_scale_x && a->texel_scale_y == b->texel_scale_y;
}

static bool same_texels(const struct scene *a, const struct scene *b)
{
    return a->texels == b->texels && a->texels_generation == b->texels_generation &&
           a->texels_width == b->texels_width && a->texels_height == b->texels_height;
}

static bool same_display(const struct scene *a, const struct scene *b)
{
    return a->display == b->display && a->view == b->view &&
           a->display_generation == b->display_generation;
}

// Without a view the light of a pixel is the same in every direction.
static bool same_eye(const struct scene *a, const struct scene *b)
{
    return !a->view || (a->eye.x == b->eye.x && a->eye.y == b->eye.y && a->eye.z == b->eye.z);
}

static bool same_scene(const struct scene *a, const struct scene *b)
{
    if (a->kind != b->kind || a->bits != b->bits)
        return false;
    switch (a->kind) {
    case SCENE_DARK:
        return true;
    case SCENE_PATCH:
        return a->patch.r == b->patch.r && a->patch.g == b->patch.g && a->patch.b == b->patch.b;
    case SCENE_SURFACE:
        break;
    }
    return same_lights(a, b) && same_places(a, b) && same_texels(a, b) && same_display(a, b) &&
           same_eye(a, b) && a->level == b->level && a->dither == b->dither &&
           a->screen_reflectance == b->screen_reflectance && a->white.X == b->white.X &&
           a->white.Y == b->white.Y && a->white.Z == b->white.Z;
}

static void draw(GLuint program, GLuint target, int width, int height)
{
    glBindFramebuffer(GL_FRAMEBUFFER, target);
    glViewport(0, 0, width, height);
    glUseProgram(program);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static GLint at(GLuint program, const char *uniform)
{
    return glGetUniformLocation(program, uniform);
}

static int upload_lights(struct renderer *r, const struct scene *scene)
{
    struct rigid screen_from_booth = rigid_inverse(scene->booth_from_screen);
    int count = scene->lights ? scene->lights->count : 0;
    int rows = count / LIGHTS_A_ROW + 1;
    float(*packed)[4] = calloc((size_t)rows * LIGHTS_A_ROW, sizeof *packed);
    if (!packed)
        return -1;
    for (int i = 0; i < count; i++) {
        struct vec3 place = rigid_apply(screen_from_booth, scene->lights->points[i].at);
        packed[i][0] = (float)place.x;
        packed[i][1] = (float)place.y;
        packed[i][2] = (float)place.z;
        packed[i][3] = (float)scene->lights->points[i].intensity_cd;
    }
    upload(r, LIGHTS, GL_RGBA32F, LIGHTS_A_ROW, rows, GL_RGBA, GL_FLOAT, packed);
    free(packed);
    return count;
}

static bool light_stage(struct renderer *r, const struct scene *scene, struct error *err)
{
    if (r->seen_lights && same_lights(&r->seen, scene))
        return true;
    GLuint program = r->light_program;
    const struct screen *s = &scene->screen;
    struct mat3 turn = mat3_transpose(scene->booth_from_screen.rotation);
    struct vec3 down = mat3_apply(turn, (struct vec3){0, -1, 0});
    int count = upload_lights(r, scene);
    if (count < 0)
        return fail(err, ERROR_SYSTEM, "no memory for the light points");
    glUseProgram(program);
    glUniform1i(at(program, "light_count"), count);
    glUniform3f(at(program, "down"), (float)down.x, (float)down.y, (float)down.z);
    glUniform2f(at(program, "pixel_m"), (float)(s->width_m / s->width_px),
                (float)(s->height_m / s->height_px));
    glUniform2f(at(program, "corner_m"), (float)(-s->width_m / 2), (float)(-s->height_m / 2));
    draw(program, r->light_target, r->width, r->height);
    return true;
}

static bool place_stage(struct renderer *r, const struct scene *scene, struct error *err)
{
    if (r->seen_places && same_places(&r->seen, scene))
        return true;
    int longest = r->width > r->height ? r->width : r->height;
    int32_t *places = calloc(2 * (size_t)longest, sizeof *places);
    if (!places)
        return fail(err, ERROR_SYSTEM, "no memory for %d places", longest);
    for (int x = 0; x < r->width; x++)
        places[x] = scene_texel_column(scene, x);
    for (int y = 0; y < r->height; y++)
        places[longest + y] = scene_texel_row(scene, y);
    upload(r, PLACES, GL_R32I, longest, 2, GL_RED_INTEGER, GL_INT, places);
    free(places);
    return true;
}

static bool texel_stage(struct renderer *r, const struct scene *scene, struct error *err)
{
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    if (r->seen_texels && same_texels(&r->seen, scene))
        return true;
    if (scene->texels_width > most || scene->texels_height > most)
        return fail(err, ERROR_RANGE, "material of %d x %d texels: this OpenGL allows %d a side",
                    scene->texels_width, scene->texels_height, most);
    upload(r, TEXELS, GL_RGB32F, scene->texels_width, scene->texels_height, GL_RGB, GL_FLOAT,
           scene->texels);
    return true;
}

static bool display_stage(struct renderer *r, const struct scene *scene, struct error *err)
{
    if (r->seen_display && same_display(&r->seen, scene))
        return true;
    if (!choose_program(r, scene->display->kind, err))
        return false;
    if (scene->view)
        view_gl_upload(r->frame_program, scene->view, (struct texture){r->textures[VIEW], VIEW});
    return display_gl_upload(r->frame_program, scene->display,
                             (struct texture){r->textures[CURVES], CURVES},
                             (struct texture){r->textures[TABLE], TABLE}, err);
}

static void frame_stage(struct renderer *r, const struct scene *scene)
{
    GLuint program = r->frame_program;
    glUseProgram(program);
    glUniform1f(at(program, "level"), (float)scene->level);
    glUniform3f(at(program, "white"), (float)scene->white.X, (float)scene->white.Y,
                (float)scene->white.Z);
    glUniform1f(at(program, "screen_reflectance"), (float)scene->screen_reflectance);
    glUniform1f(at(program, "code_most"), (float)((1 << r->code_bits) - 1));
    glUniform1i(at(program, "dithered"), scene->dither);
    glUniform1i(at(program, "height"), r->height);
    view_gl_uniforms(program, scene);
    draw(program, r->frame_target, r->width, r->height);
    r->surface = true;
    r->outside = -1;
}

static bool draw_surface(struct renderer *r, const struct scene *scene, struct error *err)
{
    const struct screen *s = &scene->screen;
    if (s->width_px != r->width || s->height_px != r->height)
        return fail(err, ERROR_RANGE, "a scene of %d x %d pixels on a screen of %d x %d",
                    s->width_px, s->height_px, r->width, r->height);
    if (!scene->texels || !scene->display)
        return fail(err, ERROR_CONFIG, "no %s to show a surface with",
                    scene->texels ? "display model" : "material");
    bool good = light_stage(r, scene, err) && place_stage(r, scene, err) &&
                texel_stage(r, scene, err) && display_stage(r, scene, err);
    r->seen_lights = r->seen_places = r->seen_texels = r->seen_display = good;
    if (!good)
        return false;
    r->seen = *scene;
    frame_stage(r, scene);
    return true;
}

// Half a code goes up; what is not a number is black.
static float whole_code(double count, int most)
{
    double clamped = count > 0 ? count < 1 ? count : 1 : 0;
    return (float)(floor(clamped * most + 0.5) / most);
}

static void draw_uniform(struct renderer *r, struct counts patch)
{
    int most = (1 << r->code_bits) - 1;
    float rgba[4] = {whole_code(patch.r, most), whole_code(patch.g, most),
                     whole_code(patch.b, most), 1};
    glBindFramebuffer(GL_FRAMEBUFFER, r->frame_target);
    glClearBufferfv(GL_COLOR, 1, rgba);
}

static void present(struct renderer *r)
{
    if (r->context->window_bits > 0) {
        glBindFramebuffer(GL_READ_FRAMEBUFFER, r->frame_target);
        glReadBuffer(GL_COLOR_ATTACHMENT1);
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
        glBlitFramebuffer(0, 0, r->width, r->height, 0, 0, r->width, r->height, GL_COLOR_BUFFER_BIT,
                          GL_NEAREST);
    }
    r->context->present(r->context);
    glFinish();
}

static int bits_given(const struct renderer *r, int wanted)
{
    bool deep = wanted == 10 && (r->context->window_bits == 0 || r->context->window_bits >= 10);
    return deep ? 10 : 8;
}

struct renderer_output renderer_output(const struct renderer *r)
{
    return (struct renderer_output){bits_given(r, r->bits_wanted), r->context->ramp};
}

bool renderer_show(struct renderer *r, const struct scene *scene, bool force, bool *drawn,
                   struct error *err)
{
    bool again = force || !r->shown || !same_scene(&r->last, scene);
    if (drawn)
        *drawn = again;
    if (!again)
        return true;
    r->shown = false;
    if (!r->context->use(r->context, err) || !size_counts(r, bits_given(r, scene->bits), err))
        return false;
    switch (scene->kind) {
    case SCENE_DARK:
        draw_uniform(r, (struct counts){0, 0, 0});
        break;
    case SCENE_PATCH:
        draw_uniform(r, scene->patch);
        break;
    case SCENE_SURFACE:
        if (!draw_surface(r, scene, err))
            return false;
        break;
    }
    present(r);
    if (!no_error("drawing", err)) {
        r->seen_lights = r->seen_places = r->seen_texels = r->seen_display = false;
        return false;
    }
    r->last = *scene;
    r->shown = true;
    return true;
}

bool renderer_events(struct renderer *r, double timeout_s)
{
    bool open = r->context->events(r->context, timeout_s);
    if (open && r->context->damaged && r->shown && r->context->use(r->context, NULL))
        present(r);
    return open;
}

// ---- reading back ----------------------------------------------------------

static void flip_rows(void *pixels, size_t row_bytes, int rows)
{
    unsigned char *top = pixels, *bottom = top + row_bytes * (rows - 1);
    for (; top < bottom; top += row_bytes, bottom -= row_bytes)
        for (size_t i = 0; i < row_bytes; i++) {
            unsigned char kept = top[i];
            top[i] = bottom[i];
            bottom[i] = kept;
        }
}

static void *read_back(struct renderer *r, int place, GLenum format, GLenum type,
                       size_t pixel_bytes, struct error *err)
{
    size_t row_bytes = pixel_bytes * r->width;
    void *pixels = malloc(row_bytes * r->height);
    if (!pixels) {
        fail(err, ERROR_SYSTEM, "no memory for %d x %d pixels", r->width, r->height);
        return NULL;
    }
    if (!r->context->use(r->context, err)) {
        free(pixels);
        return NULL;
    }
    glBindFramebuffer(GL_READ_FRAMEBUFFER, r->frame_target);
    glReadBuffer(GL_COLOR_ATTACHMENT0 + place);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, r->width, r->height, format, type, pixels);
    if (!no_error("reading back", err)) {
        free(pixels);
        return NULL;
    }
    flip_rows(pixels, row_bytes, r->height);
    return pixels;
}

uint8_t *renderer_counts(struct renderer *r, struct error *err)
{
    if (!r->shown) {
        fail(err, ERROR_RETRY, "no frame has been shown");
        return NULL;
    }
    return read_back(r, 1, GL_RGB, GL_UNSIGNED_BYTE, 3, err);
}

float *renderer_xyz(struct renderer *r, struct error *err)
{
    if (!r->surface) {
        fail(err, ERROR_RETRY, "no surface has been shown");
        return NULL;
    }
    return read_back(r, 0, GL_RGB, GL_FLOAT, 3 * sizeof(float), err);
}

double renderer_out_of_gamut(struct renderer *r)
{
    if (!r->surface)
        return 0;
    if (r->outside >= 0)
        return r->outside;
    float(*pixels)[4] = read_back(r, 0, GL_RGBA, GL_FLOAT, sizeof *pixels, NULL);
    if (!pixels)
        return 0;
    size_t count = (size_t)r->width * r->height, outside = 0;
    for (size_t i = 0; i < count; i++)
        outside += pixels[i][3] > 0.5f;
    free(pixels);
    r->outside = (double)outside / count;
    return r->outside;
}
