// SPDX-License-Identifier: Apache-2.0
// Spectra as the vendors' own programs write them: SpectraSuite and OceanView
// text, Jaz, CGATS .sp, or plain "nm, value" columns. See replay.md.
#ifndef DRIVERS_VENDOR_FILES_H
#define DRIVERS_VENDOR_FILES_H

#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

#define VENDOR_FORMATS(X)                                                                          \
    X(SPECTRASUITE, "SpectraSuite")                                                                \
    X(OCEANVIEW, "OceanView")                                                                      \
    X(JAZ, "Jaz")                                                                                  \
    X(SP, ".sp")                                                                                   \
    X(COLUMNS, "columns")

enum vendor_format {
#define X(name, text) VENDOR_##name,
    VENDOR_FORMATS(X)
#undef X
};

const char *vendor_format_name(enum vendor_format format);

struct vendor_file {
    char path[512];
    enum vendor_format format;
    char serial[64];    // of the spectrometer, "" = the file names none
    char date[64];      // as it stands in the file, wall clock of its writer; "" = none
    int integration_us; // 0 = not told
    int averaged;       // 0 = not told
    int boxcar;         // half width in pixels, 0
    size_t count;       // >= 2
    double *nm;         // [count] strictly ascending
    double
        *values; // [count] processed; of a unit that no such file tells (.sp divided by its norm)
    // Counts of a Jaz file, [count] each; NULL in others.
    double *dark, *reference, *sample;
};

// Accepts a zeroed one.
void vendor_file_fini(struct vendor_file *file);

// The form is told by the first line. Lines may end in LF, CR LF, CR, even
// mixed; numbers have decimal points, or decimal commas throughout. Refused
// (DATA) naming file and line: a text of another kind, a header without
// data, a cell that is no finite number, points and commas mixed, rows of another width,
// wavelengths that do not ascend, a row count below (or, where the file marks
// its end, other than) what the header promises, a .sp whose header contradicts
// its fields or that holds more than one spectrum. CONFIG or SYSTEM when it cannot be read.
bool vendor_file_load(const char *path, struct vendor_file *out, struct error *err);

// As above from memory; path is only used in errors. Not for .sp.
bool vendor_file_parse(const char *path, const char *text, size_t size, struct vendor_file *out,
                       struct error *err);

#endif
