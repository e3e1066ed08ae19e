// SPDX-License-Identifier: Apache-2.0
// Patch sets for characterising a display.
#ifndef CALIBRATION_PATCHES_H
#define CALIBRATION_PATCHES_H

#include <stdint.h>

#include "base/error.h"
#include "colorimetry/colour.h"
#include "colorimetry/display.h"

struct display_patch {
    struct counts counts;
    struct xyz xyz; // cd/m2, once measured
    int reading;
};

struct patch_set {
    int count;
    struct display_patch *patches; // owned
};

void patch_set_fini(struct patch_set *set);

// Ramps of red, green and blue (ramp_steps levels each, denser near black), of
// grey (twice as many) and `random` colours in between, most of them muted, in
// random order; white first, last and every `white_every` patches; black
// twice. Deterministic by seed. 8-bit codes.
bool patch_set_characterise(int ramp_steps, int random, int white_every, uint64_t seed,
                            struct patch_set *out, struct error *err);

// Random colours only, half of them with all channels alike within 20 % of
// full code (near-greys).
bool patch_set_verify(int random, uint64_t seed, struct patch_set *out, struct error *err);

// Largest relative change of luminance among the repeated whites.
double patch_set_white_drift(const struct patch_set *set);

// .ti3: RGB 0..100, XYZ with Y of the mean white = 100, LUMINANCE_XYZ_CDM2.
// white: mean white in cd/m2 (that of the characterising set for both files).
bool patch_set_save(const struct patch_set *set, const char *path, struct xyz white,
                    const char *instrument, struct error *err);

// Mean XYZ of the whites; false when there are none.
bool patch_set_white(const struct patch_set *set, struct xyz *white);

#endif
