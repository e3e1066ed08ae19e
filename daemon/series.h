// SPDX-License-Identifier: Apache-2.0
// Raw readings of the spectrometer, taken one after the other on request: what
// calibrating the instrument itself needs.
#ifndef DAEMON_SERIES_H
#define DAEMON_SERIES_H

#include "drivers/spectrometer.h"

enum { SERIES_MOST = 1000 };

struct series_wanted {
    int integration_us; // 0 = the exposure that the driver has come to
    int readings;       // 1..SERIES_MOST
    int64_t asked_ns;   // what was exposed before does not count
    int64_t deadline_ns;
};

// Readings of one exposure, taken together.
struct series {
    struct detector detector;
    struct interval taken;
    int integration_us, readings;
    int saturated;                          // active pixels that reached saturation, the most
                                            // in one reading
    double mean[DETECTOR_PIXELS_MOST];      // raw counts
    double deviation[DETECTOR_PIXELS_MOST]; // sample standard deviation; 0 of one reading
    double active[SERIES_MOST];             // mean of the active pixels, reading by reading
    double black[SERIES_MOST];              // mean of the black pixels
    double squares[DETECTOR_PIXELS_MOST];   // of series_add: sum of squares about the mean
};

// Begins with a zeroed series. A reading of another exposure or detector than
// the first is refused (RETRY), so is one more than SERIES_MOST.
bool series_add(struct series *series, const struct spectrum_counts *counts, struct error *err);

#endif
