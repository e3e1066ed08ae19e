// SPDX-License-Identifier: Apache-2.0
// The driver of inclinometers on Modbus, WitMotion's and those that the settings
// describe; see witmotion.md. Its register maps, open to tests.
#ifndef DRIVERS_WITMOTION_H
#define DRIVERS_WITMOTION_H

#include "drivers/modbus_map.h"

extern const struct accelerometer_driver witmotion_driver;

// The row of accelerometer_models[model]; NULL for "generic", whose row is
// made of the settings.
const struct modbus_map *witmotion_map(int model);

// The first register of a request that reads both fields, and their number.
int witmotion_first(const struct modbus_map *map);
int witmotion_count(const struct modbus_map *map);

// Angle 0, 1, 2 (roll, pitch, yaw) in degrees from the registers of that request.
double witmotion_angle(const struct modbus_map *map, const uint16_t *registers, int which);

// Everything of a sample but its time from the same.
void witmotion_decode(const struct modbus_map *map, const uint16_t *registers, double offset_deg,
                      struct tilt_sample *out);

#endif
