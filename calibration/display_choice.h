// SPDX-License-Identifier: Apache-2.0
// Which display model is required: each is fitted to parts of the patches and
// asked for the rest (k-fold cross-validation); the simplest stays whose
// differences are not significantly worse than the best one's, patch by patch,
// or not worse by enough to matter.
// Sources: Stone 1974 (J. R. Stat. Soc. B 36, 111-147); paired differences and
// their standard error: Hastie, Tibshirani, Friedman 2009 (Elements of
// Statistical Learning, 7.10).
#ifndef CALIBRATION_DISPLAY_CHOICE_H
#define CALIBRATION_DISPLAY_CHOICE_H

#include "calibration/day_fit.h"

enum { DISPLAY_KIND_COUNT = DISPLAY_RESIDUAL + 1, DISPLAY_FOLDS = 5 };

// Worse is significant beyond this many standard errors (95 %, one-sided), and
// matters beyond this CIEDE2000: far below the 0.12 that 8-bit codes add.
#define DISPLAY_SIGNIFICANT 1.645
#define DISPLAY_MATTERS 0.005

struct display_candidate {
    bool tried, fitted;     // fitted: on all patches and in every fold
    char failed[400];       // why it was not
    double mean;            // CIEDE2000 of the patches that the fold left out
    double worse, worse_se; // mean difference to the best, patch by patch, and its standard error
};

struct display_choice {
    enum display_kind kind, best;
    int scored; // patches that were left out once: all but the corners of the cube of counts
    struct display_candidate candidates[DISPLAY_KIND_COUNT];
};

// What the folds said of each patch.
struct display_cross {
    bool *scored;                                // per patch
    struct xyz (*predicted)[DISPLAY_KIND_COUNT]; // cd/m2, by the models that did not see it
};

void display_cross_fini(struct display_cross *cross);

// Whether it is worse than the best, significantly and by enough to matter.
bool display_worse(const struct display_candidate *candidate);

// Takes a candidate out of the choice.
void display_give_up(struct display_candidate *candidate, const struct error *why);

// Cross-validates the candidates that stand as fitted in choice and fills
// choice and cross (the caller's to end). The fits start from starts, the
// solutions of DAY and INTERACTION on all patches. Patches of equal counts fall
// into one fold. A candidate that a fold cannot fit is given up; DATA when none
// is left.
bool display_choose(const struct measurements *m, const struct day_fit starts[2],
                    struct display_choice *choice, struct display_cross *cross, struct error *err);

#endif
