// SPDX-License-Identifier: Apache-2.0
#ifndef CALIBRATION_REPORT_WORDS_H
#define CALIBRATION_REPORT_WORDS_H

#include "calibration/document.h"
#include "calibration/report.h"

// Says the whole report to a document, the blank of its seal last.
void report_words(const struct report *report, struct document *d);

// The parts that report_lamps.c says: one lamp.
void report_lamp_words(const struct report *report, int lamp, struct document *d);

#endif
