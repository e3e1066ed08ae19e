// SPDX-License-Identifier: Apache-2.0
// New wavelength coefficients from the lines of a mercury-argon lamp: least
// squares on the peaks found. Pure functions.
#ifndef DRIVERS_WAVELENGTH_REFIT_H
#define DRIVERS_WAVELENGTH_REFIT_H

#include "base/error.h"

enum { REFIT_LINES_LEAST = 6, REFIT_LINES_MOST = 64 };

// Lines of Hg and Ar in air, nm, ascending, 0 at the end; such that mostly
// stand alone at 1.5 nm resolution. Source: NIST Atomic Spectra Database.
extern const double refit_mercury_argon[];

struct refit_line {
    double nm;      // of the lamp
    double pixel;   // where its peak is
    double was_nm;  // what the old axis says there
    double left_nm; // new axis there less the lamp's
};

struct refit {
    double wavelength[4];                     // nm = sum of wavelength[i] x pixel^i
    int pixels;                               // of the spectrum
    int lines;                                // used, >= REFIT_LINES_LEAST
    struct refit_line line[REFIT_LINES_MOST]; // ascending
    double rms_nm;                            // of what is left
    double shift_nm;                          // of the old axis that matched best
};

// counts: one spectrum above dark, not saturated, not smoothed by a boxcar.
// old: the coefficients so far, at most 5 nm off. A peak is a maximum above 1 %
// of the highest and above ten times the noise of its neighbourhood, from which the counts fall
// below half on both sides before the next one, and that is at most 1.4 times as wide as their
// median; a line is used when exactly
// one such peak lies within 1 nm of it after the best common shift. Refused (DATA, saying why):
// fewer than REFIT_LINES_LEAST lines, lines over less than 200 nm, two shifts that match equally
// many lines, a line left more than 0.5 nm off, coefficients that do not ascend, lines that leave
// an axis within 400..700 nm more than 0.5 nm uncertain. out untouched then.
bool refit_wavelengths(const double *counts, int pixels, const double old[4],
                       const double *lines_nm, struct refit *out, struct error *err);

// Standard uncertainty (nm) of the new axis at a pixel, by the residuals and by
// how the lines lie (GUM, JCGM 100:2008, H.3); the residuals count for at least
// 0.03 nm, a tenth of a pixel, for few lines may meet a cubic by chance.
double refit_sigma(const struct refit *refit, double pixel);

// nm of a pixel, its centre at whole numbers.
double refit_nm(const double wavelength[4], double pixel);

// The coefficients behind a list of wavelengths, one a pixel, as files hold
// them; *worst_nm is how far off they are at most. DATA for fewer than 8
// pixels, or none that fit.
bool refit_axis(const double *nm, int pixels, double out[4], double *worst_nm, struct error *err);

#endif
