// SPDX-License-Identifier: Apache-2.0
// Faults of the spectrometer, and of one of two chosen by its serial number.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/faults.h"

static const double LUX = 0.08; // of it: the lamp warms up by 2 %, the level is smoothed

static struct row rows[] = {
    {"silent", .effect = MUTE, .lasts_s = 12, .name = "silent-for-long",
     .says = "no answer in time"},
    {"unplugged", .effect = GOES, .says = "no spectrometer"},
    {"pulled-in-command", .effect = GOES, .says = "no spectrometer"},
    {"pulled-in-spectrum", .effect = GOES, .says = "no spectrometer"},
    {"moved", .effect = BLINKS},
    {"blank", .effect = GOES, .says = "its firmware did not load"},
    {"forbidden", .effect = GOES, .says = "70-boothd.rules", .first = "unplugged"},
    {"stall", .effect = RIDES},
    {"short", .effect = MUTE, .says = "bytes instead of"},
    {"silent", .effect = MUTE, .says = "no answer in time"},
    {"garbage", .effect = MUTE},
    {"no-sync", .effect = MUTE, .says = "no answer in time"},
    {"bad-sync", .effect = MUTE, .says = "ends with 96 instead of 69"},
    {"out-of-step", .effect = MUTE, .says = "1 bytes instead of 4097"},
    {"other-pixels", .effect = MUTE, .says = "2049 bytes instead of 4097"},
    {"overflow", .effect = MUTE, .says = "more bytes than asked for"},
    {"deaf", .effect = RIDES},
    {"deaf", .effect = RIDES, .name = "deaf-in-less-light", .light_before = 1, .light = 0.25},
    {"deaf", .effect = MUTE, .name = "deaf-in-more-light", .light_before = 0.25, .light = 1,
     .says = "integration time is"},
};

static struct row second_rows[] = {
    {"unplugged", .effect = RIDES, .name = "other-unplugged", .on = "spectrometer"},
    {"unplugged", .effect = GOES, .says = "EMU2P0002"},
};

static void value(const json_t *status, double v[3], double *held_ms)
{
    v[0] = dig_real(status, "lamp.lux");
    *held_ms = dig_real(status, "instruments.spectrometer.age_ms");
}

static bool is_true(const struct lane *lane, const double v[3])
{
    return fabs(v[0] / (lane->truth[0] * lane->light) - 1) < LUX;
}

const struct kind spectrometer_kind = {.label = "spectrometer",
                                       .instrument = "spectrometer",
                                       .name = "spectrometer",
                                       .runs = "running",
                                       .enumerates_ms = 2000,
                                       .rows = rows,
                                       .count = sizeof rows / sizeof *rows,
                                       .value = value,
                                       .is_true = is_true};

const struct kind second_spectrometer_kind = {.label = "second-spectrometer",
                                              .instrument = "spectrometer2",
                                              .name = "spectrometer",
                                              .runs = "running",
                                              .enumerates_ms = 2000,
                                              .rows = second_rows,
                                              .count = sizeof second_rows / sizeof *second_rows,
                                              .value = value,
                                              .is_true = is_true};
