// SPDX-License-Identifier: Apache-2.0
// What becomes of a fitted geometry: printed, written into a file, or made a new
// version of the store; and what boothcal tilt and tracker share for it.
#ifndef CALIBRATION_GEOMETRY_KEEP_H
#define CALIBRATION_GEOMETRY_KEEP_H

#include <jansson.h>

#include "config/geometry.h"
#include "config/store.h"

// What both commands are told.
struct geometry_options {
    const char *config, *socket, *booth; // of the bench
    const char *in, *keep;               // file of what was measured; where to write it
    const char *out;                     // file for the geometry, NULL = none
    bool store, json;
};

// Takes an option that both have, by its letter: c config, s socket, b booth,
// f in, k keep, o out, S store, j json. value is borrowed. False for any other.
bool geometry_take_option(int letter, const char *value, struct geometry_options *out);

// One found value of a report.
struct geometry_value {
    const char *name, *unit;
    double value, uncertainty; // expanded, k = 2; 0 = kept as it was
};

// Makes sure, before anything is measured, that the store can take a new version.
bool geometry_can_store(const struct booth_settings *booth, struct error *err);

// Takes rows, uncertainties and origin of found over those of old: with
// stand, the stand and inclinometer part of them, else the tracker's.
void geometry_merge(struct geometry *old, const struct geometry *found, bool stand);

// Writes found into path, keeping what another fit left there.
bool geometry_keep_in_file(const char *path, const struct geometry *found, bool stand,
                           struct error *err);

// Makes it a new version of the store, based on the one in force; its validity
// stays that one's. *number receives the version.
bool geometry_keep_in_store(const struct booth_settings *booth, const struct geometry *found,
                            bool stand, const char *note, int *number, struct error *err);

// Places are kept to the micrometre, angles to the ten-thousandth of a degree.
double geometry_rounded(double value, const char *unit);

// Does what the options ask for with found, and says it: on standard output, or
// into report (with json). Returns the exit code.
int geometry_deliver(const struct geometry_options *options, const struct booth_settings *booth,
                     const struct geometry *found, bool stand, const char *warning, json_t *report);

// A table of values, and the same for a report.
void geometry_values_print(const struct geometry_value *values, int count);
json_t *geometry_values_json(const struct geometry_value *values, int count);

// Those of found that the settings name themselves, so that boothd will not
// take them from the store: "stand.hinge_m, ...", "" = none.
void geometry_overruled(const struct booth_settings *booth, const struct geometry *found,
                        char *text, size_t size);

#endif
