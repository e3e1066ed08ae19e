// SPDX-License-Identifier: Apache-2.0
// Where in its registers a Modbus inclinometer keeps acceleration and angle,
// and what the numbers mean. One row per family; one row from the settings.
#ifndef DRIVERS_MODBUS_MAP_H
#define DRIVERS_MODBUS_MAP_H

#include <stdint.h>

#include "drivers/accelerometer.h"

enum modbus_format { MODBUS_S16, MODBUS_U16, MODBUS_S32, MODBUS_U32, MODBUS_FLOAT };

extern const char *const modbus_formats[];     // "s16", ..., NULL
extern const char *const modbus_word_orders[]; // "high-first", "low-first", NULL

enum { MODBUS_MAP_WORDS_MOST = 32 };

// Values that follow each other from one register on.
struct modbus_field {
    int first; // register, -1 = the sensor has none
    int count; // values, 1..3
    enum modbus_format format;
    bool low_first;  // of two registers the low word comes first
    double scale;    // unit per count
    double offset;   // counts, added before scaling
    double sentinel; // counts that say "no reading", NAN = none
};

struct modbus_map {
    const char *model;         // as in accelerometer_models
    int function;              // Modbus function that reads, 3 or 4
    bool together;             // one request reads both fields and what lies between
    struct modbus_field accel; // x, y, z, m/s2
    struct modbus_field angle; // the first one is the tilt, deg
    int axes[3];               // screen's x, y, z as +-(1 + index of the sensor's axis)
    int version;               // register of the firmware version, -1 = none
    int serial;                // first of six registers of two characters, -1 = none
};

// Registers that a field takes, 0 when the sensor has none.
int modbus_field_words(const struct modbus_field *field);

// The which-th value from the registers field->first...; false for the
// sentinel and for what is no number.
bool modbus_field_value(const struct modbus_field *field, const uint16_t *registers, int which,
                        double *value);

// Everything of a sample but its time. The registers are those from
// accel.first and angle.first on; NULL for a field that the sensor lacks.
void modbus_decode(const struct modbus_map *map, const uint16_t *accel, const uint16_t *angle,
                   double offset_deg, struct tilt_sample *out);

// The row "generic" as the settings define it. CONFIG when it names no
// register, one beyond 65535, or axes that are no axes.
bool modbus_map_generic(const struct accelerometer_options *options, struct modbus_map *out,
                        struct error *err);

#endif
