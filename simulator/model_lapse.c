// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_lapse.h"

#include <math.h>

#define SLIGHTLY 1.1
#define WILDLY 1000.0 // a decimal point is lost

void lapse_set(struct lapse *lapse, enum lapse_kind kind)
{
    if (lapse->kind != kind)
        lapse->readings = 0;
    lapse->kind = kind;
}

static bool misread(int false_readings, double *factor)
{
    *factor = false_readings % 3 == 0 ? SLIGHTLY : WILDLY;
    return false_readings % 3 != 1;
}

bool lapse_next(struct lapse *lapse, double *factor)
{
    int before = lapse->readings++, every = lapse->rates.misread_every;
    *factor = 1;
    switch (lapse->kind) {
    case LAPSE_NONE:
        break;
    case LAPSE_DRIFT:
        *factor = pow(1 + lapse->rates.drift, before + 1);
        break;
    case LAPSE_MISREAD:
        return before % every || misread(before / every, factor);
    }
    return true;
}
