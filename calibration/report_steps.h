// SPDX-License-Identifier: Apache-2.0
// Where a proof's error comes from, and what the display could have shown.
#ifndef CALIBRATION_REPORT_STEPS_H
#define CALIBRATION_REPORT_STEPS_H

#include "calibration/report.h"
#include "colorimetry/display_uncertainty.h"

// Fills floors, steps and black of every patch of a lamp; lamp->measured counts
// for the instrument's step when it was budgeted.
void report_steps(const struct session_facts *facts, const struct lamp_report *from,
                  const struct display_model *model, struct report_lamp *lamp);

// What the models say that reaches the eye at counts as they are, with the
// screen's own reflection.
struct xyz report_reached(const struct session_facts *facts, const struct lamp_report *from,
                          const struct display_model *model, struct counts counts);

// d screen / d code of red, green, blue, cd/m2 for one code, towards the eye.
struct mat3 report_by_code(const struct lamp_report *from, const struct display_model *model,
                           struct counts counts, int bits);

// Shifts of the patches' light towards the eye by the display model's own
// uncertainty: *modes of [patch_count], one standard deviation each, malloc'd;
// NULL and 0 where the model's file says nothing of it. False: out of memory.
bool report_display_modes(const struct lamp_report *from, const struct display_model *model,
                          const struct display_uncertainty *uncertainty, int *modes,
                          struct xyz **out, struct error *err);

#endif
