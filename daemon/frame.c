// SPDX-License-Identifier: Apache-2.0
#include "daemon/frame.h"

#include <math.h>

// An eighth of the least visible step of luminance, and of an 8-bit code.
static const double LEVEL_SEEN = 5e-4;
// At 45 degrees the light on the screen changes by 0.03 % over it.
static const double TILT_SEEN_DEG = 0.02;

struct state still(const struct state *shown, const struct state *now)
{
    struct state out = *now;
    bool lamp = now->lamp.index != shown->lamp.index;
    bool level = fabs(now->lamp.level - shown->lamp.level) > LEVEL_SEEN * shown->lamp.level;
    bool tilt = fabs(now->tilt.deg - shown->tilt.deg) > TILT_SEEN_DEG;
    if (!lamp && !level)
        out.lamp.level = shown->lamp.level;
    if (!tilt)
        out.tilt.deg = shown->tilt.deg;
    if (!lamp && !level && !tilt)
        out.eye.at = shown->eye.at;
    return out;
}

bool frame(struct booth *b, int64_t now_ns, bool force, struct error *err)
{
    struct samples seen;
    struct scene scene;
    bool drawn;
    acquire_latest(b->instruments, &seen);
    b->state = estimate(&b->estimator, &seen, now_ns);
    struct state visible = still(&b->shown, &b->state);
    if (!setup_scene(b->setup, &visible, &scene, err) ||
        !renderer_show(b->renderer, &scene, force, &drawn, err)) // XYZ and counts on the GPU
        return false;
    b->scene = scene;
    b->shown = visible;
    b->frames += drawn;
    if (drawn)
        b->out_of_gamut = scene.kind == SCENE_SURFACE ? renderer_out_of_gamut(b->renderer) : 0;
    return true;
}
