// SPDX-License-Identifier: Apache-2.0
// Measured patches of a display: a .ti3 file as ArgyllCMS writes it, in
// absolute units.
#ifndef CALIBRATION_MEASUREMENTS_H
#define CALIBRATION_MEASUREMENTS_H

#include "colorimetry/display.h"

#define WHITE_ERROR_WARN 0.03

struct measured_patch {
    struct counts counts; // 0..1
    struct xyz xyz;       // cd/m2
    int line;             // of the file
};

struct measurements {
    char path[512], instrument[128], created[32];
    char display[128]; // keyword DISPLAY, else the file's name without its suffix
    int count;
    struct measured_patch *patches; // owned
    struct xyz white;   // cd/m2: LUMINANCE_XYZ_CDM2, else the mean of the 100/100/100 rows
    bool absolute;      // false: Y = 100 for white and the file does not say how many cd/m2
    int whites;         // rows of 100/100/100
    double white_error; // largest relative difference of X, Y or Z between the mean of those rows
                        // and LUMINANCE_XYZ_CDM2 (without it: of Y and 100), 0 without such rows
    double white_drift; // (largest - least) / mean Y of those rows, 0 with fewer than two
};

void measurements_fini(struct measurements *m);

// Reads a .ti3 with RGB_R.. (0..100) and XYZ_X.. . XYZ are relative (Y of
// white = 100) unless NORMALIZED_TO_Y_100 is NO, and made absolute through
// LUMINANCE_XYZ_CDM2. Refuses, naming file, line, key and value: missing
// fields, RGB outside 0..100 or all within 0..1 (another unit), XYZ below zero
// by more than 1 % of white or above ten times white, a file without
// LUMINANCE_XYZ_CDM2 and without a 100/100/100 row, a white that is not
// positive or whose luminance is outside 1..100000 cd/m2, white rows that
// contradict LUMINANCE_XYZ_CDM2 by more than 10 % (white_error above
// WHITE_ERROR_WARN is the caller's to warn about).
bool measurements_load(const char *path, struct measurements *m, struct error *err);

#endif
