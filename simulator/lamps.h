// SPDX-License-Identifier: Apache-2.0
// The emulated lamps: a spectrum that is the same all over the ceiling, a
// luminance image of that ceiling, and how the light comes up from cold.
#ifndef SIMULATOR_LAMPS_H
#define SIMULATOR_LAMPS_H

#include "colorimetry/spectrum.h"
#include "simulator/ceiling.h"

struct lamp {
    char name[SCENARIO_NAME_SIZE];
    struct spectrum per_lux;    // W m-2 nm-1 for 1 lx (W m-2 sr-1 nm-1 for 1 cd/m2)
    struct ceiling_image image; // cd/m2 at level 1, warm
    double warmup_drop, warmup_s;
};

// Makes the lamp so that it gives settings->lux at `centre` on a surface of
// unit normal `normal`. Errors name the lamp.
bool lamp_make(const struct scenario *scenario, const struct scenario_lamp *settings,
               struct vec3 centre, struct vec3 normal, struct lamp *out, struct error *err);

// Accepts a zeroed lamp.
void lamp_fini(struct lamp *lamp);

// Light over that of the warm lamp, on_s seconds after a cold start.
double lamp_warmth(const struct lamp *lamp, double on_s);

// A lamp's relative power by CIE name, or from a file (a text with '/', ".csv"
// or ".sp" in it): CSV "nm, power" or a CGATS .sp. Refused: unsorted or
// negative numbers, fields of a .sp that its header contradicts.
bool lamp_spectrum_load(const char *name_or_path, struct spectrum *out, struct error *err);

#endif
