// SPDX-License-Identifier: Apache-2.0
// What a draw of the budget is made of: every cause as a few modes, each the
// change that one standard deviation of it makes to every colour. Colours are
// linear in the modes; only ratios, CIELAB and CIEDE2000 are not.
#ifndef CALIBRATION_BUDGET_MODES_H
#define CALIBRATION_BUDGET_MODES_H

#include "calibration/budget.h"

enum { BUDGET_MODES = 384 };

// One mode, shared by all patches. Sample colours are sums over the lamp's
// spectrum before they are scaled to the illuminance; index count is the
// perfect diffuser.
struct budget_mode {
    enum budget_cause cause;
    double log_lux;        // change of ln lux
    double log_screen;     // relative change of every screen colour
    struct xyz *reference; // [count + 1] or NULL
    struct xyz *screen;    // [count] or NULL, cd/m2
};

struct budget_modes {
    int patches, count;
    struct budget_mode modes[BUDGET_MODES];
    struct xyz *reference; // [patches + 1]: sums at the estimate
};

// Errors: SYSTEM, out of memory; RANGE, a dark lamp.
bool budget_modes_make(const struct budget_input *input, struct budget_modes *out,
                       struct error *err);
void budget_modes_fini(struct budget_modes *modes);

#endif
