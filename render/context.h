// SPDX-License-Identifier: Apache-2.0
// Where OpenGL draws: a window or nothing at all. Between gl.c and its two
// back ends only.
#ifndef RENDER_CONTEXT_H
#define RENDER_CONTEXT_H

#include "render/renderer.h"

// First member of each back end's own struct.
struct context {
    int window_bits; // per channel of what is presented; 0 without a window
    enum display_ramp ramp;
    char note[160]; // what to say of the display besides the renderer's name, or ""
    bool damaged;   // the window lost its picture since the last present
    // Makes the context current on this thread.
    bool (*use)(struct context *context, struct error *err);
    // Shows the back buffer and returns when the display has it.
    void (*present)(struct context *context);
    bool (*events)(struct context *context, double timeout_s);
    void (*close)(struct context *context);
};

// Both leave the context current. NULL with err (SYSTEM, or CONFIG for a
// monitor that is not there). One window at a time in a process.
struct context *window_open(const struct renderer_options *options, struct error *err);
struct context *headless_open(struct error *err);

#endif
