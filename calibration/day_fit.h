// SPDX-License-Identifier: Apache-2.0
// Day/Taplin/Berns from measured patches, plain or with channel interaction:
// matrix, curves and interaction found together, so that the CIEDE2000 of the
// patches is least. In place of CIEDE2000, which has corners, stands its local
// quadratic form at the measured colour (colorimetry/metric.h).
// Sources: Day, Taplin, Berns 2004 (Color Res. Appl. 29, 365-373), with the
// curves taken from every patch instead of the ramps alone; monotone splines
// by their increments: Ramsay 1988 (Statistical Science 3, 425-441).
#ifndef CALIBRATION_DAY_FIT_H
#define CALIBRATION_DAY_FIT_H

#include "calibration/measurements.h"

enum {
    DAY_INTERVALS_MOST = 24,                  // of a curve's spline
    DAY_SLOPES_MOST = DAY_INTERVALS_MOST + 2, // coefficients of a curve
    DAY_MATRIX = 12,
    DAY_INTERACTION = 3 * DISPLAY_TERMS,
    DAY_PARAMETERS_MOST = DAY_MATRIX + 3 * DAY_SLOPES_MOST + DAY_INTERACTION,
};

// A solution in the fit's own parameters, from which another can start: rows of
// the matrix over white, log slopes of the red, green and blue spline, rows of
// the interaction over white (0 for plain Day).
struct day_fit {
    int intervals; // of the splines
    double x[DAY_PARAMETERS_MOST];
    int iterations, pooled; // pooled: curve nodes moved to make them rise
};

// The spline intervals that the levels of m's channels can decide. DATA with
// fewer than 20 patches or four levels of a channel.
bool day_fit_intervals(const struct measurements *m, int *intervals, struct error *err);

// The solution a first fit starts from: Rec. 709 primaries, straight splines.
struct day_fit day_fit_start(int intervals);

// Fits m as kind (DAY or INTERACTION) from *at, which becomes the solution.
// Fills and prepares model but for its name. DATA when the solver does not
// converge, or converges on what display_model_prepare refuses; outputs are
// untouched then.
bool day_fit(const struct measurements *m, enum display_kind kind, struct day_fit *at,
             struct display_model *model, struct error *err);

// Covariance of L*, a*, b* that a solution predicts at n counts, 3n x 3n: the
// solver's covariance of the parameters (J'J)^-1, scaled by the variance of the
// patches' residuals, through the slopes. DATA when the patches do not decide
// every parameter.
bool day_fit_covariance(const struct measurements *m, enum display_kind kind,
                        const struct day_fit *at, const struct counts *counts, int n,
                        double *covariance, struct error *err);

// Number of parameters of a kind.
int day_fit_parameters(enum display_kind kind, int intervals);

// CIELAB at given counts, from the solution itself: curves not yet nodes.
struct lab day_fit_lab(const struct day_fit *at, enum display_kind kind, struct counts counts,
                       struct xyz white);

// d Lab / d parameters at given counts (3 rows of day_fit_parameters), white
// being that of CIELAB: what the solution's covariance is propagated with.
void day_fit_slopes(const struct day_fit *at, enum display_kind kind, struct counts counts,
                    struct xyz white, double *slopes);

#endif
