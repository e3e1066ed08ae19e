// SPDX-License-Identifier: Apache-2.0
// Patch sets for characterising a display.
#ifndef CALIBRATION_PATCHES_H
#define CALIBRATION_PATCHES_H

#include <jansson.h>
#include <stdint.h>

#include "base/error.h"
#include "colorimetry/colour.h"
#include "colorimetry/display.h"

struct display_patch {
    struct counts counts;
    struct xyz xyz;   // cd/m2, once measured
    double elapsed_s; // since measuring began, once measured
    int reading;      // index among the bench's readings
};

struct patch_set {
    int count;
    struct display_patch *patches; // owned
};

void patch_set_fini(struct patch_set *set);

// How many patches of each kind.
struct patch_sizes {
    int ramp_steps;  // levels of red, green and blue each, denser near black, and twice as many greys
    int near_black;  // colours below code 16
    int random;      // colours in between, most of them muted
    int white_every; // patches between two whites, >= 1; black recurs half as often
};

// The patches of those sizes in random order; white first, last and every
// white_every patches, with black after every second of them. Deterministic by
// seed. 8-bit codes. Refuses (RANGE) sizes that give no patch.
bool patch_set_characterise(const struct patch_sizes *sizes, uint64_t seed, struct patch_set *out,
                            struct error *err);

// Random colours only, half of them with all channels alike within 20 % of
// full code (near-greys).
bool patch_set_verify(int random, uint64_t seed, struct patch_set *out, struct error *err);

// What the repeated whites and blacks say of the panel while it was measured.
struct patch_drift {
    int whites, blacks;
    double white;            // (largest - least) / mean luminance of the whites
    double white_per_hour;   // relative slope of their luminance
    double white_per_hour_u; // its standard uncertainty, from their scatter
    double black_cdm2;       // largest - least luminance of the blacks
};

struct patch_drift patch_set_drift(const struct patch_set *set);

// .ti3: RGB 0..100, XYZ with Y of the mean white = 100, LUMINANCE_XYZ_CDM2, in
// the order of measuring. white: mean white in cd/m2 (that of the
// characterising set for both files). readings: the bench's, or NULL; where
// every patch has a spectrum of the same wavelengths there, the columns
// SPEC_nnn hold it in mW m-2 sr-1 nm-1, not divided by white.
bool patch_set_save(const struct patch_set *set, const char *path, struct xyz white,
                    const char *instrument, const json_t *readings, struct error *err);

// Mean XYZ of the whites; false when there are none.
bool patch_set_white(const struct patch_set *set, struct xyz *white);

#endif
