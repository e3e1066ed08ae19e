// SPDX-License-Identifier: Apache-2.0
// Measuring and fitting how a display's light depends on direction and place.
#ifndef CALIBRATION_VIEW_MEASURE_H
#define CALIBRATION_VIEW_MEASURE_H

#include "calibration/bench.h"
#include "calibration/view_fit.h"
#include "config/view_file.h"

struct view_plan {
    double angles_deg[3]; // off the normal, 5..75, at least 5 apart
    int azimuths;         // at each angle, 4..36
    double distance_m;    // of the instrument, 0.1..3
    bool places;          // also at VIEW_PLACES by VIEW_PLACES along the normal
};

extern const struct view_plan VIEW_PLAN; // 15, 30 and 45 degrees, 6 azimuths, 0.6 m, places

struct view_measured {
    struct display_view view;
    struct view_fit fit;
    struct view_origin origin;
    int kept; // readings that the journal held already
};

// Measures what the plan says and the journal does not hold, in the dark booth
// at the tilt that boothd believes, and fits. Errors as measuring_run's and
// view_fit's.
bool view_measured(struct bench *b, const struct booth_settings *settings,
                   const struct view_plan *plan, const char *journal, struct view_measured *out,
                   struct error *err);

// Fits what a journal holds. DATA when readings are missing.
bool view_from_journal(const char *journal, struct view_measured *out, struct error *err);

// boothcal display view: argv[0] is the command's own name.
int view_measure(int argc, char **argv);

#endif
