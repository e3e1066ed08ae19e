// SPDX-License-Identifier: Apache-2.0
// boothcal colour spectrum: colours of lamps, and of surfaces under a lamp.
#ifndef CALIBRATION_COLOUR_SPECTRUM_H
#define CALIBRATION_COLOUR_SPECTRUM_H

// What "spectrum --help" says of each option.
#define COLOUR_SPECTRUM_OPTIONS                                                                    \
    "  --light FILE|NAME    a CIE illuminant (A, D65, D5500K, FL3.15, ...) or a file: CSV (nm,\n"  \
    "                       v1, v2, ...) or CGATS (.sp)\n"                                        \
    "  --reflectance TABLE  surfaces, 0..1, such a file; without it the lamp itself is shown\n"   \
    "  --observer NAME      1931-2 (default), 1964-10, 2015-2 or 2015-10\n"                       \
    "  --mode MODE          full (1 nm spectra, default), bands (band coefficients) or product\n" \
    "                       (products of lamp and surface channels)\n"                            \
    "  --bands FILE|COUNT   a set of bands; means --mode bands\n"                                 \
    "  --json               JSON instead of a table\n"                                            \
    "  --help\n"                                                                                  \
    "\n"                                                                                          \
    "Spectra reach from 420 nm or below to 680 nm or above. The white of Lab is the lamp;\n"      \
    "CCT and Duv are by the 1931 observer. Exit 3: done, with a warning."

// argv[0] is "spectrum"; returns an exit code of calibration/commands.h.
int command_colour_spectrum(int argc, char **argv);

#endif
