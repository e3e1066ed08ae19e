// SPDX-License-Identifier: Apache-2.0
// How far a set of patches is from its reference, as published and absolute.
#ifndef CALIBRATION_PROOF_H
#define CALIBRATION_PROOF_H

#include "calibration/facts.h"

// What a proof must reach: dE00 from the screen, in gamut, as published, and
// the luminance of white in per cent. White is read from the eye, where a
// display's light falls by 1 to 2 % a degree: a tracked eye is known to half of one.
#define PROOF_MEAN_MOST 0.6
#define PROOF_MAX_MOST 1.8
#define PROOF_WHITE_PERCENT_MOST 2.0

// Fills de_* of every patch and lamp->proof. Needs reference, measured, full,
// bands and in_gamut of every patch, white_reference and white_patch.
//
// As published (RIT light-booth display): each set is divided by 1.13 times
// the Y of its own white patch, adapted by CAT02 (D = 1) from the lamp's
// perfect diffuser to D65, CIELAB under D65, CIEDE2000.
// Absolute: cd/m2, no division, no adaptation; the white of CIELAB is the
// perfect diffuser at that place under that lamp.
// lamp->reached tells whether all targets above are met.
// Errors (DATA, RANGE): a white that is not positive.
bool proof_judge(struct lamp_report *lamp, struct error *err);

// As published: the white patch stands for this share of a perfect diffuser,
// and CIELAB is that of this white (D65, Y = 1).
#define PROOF_WHITE_PATCH 1.13
extern const struct xyz proof_white;

// Adapts colours under a lamp whose perfect diffuser is white to proof_white.
struct mat3 proof_adaptation(struct xyz white);

// One colour difference as published: both colours are already divided, Y = 1
// for the perfect diffuser; white is the lamp's perfect diffuser.
bool proof_published_difference(struct xyz a, struct xyz b, struct xyz white, double *de,
                                struct error *err);

// The published figures: rows "D65 lamp", "D50 lamp", "A lamp".
struct published_row {
    const char *lamp;
    double simulation[4], screen[4]; // mean, std, 90th percentile, max
    double in_gamut[4];              // zeros where none were published
};
extern const struct published_row published_table[3];

#endif
