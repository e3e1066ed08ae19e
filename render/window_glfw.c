// SPDX-License-Identifier: Apache-2.0
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/context.h"

enum { RAMP_MOST = 4096 };

struct window {
    struct context face;
    GLFWwindow *window;
    GLFWmonitor *monitor; // whose gamma ramp was changed, or NULL
    unsigned ramp_size;
    unsigned short old_ramp[3][RAMP_MOST];
};

static bool fail_glfw(struct error *err, const char *what)
{
    const char *text = NULL;
    glfwGetError(&text);
    return fail(err, ERROR_SYSTEM, "window: %s: %s", what, text ? text : "no reason given");
}

static bool window_use(struct context *context, struct error *err)
{
    struct window *w = (struct window *)context;
    glfwMakeContextCurrent(w->window);
    return glfwGetCurrentContext() == w->window || fail_glfw(err, "make current");
}

// Asking where the pointer is makes the X server answer, which it does only
// after it has drawn the picture sent before.
static void window_present(struct context *context)
{
    struct window *w = (struct window *)context;
    double x, y;
    glfwSwapBuffers(w->window);
    glFinish();
    glfwGetCursorPos(w->window, &x, &y);
    context->damaged = false;
}

static bool window_events(struct context *context, double timeout_s)
{
    struct window *w = (struct window *)context;
    if (timeout_s > 0)
        glfwWaitEventsTimeout(timeout_s);
    else
        glfwPollEvents();
    return !glfwWindowShouldClose(w->window);
}

static bool still_connected(const GLFWmonitor *monitor)
{
    int count = 0;
    GLFWmonitor **monitors = glfwGetMonitors(&count);
    for (int i = 0; i < count; i++)
        if (monitors[i] == monitor)
            return true;
    return false;
}

// GLFW itself stays for the life of the process, as EGL's display does: what
// the X driver never frees would otherwise lose its owner.
static void window_close(struct context *context)
{
    struct window *w = (struct window *)context;
    if (w->monitor && still_connected(w->monitor)) {
        GLFWgammaramp old = {w->old_ramp[0], w->old_ramp[1], w->old_ramp[2], w->ramp_size};
        glfwSetGammaRamp(w->monitor, &old);
    }
    if (w->window)
        glfwDestroyWindow(w->window);
    free(w);
}

static void on_damage(GLFWwindow *window)
{
    struct window *w = glfwGetWindowUserPointer(window);
    w->face.damaged = true;
}

static GLFWmonitor *find_monitor(const char *name, struct error *err)
{
    int count = 0;
    GLFWmonitor **monitors = glfwGetMonitors(&count);
    char seen[256] = "";
    for (int i = 0; i < count; i++) {
        const char *here = glfwGetMonitorName(monitors[i]);
        if (!name[0] || strcmp(here, name) == 0)
            return monitors[i];
        size_t used = strlen(seen);
        snprintf(seen + used, sizeof seen - used, "%s\"%s\"", i > 0 ? ", " : "", here);
    }
    fail(err, ERROR_CONFIG, "monitor \"%s\" is not connected; there is %s", name,
         count > 0 ? seen : "none");
    return NULL;
}

static bool is_neutral(const GLFWgammaramp *ramp)
{
    for (unsigned i = 0; i < ramp->size; i++) {
        int wanted = (int)(65535.0 * i / (ramp->size - 1) + 0.5);
        int most = 256; // drivers keep as few as eight bits of a ramp
        if (abs(ramp->red[i] - wanted) > most || abs(ramp->green[i] - wanted) > most ||
            abs(ramp->blue[i] - wanted) > most)
            return false;
    }
    return true;
}

static void keep_ramp(struct window *w, GLFWmonitor *monitor, const GLFWgammaramp *ramp)
{
    w->monitor = monitor;
    w->ramp_size = ramp->size;
    memcpy(w->old_ramp[0], ramp->red, ramp->size * sizeof *ramp->red);
    memcpy(w->old_ramp[1], ramp->green, ramp->size * sizeof *ramp->green);
    memcpy(w->old_ramp[2], ramp->blue, ramp->size * sizeof *ramp->blue);
}

