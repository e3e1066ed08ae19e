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
    struct samples seen;  // what the instruments said last
    struct state state;   // believed now
    struct state shown;   // of the last frame drawn
    struct scene scene;   // of the last frame, pointers into setup
    uint64_t frames;      // drawn since the start
    double out_of_gamut;  // share of the last frame drawn, 0..1
    struct error failure; // why what should be shown is not; code NONE while it is
    int64_t again_ns;     // when that is tried again
    bool blind;           // not even black could be drawn
};

// One frame: asks the instruments' mailboxes, estimates, and draws when
// something changed that can be seen, or when forced. What cannot be shown
// leaves the screen black, for the last frame would be a wrong proof; the
// failure is kept, and the same is tried again after a second or when forced.
bool frame(struct booth *booth, int64_t now_ns, bool force, struct error *err);

// What of `now` differs visibly from `shown`: another lamp, its level by more
// than 0.05 %, the tilt by more than 0.02 degrees. The rest stays as shown, so
// that noise draws nothing. The eye alone draws nothing while all materials
// are matt; it comes along with the other changes.
struct state still(const struct state *shown, const struct state *now);

#endif
