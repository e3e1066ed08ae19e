// SPDX-License-Identifier: Apache-2.0
// Measuring a display through the running boothd: every reading goes to a
// journal as soon as it is taken, so that whoever is interrupted goes on from
// there. Between the readings: warm-up, settling, drift.
#ifndef CALIBRATION_MEASURING_H
#define CALIBRATION_MEASURING_H

#include "calibration/bench.h"
#include "calibration/patches.h"
#include "calibration/settle.h"
#include "calibration/statistics.h"

struct measuring_plan {
    struct patch_sizes sizes;
    int verify;              // random patches kept apart
    uint64_t seed;           // of colours and order
    double warm_up_s;        // white is waited for at most so long, 0 = not at all; 0..14400
    double warm_up_window_s; // over which it must stand still: MEASURING_STILL of its luminance
    double settle_s;         // wait after showing a patch, 0..10; below 0: found by measuring
};

// White stands still: its measured slope changes it by less than this over the window.
#define MEASURING_STILL 0.002
// White drifting by more than this while measuring is warned about.
#define MEASURING_DRIFT_WARN 0.03

extern const struct measuring_plan MEASURING_WHOLE, MEASURING_REHEARSAL;

struct measuring {
    struct patch_set fit, verify; // owned; in the order of measuring
    char instrument[128], started[32];
    int kept;             // readings that the journal held already
    double warm_up_s;     // waited for white; of this run, not of an interrupted one
    double warm_up_slope; // relative per hour when it ended
    bool warm;            // white stood still, or no warm-up was asked for
    struct settle settle; // seconds is what was used
    bool settle_found;    // false: the plan gave it
    struct patch_drift drift;
    struct xyz white; // mean of the repeated whites, cd/m2
};

void measuring_fini(struct measuring *m);

// Measures what the plan says and the journal does not hold yet. The booth must
// be dark and the instrument aimed. Each reading is in the journal, on disk,
// before the next patch is shown; a line that was cut off is measured again.
// The gamma ramp must be neutral (a booth that says "not neutral" is refused);
// patches are never dithered. Errors: CONFIG when the journal belongs to
// another plan, booth, display or instrument: naming what differs; those of
// the bench. What the journal holds stays whatever happens.
bool measuring_run(struct bench *b, const struct measuring_plan *plan, const char *booth,
                   const char *journal, struct measuring *out, struct error *err);

#endif
