// SPDX-License-Identifier: Apache-2.0
// How long a display needs until a new colour stands, found by measuring it.
#ifndef CALIBRATION_SETTLE_H
#define CALIBRATION_SETTLE_H

#include "base/error.h"

// One reading of luminance, cd/m2: shows the other of black and white for
// SETTLE_LONGEST_S, then the one that is asked for, waits after_s and reads.
typedef bool settle_reader(void *context, bool white, double after_s, double *luminance,
                           struct error *err);

struct settle {
    double seconds;          // the shortest wait after which both transitions stand
    bool settled;            // false: even the two longest waits differ
    double white, black;     // cd/m2 after the longest wait
    double white_u, black_u; // standard deviation of a reading there
    int readings;
};

// The longest wait that is tried; a panel that needs more is not settled.
#define SETTLE_LONGEST_S 1.6

// Reads white and black five times each after the longest wait, then after
// ever shorter ones, 0.8 s, 0.4 s … 0.025 s, 0 s, and stops at the first that differs:
// by more than three standard deviations of a reading and more than 0.1 % of
// white's luminance for white, 0.001 % for black (a tenth of what an
// instrument resolves).
bool settle_find(settle_reader *read, void *context, struct settle *out, struct error *err);

#endif
