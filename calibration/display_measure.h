// SPDX-License-Identifier: Apache-2.0
// boothcal display measure: the command line of measuring.h.
#ifndef CALIBRATION_DISPLAY_MEASURE_H
#define CALIBRATION_DISPLAY_MEASURE_H

// argv[0] is the command's own name; returns an enum command_exit.
int display_measure(int argc, char **argv);

#endif
