// SPDX-License-Identifier: Apache-2.0
// One thread per instrument: opens it, reads it, waits longer and longer while
// it is not there, and keeps its newest sample in a mailbox.
#ifndef DAEMON_ACQUIRE_H
#define DAEMON_ACQUIRE_H

#include "daemon/polled.h"
#include "daemon/state.h"

struct acquire;

// Starts the threads. They log what polled_turn logs.
// NULL with err (SYSTEM).
struct acquire *acquire_start(const struct acquire_from *from, struct error *err);

// Asks all threads to end and waits for them until deadline_ns; false when one
// is still inside its driver: then nothing was freed and the program must end.
// Accepts NULL.
bool acquire_stop(struct acquire *acquire, int64_t deadline_ns);

// Newest samples and their running numbers. Any thread.
void acquire_latest(struct acquire *acquire, struct samples *out);

// polled_ask_series and polled_series of the spectrometer. Any thread.
uint64_t acquire_ask_series(struct acquire *acquire, const struct series_wanted *wanted);
bool acquire_series(struct acquire *acquire, uint64_t number, struct series *out,
                    struct error *err);

// Any thread.
void acquire_report(struct acquire *acquire, enum instrument instrument,
                    struct instrument_report *out);

#endif
