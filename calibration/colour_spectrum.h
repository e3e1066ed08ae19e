// SPDX-License-Identifier: Apache-2.0
// boothcal colour spectrum: colours of lamps, and of surfaces under a lamp.
#ifndef CALIBRATION_COLOUR_SPECTRUM_H
#define CALIBRATION_COLOUR_SPECTRUM_H

// argv[0] is "spectrum"; returns an exit code of calibration/commands.h.
int command_colour_spectrum(int argc, char **argv);

#endif
