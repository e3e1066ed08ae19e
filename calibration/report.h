// SPDX-License-Identifier: Apache-2.0
// What follows from a session's facts: uncertainties, the causes of its errors,
// what the display could have reached, what it was made from. report_make
// computes it all; what writes it computes nothing.
#ifndef CALIBRATION_REPORT_H
#define CALIBRATION_REPORT_H

#include <stdio.h>

#include "calibration/budget_booth.h"
#include "calibration/facts.h"
#include "calibration/seal.h"

enum { REPORT_WORST = 5, REPORT_DRAWS = 10000, REPORT_MISSING = 16 };

// The way from the sample to what was read, step by step: CIEDE2000 of each
// step, absolute.
#define REPORT_STEPS(X)                                                                            \
    X(SPECTRAL, "spectral")         /* full spectra -> as rendered */                              \
    X(GAMUT, "gamut")               /* -> what the display reaches */                              \
    X(QUANTISATION, "quantisation") /* -> rounded to codes */                                      \
    X(FLARE, "flare")               /* -> with the reflection that it really has */                \
    X(MODEL, "model")               /* -> as read, less the instrument's part */                   \
    X(INSTRUMENT, "instrument")     /* what the radiometer's own uncertainty accounts for, k = 1 */

enum report_step {
#define X(name, text) STEP_##name,
    REPORT_STEPS(X)
#undef X
        STEPS,
};
const char *report_step_name(enum report_step step);

struct report_patch {
    double floor_absolute, floor_published; // dE00 of the closest colour in gamut; 0 in gamut
    double steps[STEPS];                    // NAN: not computed
};

struct report_lamp {
    bool budgeted; // else no_budget says why not
    char no_budget[256];
    struct booth_light light;
    struct budget measured, shown; // of every patch; see budget.h
    bool split;                    // steps and floors are computed: the display model was there
    struct report_patch patches[FACTS_PATCHES];
    double steps[STEPS];                            // rms over the patches
    int worst[REPORT_WORST], worst_count;           // patches, by de_absolute
    struct summary absolute_out, published_out;     // of the patches out of gamut
    struct summary floor_absolute, floor_published; // likewise
    double black_expected, black_shown;             // luminance of black under the lamp, cd/m2
};

struct report {
    const struct session_facts *facts; // borrowed
    struct uncertainties u;
    char uncertainty_file[512]; // "" = presets
    int draws;
    char settings_sha256[65]; // of the settings as compact JSON with sorted keys
    struct report_lamp lamps[FACTS_LAMPS];
    struct sealed_inputs inputs;
    int missing_count; // files that are no longer there
    char missing[REPORT_MISSING][512];
};

// folder: of the session, whose session.json is listed among the inputs; "" = none. Model,
// maps, measurements and pictures that are no longer where the facts say are
// missing, and what needs them is not computed. Errors: a facts file that
// cannot be read; the settings of uncertainties.
bool report_make(const struct session_facts *facts, const char *folder,
                 const char *uncertainty_file, int draws, struct report *out, struct error *err);
void report_fini(struct report *report);

// ---- written down --------------------------------------------------------------------

// Everything, with every raw reading; ends with the blank of a seal. New
// reference.
json_t *report_as_json(const struct report *report);

// The accuracy table beside the published one, for a terminal.
void report_as_text(const struct session_facts *facts, FILE *out);

// Writes report.json, report.txt, report.html and report.pdf into folder, each
// sealed, each whole or not at all.
bool report_save(const struct report *report, const char *folder, struct error *err);

#endif
