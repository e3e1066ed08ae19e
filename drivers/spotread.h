// SPDX-License-Identifier: Apache-2.0
// The driver that lets ArgyllCMS's spotread measure, as a process behind a
// pseudo terminal; see spotread.md. What its lines mean, open to tests.
#ifndef DRIVERS_SPOTREAD_H
#define DRIVERS_SPOTREAD_H

#include "drivers/radiometer.h"

extern const struct radiometer_driver spotread_driver;

#define SPOTREAD_LINES(X)                                                                          \
    X(OTHER)       /* nothing to act on */                                                         \
    X(READY)       /* it waits for a key to read */                                                \
    X(CALIBRATION) /* it waits for the instrument to be put on its calibration position */         \
    X(RETRY)       /* it waits for a key after a reading or a calibration that failed */           \
    X(XYZ)                                                                                         \
    X(SPECTRUM)   /* the spectrum's head; its values follow */                                     \
    X(NO_SPECTRA) /* it was asked for spectra, and its instrument, a colorimeter, has none */      \
    X(FAILED)     /* a reading or the instrument failed */

enum spotread_line {
#define X(name) SPOTREAD_##name,
    SPOTREAD_LINES(X)
#undef X
};

// What a line, or the start of one that does not end, says.
enum spotread_line spotread_line(const char *text);

// " Result is XYZ: X Y Z, ..." False when it is not that or not finite.
bool spotread_xyz(const char *line, struct xyz *out);

// "Spectrum from A to B nm in N steps", N 2..401, A below B.
bool spotread_spectrum_head(const char *line, double *first_nm, double *last_nm, int *count);

// Adds the numbers of "a, b, c" to values, which hold *got of most. False when
// something else stands there or they are too many.
bool spotread_spectrum_values(const char *line, double *values, int most, int *got);

// The error of a line that is FAILED: RANGE for too much light, GONE for a lost
// instrument, CONFIG for spectra of a colorimeter, else RETRY, with the line as
// text. Returns false.
bool spotread_failure(const char *line, struct error *err);

#endif
