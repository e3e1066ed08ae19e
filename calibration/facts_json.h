// SPDX-License-Identifier: Apache-2.0
// A session's facts on disk: session.json, which a report is made from.
#ifndef CALIBRATION_FACTS_JSON_H
#define CALIBRATION_FACTS_JSON_H

#include "calibration/facts.h"
#include "calibration/fields.h"

// Tables of struct session_facts, struct lamp_report, struct patch_report, and
// of what stands in several structs.
extern const struct field session_fields[], lamp_fields[], patch_fields[], summary_fields[];

// Writes the file whole or not at all.
bool facts_save(const struct session_facts *facts, const char *path, struct error *err);

// Reads it back; facts_fini frees what it holds. Errors (DATA) name file and
// place.
bool facts_load(const char *path, struct session_facts *facts, struct error *err);
void facts_fini(struct session_facts *facts);

#endif
