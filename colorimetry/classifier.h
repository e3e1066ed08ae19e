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
    double spread;              // relative rms of repeated teaching readings a nm, 0..1
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
    double distance;   // greatest lamp_distance of a known lamp, over a third of its spread
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
    double confidence; // 0..1: 1 beyond doubt, 0.5 at a limit or when two lamps tie
    double level;      // live over taught illuminance of a KNOWN lamp (1 = as taught), else 0
    double distance;   // to the nearest taught lamp
};

// How unlike the shape of a live spectrum is to that of a taught one, 0..1: what
// is left of the live one, relative rms from 385 to 735 nm in bands 15 nm wide
// with the weak bands weighted up, after the taught one was fitted to it by
//   level, any;
//   wavelength, up to 0.7 nm (a spectrometer warming up moves its lines);
//   colour temperature, up to 60 K (dimming).
// 0 for equal shapes, 1 when either is dark or not finite. Measured: readings of
// one lamp with 1 % noise a nm, 0.5 nm shift and 50 K give at most 0.005; 15 %
// (in lux) of another lamp or of daylight mixed in gives 0.017 or more, unless
// the other one is of the same kind (two incandescent lamps).
double lamp_distance(const struct spectrum *taught, const struct spectrum *live);

// Greatest distance at which a reading still counts as a lamp that was taught
// with that spread: noise leaves a third of it in a band. threshold: as
// classifier.distance.
double lamp_limit(double threshold, double spread);

// Sets limits (dark 5 lx, distance 0.01, confirmations 2) and forgets state.
void classifier_reset(struct classifier *c);

// Takes one reading (W m-2 nm-1). The verdict changes only after
// `confirmations` readings in a row agree, and every limit gives way by a
// quarter in favour of what is believed already; level follows at once.
struct lamp_belief classifier_update(struct classifier *c, const struct spectrum *irradiance);

#endif
