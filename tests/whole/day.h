// SPDX-License-Identifier: Apache-2.0
// A day of booth life in one process on an injected clock: what test_day.c and
// the fakes below the drivers share.
//
// Each instrument lives on a lane with a clock of its own, as it has a thread
// of its own in boothd: a driver that waits lets its lane's time pass and no
// other's. test_day.c always lets the lane go on that is furthest behind.
// base/clock.h and base/log.h are answered by day_clock.c for the present lane.
#ifndef TESTS_WHOLE_DAY_H
#define TESTS_WHOLE_DAY_H

#include <stdbool.h>
#include <stdint.h>

#include "simulator/around.h"
#include "simulator/wire.h"
#include "simulator/world.h"

// What happens to an instrument: an enum wire_fault, or one of these.
#define DAY_FAULTS(X)                                                                              \
    X(BUSY, "busy")              /* it blinks, and another program is faster to hold it */         \
    X(IO_ERROR, "i/o error")     /* the bus fails, the device stays */                             \
    X(LAMP, "lamp")              /* no fault: the light changes */                                 \
    X(TILT, "tilt")              /* no fault: the screen is turned */                              \
    X(HEAD, "head")              /* no fault: the head moves */                                    \
    X(AWAY, "away")              /* the head is out of the camera's sight */                       \
    X(AWAY_UPSET, "away, upset") /* and meanwhile the camera loses its settings */                 \
    X(SHAKEN, "shaken")          /* the screen is knocked about: gravity is not itself, ... */     \
    X(DOUBTFUL, "doubtful")      /* ... and that for so long that it is told */                    \
    X(NAN, "not a number")       /* poses that are no numbers ... */                               \
    X(FAR, "far")                /* ... are out of range ... */                                    \
    X(LONG, "long")              /* ... are a byte too long ... */                                 \
    X(STALE, "stale")            /* ... lay about for a second */

enum day_fault {
    DAY_FAULTS_BEGIN = 99,
#define X(name, text) DAY_##name,
    DAY_FAULTS(X)
#undef X
};

const char *day_fault_name(int fault);

// The plan of a lane, in order of time; the last one never comes (INT64_MAX).
struct happening {
    int64_t at_ns;
    int fault; // from then on; WIRE_FINE ends it
};

struct lane {
    const char *name;
    int64_t now_ns;
    const struct happening *plan;
    int next;                  // index into plan
    int fault;                 // of its instrument, now
    int64_t since_ns;          // since when
    void (*strike)(int fault); // tells its instrument; may be NULL

    // Lanes whose instrument hangs on a file descriptor: what open() finds it
    // at, and what lets the instrument act now while its driver waits for fd.
    // serve returns when it may have more to say, INT64_MAX = never.
    const char *path;
    int64_t (*serve)(int fd);

    // The lane's lines of the log.
    char said[32]; // state in the last one
    int lines, repeated;
};

// Whose driver runs; NULL = nobody's: then all is real.
extern struct lane *present;

// The present lane's time goes on to until_ns, or to the next happening if
// that is before; never back.
void lane_pass(int64_t until_ns);

// The same, through all that happens meanwhile.
void lane_wait(int64_t until_ns);

// ---- the instruments -----------------------------------------------------------

// Each opens with the world's senses, is struck by what happens on its lane,
// and is closed at the end; *_held counts what a library handed out and did not
// get back yet.

bool day_usb_open(const struct around *around, int64_t now_ns, const char *calibration_path);
void day_usb_strike(int fault);
int day_usb_held(void);
void day_usb_close(void);

bool day_hid_open(const struct around *around);
void day_hid_strike(int fault);
int day_hid_held(void);
void day_hid_close(void);

// Modbus RTU and PR-655 on serial lines, Modbus TCP, and opentrack's datagrams.
// The lanes get their path and serve.
bool day_rtu_open(const struct around *around, struct lane *lane);
bool day_tcp_open(const struct around *around, struct lane *lane); // path is "127.0.0.1:port"
bool day_radiometer_open(const struct around *around, struct lane *lane);
bool day_poses_open(struct vec3 (*head)(int64_t at_ns), struct lane *lane);
void day_lines_close(void);
void day_poses_close(void);

// ---- the world -----------------------------------------------------------------

// One way in which a lane fails.
struct day_kind {
    int fault;
    double least_s, most_s; // how long; 0 0 = it is over at once
    bool rides;             // nothing is to be logged
};

enum { DAY_S = 24 * 3600, HOUR_S = 3600, SEED = 1 };

// Draws a lane's plan for the day: in the first hour each kind once, then at
// random with rests in between, none within a minute of the hours' ends; and
// what the world does meanwhile. The caller frees it.
struct happening *day_plan(const struct day_kind *kinds, int count, const char *lane,
                           struct world *world, int64_t start_ns);

#endif
