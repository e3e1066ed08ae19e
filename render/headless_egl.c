// SPDX-License-Identifier: Apache-2.0
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdlib.h>

#include "render/context.h"

struct headless {
    struct context face;
    EGLDisplay display;
    EGLContext context;
};

static bool headless_use(struct context *context, struct error *err)
{
    struct headless *h = (struct headless *)context;
    if (!eglMakeCurrent(h->display, EGL_NO_SURFACE, EGL_NO_SURFACE, h->context))
        return fail(err, ERROR_SYSTEM, "EGL: eglMakeCurrent: error 0x%x", (unsigned)eglGetError());
    return true;
}

static void headless_present(struct context *context)
{
    (void)context;
}

static bool headless_events(struct context *context, double timeout_s)
{
    (void)context;
    (void)timeout_s;
    return true;
}

// The display belongs to the process, not to this context: never terminated.
static void headless_close(struct context *context)
{
    struct headless *h = (struct headless *)context;
    if (h->context != EGL_NO_CONTEXT) {
        eglMakeCurrent(h->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        eglDestroyContext(h->display, h->context);
    }
    free(h);
}

static bool start(struct headless *h, struct error *err)
{
    static const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0,
                                    EGL_NONE};
    static const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,
                                     3,
                                     EGL_CONTEXT_MINOR_VERSION,
                                     3,
                                     EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                     EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                     EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
        return fail(err, ERROR_SYSTEM, "EGL: no EGL_MESA_platform_surfaceless");
    h->display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (h->display == EGL_NO_DISPLAY || !eglInitialize(h->display, NULL, NULL))
        return fail(err, ERROR_SYSTEM, "EGL: no display: error 0x%x", (unsigned)eglGetError());
    if (!eglBindAPI(EGL_OPENGL_API) || !eglChooseConfig(h->display, wanted, &config, 1, &count) ||
        count < 1)
        return fail(err, ERROR_SYSTEM, "EGL: no configuration for OpenGL");
    h->context = eglCreateContext(h->display, config, EGL_NO_CONTEXT, version);
    if (h->context == EGL_NO_CONTEXT)
        return fail(err, ERROR_SYSTEM, "EGL: no OpenGL 3.3 core context: error 0x%x",
                    (unsigned)eglGetError());
    return headless_use(&h->face, err);
}

struct context *headless_open(struct error *err)
{
    struct headless *h = calloc(1, sizeof *h);
    if (!h) {
        fail(err, ERROR_SYSTEM, "no memory for an EGL context");
        return NULL;
    }
    h->context = EGL_NO_CONTEXT;
    h->face.use = headless_use;
    h->face.present = headless_present;
    h->face.events = headless_events;
    h->face.close = headless_close;
    if (!start(h, err)) {
        headless_close(&h->face);
        return NULL;
    }
    return &h->face;
}
