// SPDX-License-Identifier: Apache-2.0
// Faults of the inclinometer, over Modbus RTU and over Modbus TCP.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/faults.h"

static const double TRUE_TILT_DEG = 30, TILT_DEG = 0.1; // its noise and steps

static struct row rows[] = {
    {"silent", .effect = MUTE, .lasts_s = 12, .name = "silent-for-long",
     .says = "no answer from unit 80"},
    {"unplugged", .effect = GOES, .says = "No such file"},
    {"forbidden", .effect = GOES, .says = "70-boothd.rules", .first = "unplugged"},
    {"silent", .effect = MUTE, .says = "no answer from unit 80"},
    {"garbage", .effect = MUTE},
    {"short", .effect = MUTE},
    {"stall", .effect = MUTE, .says = "is busy"},
    {"bad-crc", .effect = MUTE, .says = "Invalid CRC"},
    {"wrong-unit", .effect = MUTE, .says = "not of unit 80"},
    {"late", .effect = MUTE},
    {"dropped", .effect = RIDES},
    {"illegal-function", .effect = MUTE, .says = "Illegal function"},
    {"illegal-address", .effect = MUTE, .says = "Illegal data address"},
    {"illegal-value", .effect = MUTE, .says = "Illegal data value"},
    {"device-failure", .effect = MUTE, .says = "failure"},
};

static struct row tcp_rows[] = {
    {"half-open", .effect = MUTE, .lasts_s = 12, .name = "half-open-for-long", .says = "no answer"},
    {"unplugged", .effect = GOES, .says = "refused"},
    {"silent", .effect = MUTE, .says = "no answer"},
    {"garbage", .effect = MUTE},
    {"short", .effect = MUTE},
    {"bad-crc", .effect = MUTE, .says = "another request"},
    {"wrong-unit", .effect = MUTE, .says = "unit 81 answered"},
    {"late", .effect = MUTE, .says = "no answer"},
    {"dropped", .effect = RIDES},
    {"half-open", .effect = MUTE, .says = "no answer"},
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
                                       .rows = rows,
                                       .count = sizeof rows / sizeof *rows,
                                       .value = value,
                                       .is_true = is_true};

const struct kind tcp_kind = {.label = "tcp-inclinometer",
                              .instrument = "inclinometer",
                              .name = "accelerometer",
                              .runs = "running",
                              .rows = tcp_rows,
                              .count = sizeof tcp_rows / sizeof *tcp_rows,
                              .value = value,
                              .is_true = is_true};
