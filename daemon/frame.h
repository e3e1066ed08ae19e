// SPDX-License-Identifier: Apache-2.0
// The story in call order: samples, state, scene, light. Main thread.
#ifndef DAEMON_FRAME_H
#define DAEMON_FRAME_H

#include "daemon/acquire.h"
#include "daemon/setup.h"
#include "render/renderer.h"

struct booth {
    struct acquire *instruments; // borrowed, all three
    struct setup *setup;
    struct renderer *renderer;
    struct estimator estimator;
    struct state state;  // believed now
    struct state shown;  // of the last frame drawn
    struct scene scene;  // of the last frame, pointers into setup
    uint64_t frames;     // drawn since the start
    double out_of_gamut; // share of the last frame drawn, 0..1
};

// One frame: asks the instruments' mailboxes, estimates, and draws when
// something changed that can be seen, or when forced. On failure the screen
// keeps the last frame.
bool frame(struct booth *booth, int64_t now_ns, bool force, struct error *err);

// What of `now` differs visibly from `shown`: another lamp, its level by more
// than 0.05 %, the tilt by more than 0.02 degrees. The rest stays as shown, so
// that noise draws nothing. The eye alone draws nothing while all materials
// are matt; it comes along with the other changes.
struct state still(const struct state *shown, const struct state *now);

#endif
