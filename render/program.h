// SPDX-License-Identifier: Apache-2.0
// GL programs from the embedded shader files. Inside render/ only; a GL
// context must be current.
#ifndef RENDER_PROGRAM_H
#define RENDER_PROGRAM_H

#include "colorimetry/display.h"

// frame.vert.glsl with the formula files and one fragment shader, by its file
// name, for one kind of display model (DISPLAY_KIND of inverse.glsl). 0 with err
// (SYSTEM) that quotes the compiler's first lines.
unsigned program_make(const char *fragment, enum display_kind kind, struct error *err);

#endif
