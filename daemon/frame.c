// SPDX-License-Identifier: Apache-2.0
#include "daemon/frame.h"

#include <math.h>

#include "base/clock.h"

// An eighth of the least visible step of luminance, and of an 8-bit code.
static const double LEVEL_SEEN = 5e-4;
// At 45 degrees the light on the screen changes by 0.03 % over it.
static const double TILT_SEEN_DEG = 0.02;

// A display whose light falls by half at 40 degrees changes by 0.1 % over it.
static const double EYE_SEEN_M = 5e-4;

static const int64_t TRY_AGAIN_NS = NS_PER_S;

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
    bool eye = vec3_length(vec3_sub(now->eye.at, shown->eye.at)) > EYE_SEEN_M;
    if (!lamp && !level && !tilt && !eye)
        out.eye.at = shown->eye.at;
    return out;
}

static void draw_black(struct booth *b)
{
    struct scene dark = {.kind = SCENE_DARK, .bits = booth_bits(&b->setup->settings)};
    bool drawn;
    b->scene = dark;
    b->out_of_gamut = 0;
    b->blind = !renderer_show(b->renderer, &dark, false, &drawn, NULL);
    b->frames += !b->blind && drawn;
}

static bool draw(struct booth *b, const struct state *visible, bool force, struct error *err)
{
    struct scene scene;
    bool drawn;
    if (!setup_scene(b->setup, visible, &scene, err) ||
        !renderer_show(b->renderer, &scene, force, &drawn, err)) // XYZ and counts on the GPU
        return false;
    b->scene = scene;
    b->blind = false;
    b->frames += drawn;
    if (drawn)
        b->out_of_gamut = scene.kind == SCENE_SURFACE ? renderer_out_of_gamut(b->renderer) : 0;
    return true;
}

static bool failed(const struct booth *b, struct error *err)
{
    return fail(err, b->failure.code, "%s", b->failure.text);
}

bool frame(struct booth *b, int64_t now_ns, bool force, struct error *err)
{
    acquire_latest(b->instruments, &b->seen);
    b->state = estimate(&b->estimator, &b->seen, now_ns);
    struct state visible = still(&b->shown, &b->state);
    bool other_lamp = visible.lamp.index != b->shown.lamp.index;
    if (b->failure.code && !force && !other_lamp && now_ns < b->again_ns)
        return failed(b, err);
    b->failure = (struct error){0};
    b->shown = visible;
    if (draw(b, &visible, force, &b->failure))
        return true;
    b->again_ns = now_ns + TRY_AGAIN_NS;
    draw_black(b);
    return failed(b, err);
}
