// SPDX-License-Identifier: Apache-2.0
// One polled instrument, kept in service turn by turn: opened, read, rested
// from while it is not there, opened anew. It has no thread of its own.
#ifndef DAEMON_POLLED_H
#define DAEMON_POLLED_H

#include "config/booth.h"
#include "daemon/series.h"

#define INSTRUMENTS(X)                                                                             \
    X(SPECTROMETER, "spectrometer")                                                                \
    X(ACCELEROMETER, "accelerometer")                                                              \
    X(TRACKER, "tracker")                                                                          \
    X(RADIOMETER, "radiometer") /* on demand, see desk.h; those before it are polled */

enum instrument {
#define X(name, text) INSTRUMENT_##name,
    INSTRUMENTS(X)
#undef X
        INSTRUMENT_COUNT,
    INSTRUMENTS_POLLED = INSTRUMENT_RADIOMETER
};

const char *instrument_name(enum instrument instrument);

#define INSTRUMENT_STATES(X)                                                                       \
    X(NONE, "none")       /* the settings name none */                                             \
    X(WAITING, "waiting") /* not there, or of no use; opened again and again */                    \
    X(SILENT, "silent")   /* open, but without a sample for long */                                \
    X(RUNNING, "running")                                                                          \
    X(IDLE, "idle") /* on demand, nothing asked */

enum instrument_state {
#define X(name, text) INSTRUMENT_IS_##name,
    INSTRUMENT_STATES(X)
#undef X
};

const char *instrument_state_name(enum instrument_state state);

// What a person wants to know of an instrument.
struct instrument_report {
    enum instrument_state state;
    char driver[32];
    struct instrument_identity identity; // of the last time it was open
    uint64_t samples;                    // since the start
    int64_t latest_ns;                   // of the last sample; valid when samples > 0
    char note[64];                       // of the last sample: "good", "seen", …
    int64_t overdue_ns; // most by which the driver outlasted a deadline since the start, 0 = never
    struct error error; // the last one; code NONE while all is well
};

// Drivers and their options; a driver of NULL is none.
struct acquire_from {
    const struct spectrometer_driver *spectrometer;
    struct spectrometer_options spectrometer_options;
    const struct accelerometer_driver *accelerometer;
    struct accelerometer_options accelerometer_options;
    const struct tracker_driver *tracker;
    struct tracker_options tracker_options;
};

struct acquire_from acquire_from(const struct booth_settings *settings);

struct polled;

// Its driver may be none: then it takes no turns. from is copied. NULL with err
// (SYSTEM).
struct polled *polled_create(const struct acquire_from *from, enum instrument instrument,
                             struct error *err);

// Closes the instrument first. Accepts NULL.
void polled_destroy(struct polled *polled);

// Opens the instrument when it is not open, else reads it once, for its samples
// or for a series that was asked for; blocks as long as its driver may. Returns how long to rest
// before the next turn, ns, 0 = not at all. Logs one line per change of state, one when samples
// have been good for nothing for 5 s (such as a wrong map of an inclinometer) and one when that is
// over. One thread.
int64_t polled_turn(struct polled *polled);

// Closes the instrument when it is open; the next turn opens it again.
void polled_close(struct polled *polled);

// Copies the newest sample into the struct of its kind and returns its running
// number; 0 = none yet, sample is untouched. Any thread.
uint64_t polled_latest(struct polled *polled, void *sample);

// Asks the spectrometer for a series of raw readings; meanwhile it gives no
// samples. Returns the request's number; a new request replaces one that nobody
// works on yet. Any thread.
uint64_t polled_ask_series(struct polled *polled, const struct series_wanted *wanted);

// True when the request of that number was worked on: then out holds the
// series, or err says why there is none (code NONE: there is). Any thread.
bool polled_series(struct polled *polled, uint64_t number, struct series *out, struct error *err);

// What is known at now_ns; overdue_ns counts a call that the driver is still in. Any thread.
void polled_report(struct polled *polled, int64_t now_ns, struct instrument_report *out);

#endif
