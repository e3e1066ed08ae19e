// SPDX-License-Identifier: Apache-2.0
// The emulated booth as it is at any moment: a function of its scenario, of
// what happened until then, and of time. It senses for the instruments
// (simulator/around.h) and knows the truth that they are measured against.
#ifndef SIMULATOR_WORLD_H
#define SIMULATOR_WORLD_H

#include "colorimetry/colour.h"
#include "simulator/around.h"
#include "simulator/lamps.h"
#include "simulator/panel.h"
#include "simulator/scenario_script.h"

struct world;

// Takes the scenario (copied) at start_ns, CLOCK_MONOTONIC. NULL with err.
struct world *world_create(const struct scenario *scenario, int64_t start_ns, struct error *err);

// Accepts NULL.
void world_destroy(struct world *world);

// Where the panel takes its pixels from: input codes 0..1 of (x, y), which
// lies inside the screen. Without one the panel is driven black. Call before
// anything measures.
typedef void world_pixels(void *context, int x, int y, double code[3]);
void world_set_pixels(struct world *world, world_pixels *pixels, void *context);

// World seconds since the start.
double world_seconds(const struct world *world, int64_t at_ns);

// Adds an event at its own time, from a script, or now (at_s is set). Any thread.
bool world_add(struct world *world, const struct event *event, struct error *err);
bool world_add_now(struct world *world, int64_t now_ns, struct event event, struct error *err);

// Calls back, in order, for every FAULT event later than the last such call
// and not later than now_ns. One thread.
typedef void world_fault(void *context, int instrument, int fault);
void world_faults_due(struct world *world, int64_t now_ns, world_fault *fault, void *context);

// The instruments' senses, for wire_start. The world must outlive the wire.
struct around world_around(struct world *world);

// What is so at a moment. Any thread.
struct world_state {
    double at_s;
    double level[SCENARIO_LAMPS_MOST]; // as switched, without warm-up; 0 = off
    double on_s[SCENARIO_LAMPS_MOST];  // since switched on
    double tilt_deg;
    struct vec3 eye;
    struct aim aim;
};
void world_state_at(struct world *world, int64_t at_ns, struct world_state *out);

// Light of a lamp at a moment over that at level 1, warm; 0 where there is none.
double world_output(struct world *world, int64_t at_ns, int lamp);

// Spectral irradiance (W m-2 nm-1) at a moment on the plane of the screen
// about a pixel, averaged over the radiometer's spot: 1 nm, dense over the
// true ceiling. What a radiometer sees of a matt sample there is R E / pi.
void world_truth(struct world *world, int64_t at_ns, double x_px, double y_px,
                 struct spectrum *irradiance);

const struct scenario *world_scenario(const struct world *world);
const struct panel *world_panel(const struct world *world);

// By index, NULL where there is none.
const struct lamp *world_lamp(const struct world *world, int index);

#endif
