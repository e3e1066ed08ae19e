// SPDX-License-Identifier: Apache-2.0
// Where a proof's error comes from, and what the display could have shown.
#ifndef CALIBRATION_REPORT_STEPS_H
#define CALIBRATION_REPORT_STEPS_H

#include "calibration/report.h"

// Fills floors, steps and black of every patch of a lamp; lamp->measured counts
// for the instrument's step when it was budgeted.
void report_steps(const struct session_facts *facts, const struct lamp_report *from,
                  const struct display_model *model, struct report_lamp *lamp);

// d screen / d code of red, green, blue, cd/m2 for one code, towards the eye.
struct mat3 report_by_code(const struct lamp_report *from, const struct display_model *model,
                           struct counts counts, int bits);

#endif
