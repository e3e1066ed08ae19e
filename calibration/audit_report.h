// SPDX-License-Identifier: Apache-2.0
// An audit written down, and read back as the one before.
#ifndef CALIBRATION_AUDIT_REPORT_H
#define CALIBRATION_AUDIT_REPORT_H

#include <stdio.h>

#include "calibration/audit.h"

// Everything, spectra included; with a blank seal at its end. New reference.
json_t *audit_as_json(const struct audit_facts *facts);

void audit_as_text(const struct audit_facts *facts, FILE *out);

// Writes the sealed JSON, whole or not at all.
bool audit_save(const struct audit_facts *facts, const char *path, struct error *err);

// Reads name, spectrum and places of every lamp back and computes the rest
// anew. Refuses (DATA) a file that was changed since it was sealed, or that is
// no audit. facts are undefined on failure.
bool audit_load(const char *path, struct audit_facts *facts, struct error *err);

#endif
