// SPDX-License-Identifier: Apache-2.0
// One thread per instrument: opens it, reads it, waits longer and longer while
// it is not there, and keeps its newest sample in a mailbox.
#ifndef DAEMON_ACQUIRE_H
#define DAEMON_ACQUIRE_H

#include "base/mailbox.h"
#include "config/booth.h"
#include "daemon/series.h"
#include "daemon/state.h"

#define INSTRUMENTS(X)                                                                             \
    X(SPECTROMETER, "spectrometer")                                                                \
    X(ACCELEROMETER, "accelerometer")                                                              \
    X(TRACKER, "tracker")                                                                          \
    X(RADIOMETER, "radiometer") /* on demand, see measure.h */

enum instrument {
#define X(name, text) INSTRUMENT_##name,
    INSTRUMENTS(X)
#undef X
        INSTRUMENT_COUNT
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
    struct error error;                  // the last one; code NONE while all is well
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

// Samples that are good for nothing: said once when it lasts for 5 s, and once
// when it is over. Zeroed at the start.
struct doubt {
    bool lasts, told;
    int64_t since_ns;
};

enum doubt_news { DOUBT_NO_NEWS, DOUBT_LASTS, DOUBT_OVER };

enum doubt_news doubt_step(struct doubt *doubt, bool doubts, int64_t now_ns);

struct acquire;

// Starts the threads. They log one line per change of an instrument's state, and
// one of doubt (such as a wrong map of an inclinometer).
// NULL with err (SYSTEM).
struct acquire *acquire_start(const struct acquire_from *from, struct error *err);

// Asks all threads to end and waits for them until deadline_ns; false when one
// is still inside its driver: then nothing was freed and the program must end.
// Accepts NULL.
bool acquire_stop(struct acquire *acquire, int64_t deadline_ns);

// Newest samples and their running numbers. Any thread.
void acquire_latest(struct acquire *acquire, struct samples *out);

// Asks the spectrometer's own thread for a series of raw readings; meanwhile it
// gives no samples. Returns the request's number; a new request replaces one
// that nobody works on yet. Any thread.
uint64_t acquire_ask_series(struct acquire *acquire, const struct series_wanted *wanted);

// True when the request of that number was worked on: then out holds the
// series, or err says why there is none (code NONE: there is).
bool acquire_series(struct acquire *acquire, uint64_t number, struct series *out,
                    struct error *err);

// Any thread.
void acquire_report(struct acquire *acquire, enum instrument instrument,
                    struct instrument_report *out);

#endif
