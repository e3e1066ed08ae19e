// SPDX-License-Identifier: Apache-2.0
// Faults of the inclinometer, over Modbus RTU and over Modbus TCP.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/faults.h"

static const double TRUE_TILT_DEG = 30, TILT_DEG = 0.1; // its noise and steps

static struct row rows[] = {
    {"silent", .effect = MUTE, .lasts_s = 20, .name = "silent-for-long"},
    {"unplugged", .effect = GOES},
    {"forbidden", .effect = GOES, .says = "udev rules", .first = "unplugged"},
    {"silent", .effect = MUTE},
    {"garbage", .effect = MUTE},
    {"short", .effect = MUTE},
    {"stall", .effect = MUTE},
    {"bad-crc", .effect = MUTE},
    {"wrong-unit", .effect = MUTE},
    {"late", .effect = MUTE},
    {"dropped", .effect = RIDES},
    {"illegal-function", .effect = MUTE},
    {"illegal-address", .effect = MUTE},
    {"illegal-value", .effect = MUTE},
    {"device-failure", .effect = MUTE},
};

static struct row tcp_rows[] = {
    {"half-open", .effect = MUTE, .lasts_s = 20, .name = "half-open-for-long"},
    {"unplugged", .effect = GOES},
    {"silent", .effect = MUTE},
    {"garbage", .effect = MUTE},
    {"short", .effect = MUTE},
    {"bad-crc", .effect = MUTE},
    {"wrong-unit", .effect = MUTE},
    {"late", .effect = MUTE},
    {"dropped", .effect = RIDES},
    {"half-open", .effect = MUTE},
};

static void value(const json_t *status, double v[3], double *held_ms)
{
    v[0] = dig_real(status, "tilt.tilt_deg");
    *held_ms = dig_real(status, "tilt.age_ms");
}

static bool is_true(const struct lane *lane, const double v[3])
{
    (void)lane;
    return fabs(v[0] - TRUE_TILT_DEG) < TILT_DEG;
}

const struct kind inclinometer_kind = {.label = "inclinometer",
                                       .instrument = "inclinometer",
                                       .name = "accelerometer",
                                       .runs = "running",
                                       .opens_ms = 500,
                                       .rows = rows,
                                       .count = sizeof rows / sizeof *rows,
                                       .value = value,
                                       .is_true = is_true};

const struct kind tcp_kind = {.label = "tcp-inclinometer",
                              .instrument = "inclinometer",
                              .name = "accelerometer",
                              .runs = "running",
                              .opens_ms = 500,
                              .rows = tcp_rows,
                              .count = sizeof tcp_rows / sizeof *tcp_rows,
                              .value = value,
                              .is_true = is_true};
