// SPDX-License-Identifier: Apache-2.0
// What happens in the booth and when: the lines of a script, or what came over
// the control socket.
//
// A script line is "AT_SECONDS WHAT ...", in world seconds from the start; '#'
// begins a comment. What there is:
//   lamp NAME|none [LEVEL]         switches to this lamp alone
//   add NAME LEVEL                 sets one lamp and leaves the others as they are
//   tilt DEG [over SECONDS]
//   head X Y Z [over SECONDS]      midpoint of the eyes, m, booth frame
//   aim screen X_PX Y_PX [from X Y Z]
//   aim ceiling X_M Z_M
//   fault INSTRUMENT KIND          names of simulator/wire.h
#ifndef SIMULATOR_SCENARIO_SCRIPT_H
#define SIMULATOR_SCENARIO_SCRIPT_H

#include "base/linear.h"
#include "simulator/scenario.h"

enum event_kind { EVENT_LAMP, EVENT_ADD, EVENT_TILT, EVENT_HEAD, EVENT_AIM, EVENT_FAULT };

enum aim_target { AIM_SCREEN, AIM_CEILING };

// Where the radiometer looks.
struct aim {
    enum aim_target target;
    double x, y;        // screen: px; ceiling: x and z in m
    bool from_given;    // screen: seen from a place, else along the normal
    struct vec3 from_m; // booth frame
};

struct event {
    double at_s; // world seconds from the start, >= 0
    enum event_kind kind;
    double over_s;         // TILT, HEAD: how long the movement takes, 0 = at once
    int lamp;              // LAMP, ADD: index, -1 = none
    double level;          // LAMP, ADD: 0..1.2
    double tilt_deg;       // TILT: -90..180
    struct vec3 eye_m;     // HEAD
    struct aim aim;        // AIM
    int instrument, fault; // FAULT: enum wire_instrument, enum wire_fault
};

// Each fills an event but its time, and refuses (RANGE, CONFIG) what the
// booth does not have.
bool event_lamp(const struct scenario *scenario, const char *name, double level, bool add,
                struct event *out, struct error *err);
bool event_tilt(double tilt_deg, double over_s, struct event *out, struct error *err);
bool event_head(struct vec3 eye_m, double over_s, struct event *out, struct error *err);
bool event_aim(const struct scenario *scenario, const struct aim *aim, struct event *out,
               struct error *err);
bool event_fault(const char *instrument, const char *kind, struct event *out, struct error *err);

// Reads a script: *events malloc'd, in order of time (equal times in order of
// lines). Errors (CONFIG) name file and line.
bool script_load(const char *path, const struct scenario *scenario, struct event **events,
                 int *count, struct error *err);

#endif
