// SPDX-License-Identifier: Apache-2.0
// Where measuring waits: a thread that owns the radiometer and does what takes
// seconds (measure, teach, raw counts), so that frames and other requests do not.
#ifndef DAEMON_DESK_H
#define DAEMON_DESK_H

#include "daemon/acquire.h"
#include "daemon/jobs.h"

struct desk;

// The radiometer is opened when first asked for, and kept open. It may be
// none. instruments is borrowed until desk_close; who only measures needs none. NULL with err
// (SYSTEM).
struct desk *desk_open(const struct booth_settings *settings, struct acquire *instruments,
                       struct error *err);

// The same without a thread: whoever made it does the jobs, by desk_do.
struct desk *desk_create(const struct booth_settings *settings, struct acquire *instruments,
                         struct error *err);

// Does a MEASURE, TEACH or RAW job, within its time-out. The desk's thread, or the
// only one where it has none.
void desk_do(struct desk *desk, struct job *job);

// As acquire_stop: false when still inside a reading at deadline_ns.
bool desk_close(struct desk *desk, int64_t deadline_ns);

// Takes MEASURE, TEACH and RAW jobs; they come back through jobs_finished.
struct jobs *desk_jobs(struct desk *desk);

// Any thread.
void desk_report(struct desk *desk, struct instrument_report *out);

// Standard uncertainty of the mean of readings whose own are sigmas: their rms. It does not fall
// with their number, for most of it is the calibration's, common to all.
void teach_sigma(const struct spectrum *sigmas, int count, struct spectrum *sigma);

// What teaching makes of readings: their mean, the rms of what each is off
// relative to the rms of the mean, both over all wavelengths. count >= 1.
void teach_average(const struct spectrum *readings, int count, struct spectrum *mean,
                   double *spread);

#endif
