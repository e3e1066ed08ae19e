// SPDX-License-Identifier: Apache-2.0
// The emulated still camera's sensor: from light to counts.
#ifndef SIMULATOR_SENSOR_H
#define SIMULATOR_SENSOR_H

#include "files/png.h"
#include "simulator/chance.h"
#include "simulator/scenario.h"

// How counts follow the share of the full well, 0..1 -> 0..1.
#define SENSOR_RESPONSES(X)                                                                        \
    X(FILM, "film")     /* a steep toe and a long shoulder, as cameras develop */                  \
    X(LINEAR, "linear") /* raw */

enum sensor_response {
#define X(name, text) RESPONSE_##name,
    SENSOR_RESPONSES(X)
#undef X
};

// Film: 1.8 x^0.6 / (x^0.6 + 0.8), the form in which photoreceptors saturate
// (Naka, Rushton 1966).
double sensor_response(enum sensor_response response, double share);

struct sensor {
    const struct scenario_ceiling_camera *settings; // outlives the sensor
    double *dark_e_s; // [height_px][width_px], owned: electrons a second without light
};

// Dark currents are drawn from seed: alike for all pixels but the hot ones,
// which have 100 to 2000 times as much.
bool sensor_init(struct sensor *sensor, const struct scenario_ceiling_camera *settings, int seed,
                 struct error *err);
void sensor_fini(struct sensor *sensor); // accepts a zeroed one

// One frame. light: cd/m2 at each pixel, falloff included,
// [channels][height_px][width_px], or NULL for a capped lens. A pixel collects
// sensitivity x light x exposure_s electrons and its dark current's; adds the
// noise of their number (variance = number) and that of reading; ends at the
// full well; and is counted through the response. channels is 1 or 3.
bool sensor_expose(const struct sensor *sensor, const double *light, int channels,
                   double exposure_s, struct chance *chance, struct picture *out,
                   struct error *err);

#endif
