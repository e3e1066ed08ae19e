// SPDX-License-Identifier: Apache-2.0
// How the readings of a radiometer go wrong while its line does not: they
// creep, or one now and then is false.
#ifndef SIMULATOR_MODEL_LAPSE_H
#define SIMULATOR_MODEL_LAPSE_H

#include <stdbool.h>

enum lapse_kind { LAPSE_NONE, LAPSE_DRIFT, LAPSE_MISREAD };

struct lapse_rates {
    double drift;      // relative, of each reading over the one before, >= 0
    int misread_every; // one reading of so many is false, >= 1
};

// Zero it but for the rates to begin.
struct lapse {
    struct lapse_rates rates;
    enum lapse_kind kind;
    int readings; // since it began
};

// From the next reading on. The same kind again changes nothing.
void lapse_set(struct lapse *lapse, enum lapse_kind kind);

// What the next reading shows over what is so. DRIFT: 1 + drift, then its
// powers. MISREAD: the first of misread_every is false, by turns 1.1 times, an
// error of the instrument (false is returned), 1000 times what is so.
bool lapse_next(struct lapse *lapse, double *factor);

#endif
