// SPDX-License-Identifier: Apache-2.0
// The instruments behind the emulated spotread: what each makes of light.
#ifndef SIMULATOR_SPOTREAD_METER_H
#define SIMULATOR_SPOTREAD_METER_H

#include "colorimetry/colour.h"
#include "simulator/model_noise.h"

enum { SPOTREAD_BANDS_MOST = 471 };

// enum, name in a scenario.
#define SPOTREAD_KINDS(X)                                                                          \
    X(SPECBOS, "specbos") /* 380-780 nm in 1 nm, no calibration */                                 \
    X(I1PRO, "i1pro")     /* 380-730 nm in 10 nm, wants a dark calibration first */                \
    X(I1D3, "i1d3")       /* XYZ only */

enum spotread_kind {
#define X(name, text) SPOTREAD_##name,
    SPOTREAD_KINDS(X)
#undef X
};

// What is known of a kind.
struct spotread_meter {
    const char *name;
    double first_nm, last_nm;
    int bands, fine_bands; // 0 = it gives none
    double bandpass_nm;    // of the bands that are not fine
    bool dark_first;       // wants a calibration in the dark
    bool has_switch, has_target;
    double least_cdm2, most_cdm2;
    const char *too_weak, *too_bright, *misread; // how it says so
};

const struct spotread_meter *spotread_meter(enum spotread_kind kind);

// Equal steps. count 0 = the instrument gives none.
struct spotread_bands {
    double first_nm, last_nm;
    int count;
    double mw[SPOTREAD_BANDS_MOST]; // mW m-2 sr-1 nm-1
};

struct spotread_reading {
    struct spotread_bands bands;
    struct xyz xyz; // cd/m2, not below 0
    struct lab lab; // against D50 of 100
};

// How long it exposes to light like this (W m-2 sr-1 nm-1).
double spotread_exposure_s(const struct spectrum *radiance);

// A reading of the mean light, factor times as much, with the noise of one.
void spotread_measure(const struct spotread_meter *meter, bool fine, enum observer observer,
                      struct noise *noise, const struct spectrum *radiance, double factor,
                      struct spotread_reading *out);

static inline double spotread_band_nm(const struct spotread_bands *bands, int i)
{
    return bands->first_nm + (bands->last_nm - bands->first_nm) * i / (bands->count - 1);
}

#endif
