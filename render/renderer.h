// SPDX-License-Identifier: Apache-2.0
// From scene to light: an OpenGL 3.3 core renderer on a GLFW window, or on
// EGL without any display. One thread (the main thread).
#ifndef RENDER_RENDERER_H
#define RENDER_RENDERER_H

#include "render/scene.h"

struct renderer;

struct renderer_options {
    bool window;       // a GLFW window; else EGL surfaceless
    bool fullscreen;   // on the monitor named below, else a plain undecorated window at 0, 0
    char monitor[128]; // name of the monitor, "" = the first
    int width, height; // of the window or of the off-screen image
    int bits;          // 10 asks for a window of 10 bits a channel; else 8
};

// NULL with err (SYSTEM) when no context of OpenGL 3.3 can be had. One window
// at a time in a process; any number on EGL.
struct renderer *renderer_create(const struct renderer_options *options, struct error *err);
void renderer_destroy(struct renderer *renderer); // accepts NULL

// What a monitor's gamma ramp makes of the counts.
enum display_ramp {
    RAMP_NONE,    // off screen: no monitor, no ramp
    RAMP_UNKNOWN, // a plain window's, or the driver does not say
    RAMP_NEUTRAL, // straight
    RAMP_BENT,    // it could not be made straight: colours are wrong
};

// The way from counts to the panel.
struct renderer_output {
    int bits; // per channel, of what is shown: 8 or 10, at most what was asked for
    enum display_ramp ramp;
};

struct renderer_output renderer_output(const struct renderer *renderer);

// GL_RENDERER, and for a fullscreen monitor whether its gamma ramp could be
// made neutral.
const char *renderer_name(const struct renderer *renderer);

// Draws the scene and presents it; when it returns true the frame has been
// handed to the display (glFinish done, and answered by the X server). A scene
// equal to the last one is not drawn again unless forced. *drawn may be NULL.
// The screen of a SURFACE scene must have the renderer's size (else RANGE).
// Codes have scene.bits, or fewer where the window has fewer. A value that is
// not finite is shown as 0.
bool renderer_show(struct renderer *renderer, const struct scene *scene, bool force, bool *drawn,
                   struct error *err);

// Handles window events, waiting up to timeout_s for one; false when the user
// closed the window. True and at once on EGL.
bool renderer_events(struct renderer *renderer, double timeout_s);

// The last frame: 8-bit counts, [height][width][3], row 0 on top, malloc'd.
uint8_t *renderer_counts(struct renderer *renderer, struct error *err);

// The last SURFACE frame before the display model: XYZ in cd/m2 of `emitted`,
// [height][width][3], row 0 on top, malloc'd.
float *renderer_xyz(struct renderer *renderer, struct error *err);

// Share of pixels of the last SURFACE frame out of the display's gamut, 0..1.
double renderer_out_of_gamut(struct renderer *renderer);

#endif
