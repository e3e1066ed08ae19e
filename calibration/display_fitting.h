// SPDX-License-Identifier: Apache-2.0
// boothcal display fit: the command line of display_fit.h.
#ifndef CALIBRATION_DISPLAY_FITTING_H
#define CALIBRATION_DISPLAY_FITTING_H

#include <stdbool.h>

#include "calibration/measurements.h"

// argv[0] is the command's own name; returns an enum command_exit.
int display_fitting(int argc, char **argv);

// Warns on stderr where the white patches contradict the file's own white by
// more than WHITE_ERROR_WARN; whether it did.
bool display_warn_white(const struct measurements *m);

#endif