// Sets a straight ramp and reads back what the driver made of it.
static enum display_ramp straighten_ramp(struct window *w, GLFWmonitor *monitor)
{
    unsigned short straight[RAMP_MOST];
    const GLFWgammaramp *old = glfwGetGammaRamp(monitor);
    if (!old || old->size < 2 || old->size > RAMP_MOST)
        return RAMP_UNKNOWN;
    keep_ramp(w, monitor, old);
    GLFWgammaramp ramp = {straight, straight, straight, old->size};
    for (unsigned i = 0; i < ramp.size; i++)
        straight[i] = (unsigned short)(65535.0 * i / (ramp.size - 1) + 0.5);
    glfwSetGammaRamp(monitor, &ramp);
    const GLFWgammaramp *now = glfwGetGammaRamp(monitor);
    bool neutral = now && now->size == ramp.size && is_neutral(now);
    return neutral ? RAMP_NEUTRAL : RAMP_BENT;
}

static const char *ramp_note(enum display_ramp ramp)
{
    switch (ramp) {
    case RAMP_NONE:
        return "";
    case RAMP_UNKNOWN:
        return "gamma ramp unknown";
    case RAMP_NEUTRAL:
        return "gamma ramp neutral";
    case RAMP_BENT:
        return "gamma ramp NOT neutral";
    }
    return "";
}

static void hint(int bits)
{
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_DECORATED, GLFW_FALSE);
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);
    glfwWindowHint(GLFW_FOCUS_ON_SHOW, GLFW_FALSE);
    glfwWindowHint(GLFW_SRGB_CAPABLE, GLFW_FALSE);
    glfwWindowHint(GLFW_RED_BITS, bits);
    glfwWindowHint(GLFW_GREEN_BITS, bits);
    glfwWindowHint(GLFW_BLUE_BITS, bits);
    glfwWindowHint(GLFW_ALPHA_BITS, 0);
    glfwWindowHint(GLFW_DEPTH_BITS, 0);
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
}

static int bits_granted(void)
{
    GLint bits = 0;
    glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, GL_BACK_LEFT,
                                          GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE, &bits);
    return bits;
}

static bool start(struct window *w, const struct renderer_options *options, struct error *err)
{
    GLFWmonitor *monitor = NULL;
    int width = 0, height = 0;
    if (!glfwInit())
        return fail_glfw(err, "GLFW");
    if (options->fullscreen && !(monitor = find_monitor(options->monitor, err)))
        return false;
    hint(options->bits == 10 ? 10 : 8);
    w->window = glfwCreateWindow(options->width, options->height, "boothd", monitor, NULL);
    if (!w->window)
        return fail_glfw(err, "OpenGL 3.3");
    glfwSetWindowUserPointer(w->window, w);
    glfwSetWindowRefreshCallback(w->window, on_damage);
    glfwSetInputMode(w->window, GLFW_CURSOR, GLFW_CURSOR_HIDDEN);
    w->face.ramp = monitor ? straighten_ramp(w, monitor) : RAMP_UNKNOWN;
    if (monitor)
        snprintf(w->face.note, sizeof w->face.note, "%s", ramp_note(w->face.ramp));
    else
        glfwSetWindowPos(w->window, 0, 0);
    glfwGetFramebufferSize(w->window, &width, &height);
    if (width != options->width || height != options->height)
        return fail(err, ERROR_CONFIG, "window: %d x %d pixels, but the settings say %d x %d",
                    width, height, options->width, options->height);
    if (!window_use(&w->face, err))
        return false;
    glfwSwapInterval(1);
    w->face.window_bits = bits_granted();
    return w->face.window_bits >= 8 ||
           fail(err, ERROR_SYSTEM, "window: %d bits a channel; at least 8 are needed",
                w->face.window_bits);
}

struct context *window_open(const struct renderer_options *options, struct error *err)
{
    struct window *w = calloc(1, sizeof *w);
    if (!w) {
        fail(err, ERROR_SYSTEM, "no memory for a window");
        return NULL;
    }
    w->face.use = window_use;
    w->face.present = window_present;
    w->face.events = window_events;
    w->face.close = window_close;
    if (!start(w, options, err)) {
        window_close(&w->face);
        return NULL;
    }
    return &w->face;
}
