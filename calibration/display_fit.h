// SPDX-License-Identifier: Apache-2.0
// A display model from measured patches: the 3x4 matrix and the three curves
// together, so that the mean CIEDE2000 over all patches is least.
// Source: Day, Taplin, Berns 2004 (Color Res. Appl. 29, 365-373), with the
// curves taken from every patch instead of the ramps alone.
#ifndef CALIBRATION_DISPLAY_FIT_H
#define CALIBRATION_DISPLAY_FIT_H

#include "calibration/measurements.h"
#include "calibration/statistics.h"

// What the fit found out, besides the model.
struct display_fit {
    int patches, iterations, pooled; // pooled: curve nodes moved to make them rise
    struct summary de00;             // over the fitted patches
    bool primaries;                  // red, green, blue, white and black were all measured
    double additivity;               // luminance of R + G + B - 2 black over white, less 1
    bool ill_conditioned;            // condition > 10: noise grows tenfold
    bool misfit;                     // mean > 0.6 or p95 > 2: no such model describes this panel
    bool disordered;                 // red's x, green's Y or blue's Z is not the largest of the
                                     // three: columns exchanged?
    bool drifted;                    // white moved by more than 3 % while measuring
};

// Fits and prepares model (its name from the measurements). Errors: DATA when
// the patches cannot decide a model (fewer than 20, no ramp), when the solver
// does not converge, when the primaries are ill-conditioned beyond use.
bool display_fit(const struct measurements *m, struct display_model *model,
                 struct display_fit *found, struct error *err);

// CIEDE2000 of each patch against a model, white of the measurements; de00 has
// m->count elements. False (RANGE) for a white that CIELAB refuses.
bool display_differences(const struct measurements *m, const struct display_model *model,
                         double *de00, struct error *err);

#endif
