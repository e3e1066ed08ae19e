// SPDX-License-Identifier: Apache-2.0
// What a person or program sees of the daemon: plain facts copied by the main
// thread after every frame, made into JSON by the control thread.
#ifndef DAEMON_STATUS_H
#define DAEMON_STATUS_H

#include <jansson.h>

#include "daemon/desk.h"
#include "daemon/frame.h"

enum { WARNINGS_MOST = 16 };

struct snapshot {
    struct booth_settings settings;
    struct state state;
    uint64_t tilt_number, head_number; // of the samples beside: 0 = none yet
    struct tilt_sample tilt;
    struct head_sample head;
    char lamp_name[64]; // of the lamp proofed under, "" = none
    int lamps;          // taught
    enum scene_kind scene;
    enum show_kind show;
    char material[512], patch[64]; // "" = none
    struct counts counts;          // of a patch of counts
    struct error failure;          // of what should be shown; code NONE while it is
    bool matches;                  // what is shown is what is believed
    struct renderer_output output;
    char renderer[128];
    double out_of_gamut; // share of the screen, 0..1
    uint64_t frames;
    bool has_display;
    char display[128];
    double condition;
    struct booth_calibration calibration;
    bool expired;         // it is past its time
    struct error refused; // of a calibration; code NONE while the store's own is in force
    char warnings[WARNINGS_MOST][200]; // "" ends them
};

// Copies the facts of now. Main thread.
void snapshot_take(struct booth *booth, struct snapshot *out);

// One line for the service manager, such as "D65, tilt 30.0 degrees,
// colorchecker24 on screen".
void snapshot_line(const struct snapshot *s, char *text, size_t size);

// Every instrument's report, in the order of INSTRUMENTS.
struct instruments_report {
    struct instrument_report of[INSTRUMENT_COUNT];
};

// The whole status reply; see boothctl(1). now_ns ages the instruments.
json_t *status_json(const struct snapshot *s, const struct instruments_report *instruments,
                    const char *since, int64_t now_ns);

// What is on the screen, under which lamp and tilt: goes with every reading.
json_t *status_shown(const struct snapshot *s);

#endif
