// SPDX-License-Identifier: Apache-2.0
// A session from bare settings to an accuracy report, step by step. Each step
// takes the bench and fills its part of the facts.
#ifndef CALIBRATION_SESSION_H
#define CALIBRATION_SESSION_H

#include "calibration/bench.h"
#include "calibration/facts.h"
#include "config/booth.h"
#include "config/store.h"
#include "render/material.h"

struct session {
    struct bench bench;
    struct booth_settings settings; // boothd's own
    struct session_facts *facts;
    char out[400];         // folder of the results, absolute
    char maps[400];        // folder of luminance maps "ceiling-<lamp>.exr", absolute
    char photographs[400]; // folder of what is photographed for them, absolute; "" = they are there
    const char *material;  // chart to proof
    bool rehearse;         // few patches only: shows that the chain works
    double lamp_drift;     // relative change per minute of a lamp that stands still, 0 = the plan's
    bool stored;           // the settings name a store of calibrations
    struct store_place store;
};

// Path of the luminance map of lamp i.
void session_map(const struct session *s, int lamp, char *path, size_t size);

// Where the settings name a store, makes sure that it can take a new version, and
// lets lamps and display model go to the results' folder where the settings name
// no place of their own for them.
bool session_store_begin(struct session *s, struct error *err);

// What a version of the store is made after.
enum session_stage { STAGE_TAUGHT, STAGE_CHARACTERISED, STAGE_REPORTED };

// Makes what the session has so far a new version of the store, if there is one,
// and puts it in force. It is valid anew from the second stage on.
bool session_store(struct session *s, enum session_stage stage, struct error *err);

// Teaches lamp i from live readings, makes its luminance map of an exposure series
// where s->photographs says so, scales its luminance map by spot readings
// and writes what was taught (not the map itself) into boothd's lamp folder.
bool session_teach(struct session *s, int lamp, struct error *err);

// In the dark booth: measures ramps, greys and random patches in random order
// with white repeated, writes display.ti3 and verify.ti3, fits the display
// model, saves it where boothd loads it, checks it on the patches kept apart.
bool session_characterise(struct session *s, struct error *err);

// Where the settings name a [display] view: reads the display from other
// directions and at other places, fits, and saves it where boothd loads it.
bool session_view(struct session *s, struct error *err);

// Where the head is at rest: the settings' default eye, booth frame.
struct vec3 session_eye(const struct session *s);

// Aims the radiometer at the screen's centre: from the eye when the display's
// light by direction is known, else along the normal.
bool session_aim(struct session *s, struct vec3 eye, struct error *err);

// Notes where everything stands, as the daemon believes it, and what the chart
// is made of.
bool session_place(struct session *s, const struct material *chart, struct error *err);

// Shows each patch of the chart at the screen's centre, under the light that is
// on and is taken for lamp i, measures it and its reference, and captures the
// whole chart as PNG where the session has a folder for results.
bool session_chart(struct session *s, int lamp, struct error *err);

// Switches to lamp i, waits until the daemon knows it, and shows the chart.
bool session_proof(struct session *s, int lamp, struct error *err);

// Tilts the screen and moves the head under the last lamp; white again, and
// where directions count also from 0, 15 and 25 degrees off the normal.
bool session_poses(struct session *s, struct error *err);

#endif
