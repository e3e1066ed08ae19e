// SPDX-License-Identifier: Apache-2.0
// A display model from measured patches: plain Day, Day with channel
// interaction or Day with a smooth residual, the simplest that the patches
// require (calibration/display_choice.h).
#ifndef CALIBRATION_DISPLAY_FIT_H
#define CALIBRATION_DISPLAY_FIT_H

#include "calibration/display_choice.h"
#include "calibration/residual_fit.h"
#include "calibration/statistics.h"
#include "colorimetry/display_uncertainty.h"

// What the fit found out, besides the model.
struct display_fit {
    int patches, iterations, pooled; // pooled: curve nodes moved to make them rise
    struct summary de00;             // over the fitted patches
    struct summary day;              // likewise, of plain Day alone
    struct display_choice choice;    // which kind was kept, and why
    char not_validated[200];         // why there is no choice but the simplest, and no uncertainty
                                     // but that of the parameters; ""
    struct residual_fit residual;    // when it was tried
    struct display_uncertainty uncertainty; // of the kept model's predictions
    bool primaries;                         // red, green, blue, white and black were all measured
    double additivity;                      // luminance of R + G + B - 2 black over white, less 1
    bool ill_conditioned;                   // condition > 10: noise grows tenfold
    bool misfit;                            // plain Day: mean > 0.6 or p95 > 2, whichever was kept
    bool disordered; // red's x, green's Y or blue's Z is not the largest of the
                     // three: columns exchanged?
    bool drifted;    // white moved by more than 3 % while measuring
};

// Fits and prepares model (its name from the measurements): the kind *only, or
// the simplest required when only is NULL. Errors: DATA when the patches cannot
// decide a model (fewer than 20, no ramp), when the solver does not converge,
// when the primaries are ill-conditioned beyond use, when *only does not
// describe the patches.
bool display_fit(const struct measurements *m, const enum display_kind *only,
                 struct display_model *model, struct display_fit *found, struct error *err);

// CIEDE2000 of each patch against a model, white of the measurements; de00 has
// m->count elements. False (RANGE) for a white that CIELAB refuses.
bool display_differences(const struct measurements *m, const struct display_model *model,
                         double *de00, struct error *err);

#endif
