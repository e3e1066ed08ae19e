// SPDX-License-Identifier: Apache-2.0
// How lamps render colours: the CIE's rendering indices, and special indices
// of metamerism of sample pairs that match under one lamp and not under another.
#ifndef COLORIMETRY_RENDERING_H
#define COLORIMETRY_RENDERING_H

#include "colorimetry/colour.h"

enum { TEST_COLOURS = 14, TEST_COLOURS_OF_RA = 8 };

// Farther from its reference than this in CIE 1960 u, v, a lamp's indices lose
// their meaning. Source: CIE 13.3-1995 (5.3).
#define RENDERING_FARTHEST 5.4e-3

struct rendering {
    double special[TEST_COLOURS]; // R1..R14: 100 = as under the reference, may be negative
    double general;               // Ra: mean of R1..R8
    double kelvin;                // of the lamp and of its reference
    bool daylight;   // the reference is daylight (from 5000 K), else a Planckian radiator
    double distance; // lamp to reference, CIE 1960 u, v; see RENDERING_FARTHEST
};

// Rendering indices of a lamp (relative power, 1931 observer). The reference
// has the lamp's correlated colour temperature. Errors (RANGE): a dark lamp;
// one without a correlated colour temperature, or above 25000 K.
// Source: CIE 13.3-1995.
bool rendering_of(const struct spectrum *lamp, struct rendering *out, struct error *err);

// Reflectance of test colour 1..14 (index 0..13) on the inner grid.
void test_colour(int index, struct spectrum *out);

// A pair that matches under lamp `matched` is looked at under lamp `other`.
struct metamerism {
    double match_ab;   // dE*ab of the pair under `matched`: 0 for a perfect metamer
    double index_ab;   // special metamerism index: dE*ab under `other`, corrected
    double index_2000; // likewise by CIEDE2000
};

// Special metamerism index, change of illuminant. What the pair differs by
// under `matched` is taken out by scaling b's tristimulus values under `other`
// by the ratios a : b under `matched` (multiplicative correction). The white
// of CIELAB is each lamp's perfect diffuser. Errors (RANGE): a dark lamp, a
// sample that is black to the observer under `matched`.
// Sources: CIE 015:2018 (9.2), DIN 6172:1993 for the correction.
bool metamerism_of(const struct spectrum *a, const struct spectrum *b,
                   const struct spectrum *matched, const struct spectrum *other,
                   enum observer observer, struct metamerism *out, struct error *err);

#endif
