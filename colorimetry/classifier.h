// SPDX-License-Identifier: Apache-2.0
// Which of the taught lamps is on: by the shape of the spectrum, never by its
// level, so that a dimmed lamp stays itself.
#ifndef COLORIMETRY_CLASSIFIER_H
#define COLORIMETRY_CLASSIFIER_H

#include "colorimetry/spectrum.h"

enum { CLASSIFIER_LAMPS_MOST = 32 };

struct taught_lamp {
    char name[64];
    struct spectrum irradiance; // as taught, W m-2 nm-1
    double spread;              // relative rms of repeated teaching readings, 0..1
};

enum lamp_verdict {
    LAMP_NONE,    // dark
    LAMP_KNOWN,   // index says which
    LAMP_UNKNOWN, // light, but no taught lamp, or a mixture
};

struct classifier {
    int count;
    struct taught_lamp lamps[CLASSIFIER_LAMPS_MOST];
    double dark_lux;   // illuminance below which all is dark
    double distance;   // greatest shape distance of a known lamp, see lamp_distance
    int confirmations; // equal readings in a row before the verdict changes, >= 1
    // running state
    enum lamp_verdict verdict;
    int index;
    int candidate_count;
    enum lamp_verdict candidate;
    int candidate_index;
};

// What is believed after a reading.
struct lamp_belief {
    enum lamp_verdict verdict;
    int index;         // of a KNOWN lamp, else -1
    double confidence; // 0..1: 1 at distance 0, 0.5 at the limit or when two lamps tie
    double level;      // live over taught illuminance of a KNOWN lamp (1 = as taught), else 0
    double distance;   // to the nearest taught lamp
};

// Normalised spectral distance 0..2 between two spectra's shapes: the rms
// difference after binning to 10 nm and scaling both to equal luminous sum,
// relative to the rms of the first. 0 for equal shapes.
double lamp_distance(const struct spectrum *a, const struct spectrum *b);

// Sets limits (dark 5 lx, distance 0.10, confirmations 2) and forgets state.
void classifier_reset(struct classifier *c);

// Takes one reading (W m-2 nm-1). The verdict changes only after
// `confirmations` readings in a row agree; level follows at once.
struct lamp_belief classifier_update(struct classifier *c, const struct spectrum *irradiance);

#endif
