// SPDX-License-Identifier: Apache-2.0
// Whether a proof keeps to tolerances under the lamp that is on: the chart
// against the physical samples, patches of counts against the display model,
// white's luminance; each figure with its uncertainty as a guard band.
#ifndef CALIBRATION_VERIFY_H
#define CALIBRATION_VERIFY_H

#include "calibration/report.h"

// Name, what it is, preset tolerance; dE00 of in-gamut patches unless it says
// otherwise.
#define VERIFY_CRITERIA(X)                                                                         \
    X(PUBLISHED_MEAN, "published-mean", "chart, as published, mean dE00", 1)                       \
    X(PUBLISHED_MAX, "published-max", "chart, as published, max dE00", 3)                          \
    X(ABSOLUTE_MEAN, "absolute-mean", "chart, absolute, mean dE00", 1.5)                           \
    X(ABSOLUTE_MAX, "absolute-max", "chart, absolute, max dE00", 4)                                \
    X(DISPLAY_MEAN, "display-mean", "patches of counts against the model, mean dE00", 1)           \
    X(DISPLAY_MAX, "display-max", "patches of counts against the model, max dE00", 3)              \
    X(WHITE, "white", "luminance of white, %", 2)

enum verify_name {
#define X(name, option, text, preset) VERIFY_##name,
    VERIFY_CRITERIA(X)
#undef X
        CRITERIA,
};

struct verify_criterion {
    const char *option, *text;
    bool asked;             // counts towards the verdict
    bool computed;          // there was something to judge
    double tolerance;       // > 0
    double value, expanded; // U, k = 2
    enum verdict verdict;
};

// A patch of counts under the lamp.
struct verify_patch {
    struct counts counts;
    struct xyz predicted, measured; // cd/m2, with the screen's reflection
    double de00, u;                 // absolute; k = 1
};

enum { VERIFY_PATCHES = 100 };

struct verification {
    const struct session_facts *facts; // of one lamp
    const struct report *report;       // made from them
    int patch_count;
    struct verify_patch patches[VERIFY_PATCHES];
    struct verify_criterion criteria[CRITERIA];
    enum verdict verdict; // of those that count: fail before undecided before pass
};

// Every criterion at its preset; none is asked for.
void verify_init(struct verification *v);

// Asks for a criterion by its option's name; false when there is none such.
bool verify_ask(struct verification *v, const char *option, double tolerance);

// Fills de00 and u of the patches and every criterion. white: of CIELAB, cd/m2.
// When none is asked for, those of PUBLISHED_* are. Errors (DATA): a criterion
// that is asked for and cannot be computed, with the reason.
bool verify_judge(struct verification *v, struct xyz white, struct error *err);

// New reference; ends with the blank of a seal.
json_t *verify_as_json(const struct verification *v);
void verify_as_text(const struct verification *v, FILE *out);

#endif
