// SPDX-License-Identifier: Apache-2.0
// The driver of WitMotion inclinometers on Modbus; see witmotion.md. Its
// register maps, open to tests.
#ifndef DRIVERS_WITMOTION_H
#define DRIVERS_WITMOTION_H

#include <stdint.h>

#include "drivers/accelerometer.h"

extern const struct accelerometer_driver witmotion_driver;

enum { WITMOTION_MOST = 32 };

// One row per register map; addresses are Modbus registers.
struct witmotion_map {
    const char *model; // as in accelerometer_models
    int function;      // Modbus function that reads, 3 or 4
    int first, count;  // one request reads all of these, count <= WITMOTION_MOST
    int accel;         // x, y, z follow each other, s16
    double g_per_step;
    int angle; // roll, pitch, yaw follow each other
    int words; // registers of one angle: 1 (s16) or 2 (s32, low word first)
    double deg_per_step;
    int version, serial; // firmware; six registers of two characters
};

const struct witmotion_map *witmotion_map(int model);

// Angle 0, 1, 2 (roll, pitch, yaw) in degrees from the registers first...
double witmotion_angle(const struct witmotion_map *map, const uint16_t *registers, int which);

// Everything of a sample but its time.
void witmotion_decode(const struct witmotion_map *map, const uint16_t *registers, double offset_deg,
                      struct tilt_sample *out);

#endif
