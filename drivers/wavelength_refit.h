// SPDX-License-Identifier: Apache-2.0
// New wavelength coefficients from the lines of a mercury-argon lamp: least
// squares on the peaks found. Pure functions.
#ifndef DRIVERS_WAVELENGTH_REFIT_H
#define DRIVERS_WAVELENGTH_REFIT_H

#include "base/error.h"

enum { REFIT_LINES_LEAST = 6, REFIT_LINES_MOST = 64 };

// Lines of Hg and Ar in air, nm, ascending, 0 at the end; such that stand alone
// at 1.5 nm resolution. Source: NIST Atomic Spectra Database.
extern const double refit_mercury_argon[];

struct refit {
    double wavelength[4]; // nm = sum of wavelength[i] x pixel^i
    int lines;            // used, >= REFIT_LINES_LEAST
    double rms_nm;        // of what is left
    double shift_nm;      // of the old axis that matched best
};

// counts: one spectrum above dark, not saturated, not smoothed by a boxcar.
// old: the coefficients so far, at most 5 nm off. A peak is a maximum above 1 %
// of the highest and above ten times the noise of its neighbourhood; a line is used when exactly
// one peak lies within 1 nm of it after the best common shift. Refused (DATA, saying why): fewer
// than REFIT_LINES_LEAST lines, lines over less than 200 nm, two shifts that match equally many
// lines, a line left more than 0.5 nm off, coefficients that do not ascend. out untouched then.
bool refit_wavelengths(const double *counts, int pixels, const double old[4],
                       const double *lines_nm, struct refit *out, struct error *err);

#endif
