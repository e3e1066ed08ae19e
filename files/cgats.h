// SPDX-License-Identifier: Apache-2.0
// CGATS text files, the form colour instruments speak: .ti3 (measured patches),
// .sp (spectra), .cal. Source: ArgyllCMS documentation of its formats.
#ifndef FILES_CGATS_H
#define FILES_CGATS_H

#include <stdio.h>

#include "files/table.h"

struct cgats_keyword {
    char *name, *value;
    int line;
};

// One table of a file. Non-numeric cells (SAMPLE_ID, SAMPLE_LOC, SAMPLE_NAME,
// STRING) are NAN in table.values; SAMPLE_ID, else SAMPLE_NAME, is the label.
struct cgats {
    char identifier[32]; // "CTI3", "SPECT", "CGATS.17"
    size_t keyword_count;
    struct cgats_keyword *keywords;
    struct table table;
};

void cgats_fini(struct cgats *file);

// Reads the first table; later tables (a .ti3's CAL) are checked for form and
// left out, as are foreign BEGIN_X..END_X blocks. Rows may wrap. Lines end in LF,
// CR LF, or CR alone throughout. Bytes that are not UTF-8 come back as '?' in
// keyword values and labels. Refuses (DATA),
// naming file, line, key and what was expected: an identifier that is missing,
// NUMBER_OF_FIELDS or NUMBER_OF_SETS that contradicts the data (either may be
// missing), a duplicate field, a cell that is no finite number, a keyword with
// two values, a second table in a SPECT file, more than 4096 fields or keywords.
bool cgats_load(const char *path, struct cgats *file, struct error *err);

// As cgats_load, requiring an identifier such as "CTI3".
bool cgats_load_as(const char *path, const char *identifier, struct cgats *file, struct error *err);

// Value of a keyword or NULL.
const char *cgats_keyword(const struct cgats *file, const char *name);

// The line that a keyword stands on, 0 when it is missing.
int cgats_line(const struct cgats *file, const char *name);

// A keyword as count finite numbers; error names file, line and key.
bool cgats_numbers(const struct cgats *file, const char *name, double *values, size_t count,
                   struct error *err);

// Writes identifier, keywords (non-standard ones declared) and the table;
// labels, if any, become SAMPLE_ID. NUMBER_OF_FIELDS and NUMBER_OF_SETS are not
// keywords here: they follow from the table. Numbers are written so that they
// read back to the same double. Refuses (RANGE) what cgats_load would refuse.
bool cgats_save(const char *path, const struct cgats *file, struct error *err);

#endif
