// SPDX-License-Identifier: Apache-2.0
// The bench's part for stand and tracker: what the inclinometer and the tracker
// say while nothing moves, and what a person measures by hand. With an emulated
// booth its own protractor and tape answer.
#ifndef CALIBRATION_BENCH_POSE_H
#define CALIBRATION_BENCH_POSE_H

#include "calibration/bench.h"

// Mean of fresh readings of the inclinometer, as it says them: before how it is
// turned on the screen counts.
struct tilt_look {
    double reading_deg, spread_deg; // spread: standard deviation of one
    bool has_gravity;
    struct vec3 gravity; // m/s2, sensor axes
    double believed_deg; // what boothd makes of it now
    int looks;
};

// Waits until two means of `looks` readings agree. Errors: RETRY when it says
// nothing for 20 s, nothing that can be used for 4 s, or does not come to rest; GONE when
// there is none.
bool bench_look_tilt(struct bench *b, int looks, struct tilt_look *out, struct error *err);

// Mean of fresh places of the eye in the tracker's own frame, likewise.
struct eye_look {
    struct vec3 at;
    double spread_m; // standard deviation of one, on the worst axis
    int looks;
};
bool bench_look_eye(struct bench *b, int looks, struct eye_look *out, struct error *err);

// The screen's tilt as a protractor on it reads, degrees.
bool bench_protractor(struct bench *b, double *deg, struct error *err);

// Where a place of the screen (x_m to the right of its centre, y_m up along
// it) is in the booth, by tape. what names it.
bool bench_tape(struct bench *b, const char *what, double x_m, double y_m, struct vec3 *at,
                struct error *err);

// Has what the tracker takes for the eye held at a place of the booth. where
// names it.
bool bench_hold(struct bench *b, const char *where, struct vec3 at, struct error *err);

#endif
