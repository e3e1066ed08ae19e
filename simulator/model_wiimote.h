// SPDX-License-Identifier: Apache-2.0
// A Wii remote (RVL-CNT-01) of which only the infrared camera matters: it lies
// fixed in the booth and looks at the observer. See wires.md.
#ifndef SIMULATOR_MODEL_WIIMOTE_H
#define SIMULATOR_MODEL_WIIMOTE_H

#include "simulator/around.h"
#include "simulator/hid_model.h"

#define WIIMOTE_FOCAL_PX 1334.0 // 1024 px over 42 degrees

struct wiimote_options {
    struct around around;
    const char *serial;
    uint64_t seed;
    double pitch_deg; // of the camera's axis above the horizon, for its accelerometer
};

struct wiimote;

// NULL when out of memory.
struct wiimote *wiimote_create(const struct wiimote_options *options);
void wiimote_destroy(struct wiimote *device);

// The remote connects anew: no report mode set, the camera off.
void wiimote_connect(struct wiimote *device);

struct hid_model wiimote_model(struct wiimote *device);

// What happens to a real one whose battery slips or whose extension is
// touched: the camera goes blind, reporting ends, a status report comes unasked.
void wiimote_upset(struct wiimote *device);

#endif
