// SPDX-License-Identifier: Apache-2.0
// The smooth residual of plain Day: what its predictions lack in CIELAB, as a
// lattice over the predicted colour.
//
// Coefficients are held small and alike by a Gaussian process: their prior
// covariance is Matern's of order 5/2 with a length of 160 CIELAB units, so
// that where no patch lies the residual fades into what its neighbours say.
// Noise counts in units of CIEDE2000 (a patch by the local scale of CIELAB,
// colorimetry/metric.h). How much noise there is, is what predicts each patch
// best from all the others.
// Sources: Rasmussen, Williams 2006 (Gaussian Processes for Machine Learning,
// eq. 4.17 and 5.12); robust weights: Huber 1964 (Ann. Math. Stat. 35, 73-101).
#ifndef CALIBRATION_RESIDUAL_FIT_H
#define CALIBRATION_RESIDUAL_FIT_H

#include "calibration/measurements.h"

// Where the covariance of the shift is wanted: of L*, a*, b* at n counts, 3n x
// 3n, filled by the fit.
struct residual_spread {
    const struct counts *counts;
    int n;
    double *covariance;
};

struct residual_fit {
    double penalty; // noise variance (dE00^2) over prior variance (CIELAB^2)
    double freedom; // terms that the patches decide
};

// Makes a prepared DAY model a prepared RESIDUAL one. Where the residual that
// predicts best would fold, a larger penalty is taken. DATA when none will do;
// model is untouched then. spread may be NULL.
bool residual_fit(const struct measurements *m, struct display_model *model,
                  struct residual_fit *found, const struct residual_spread *spread,
                  struct error *err);

#endif
