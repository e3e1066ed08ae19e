// SPDX-License-Identifier: Apache-2.0
// Session facts written down: JSON, text, self-contained HTML. None computes.
#ifndef CALIBRATION_REPORT_H
#define CALIBRATION_REPORT_H

#include <stdio.h>

#include "calibration/facts.h"

// Everything, with every raw reading. New reference.
json_t *report_as_json(const struct session_facts *facts);

// The accuracy table beside the published one, for a terminal.
void report_as_text(const struct session_facts *facts, FILE *out);

// One file that opens offline and prints well: spectra, chromaticities, bars a
// patch, tables, settings, raw readings; pictures are embedded.
bool report_as_html(const struct session_facts *facts, FILE *out, struct error *err);

// Writes report.json and report.html into folder, each whole or not at all.
bool report_save(const struct session_facts *facts, const char *folder, struct error *err);

#endif
