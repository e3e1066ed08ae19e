// SPDX-License-Identifier: Apache-2.0
// The emulated instruments on their wires: USB2000+ spectrometer (USB), Wii
// remote infrared camera (HID), WT901C-485 inclinometer (Modbus RTU on a pty),
// PR-655 spectroradiometer (serial line on a pty). USB and HID are answered
// below unmodified libusb and hidapi through umockdev; the process must run
// under umockdev-wrapper.
#ifndef SIMULATOR_WIRE_H
#define SIMULATOR_WIRE_H

#include "base/error.h"
#include "simulator/around.h"

#define WIRE_INSTRUMENTS(X)                                                                        \
    X(SPECTROMETER, "spectrometer")                                                                \
    X(INCLINOMETER, "inclinometer")                                                                \
    X(CAMERA, "camera")                                                                            \
    X(RADIOMETER, "radiometer")

enum wire_instrument {
#define X(name, text) WIRE_##name,
    WIRE_INSTRUMENTS(X)
#undef X
        WIRE_COUNT
};

// What can go wrong on a wire; each lasts until WIRE_FINE.
#define WIRE_FAULTS(X)                                                                             \
    X(FINE, "fine")                                                                                \
    X(UNPLUGGED, "unplugged")                                                                      \
    X(SILENT, "silent")   /* replies are dropped */                                                \
    X(GARBAGE, "garbage") /* bytes are random: no sync byte, bad CRC, bad status */                \
    X(SHORT, "short")     /* replies are cut */                                                    \
    X(STALL, "stall")     /* USB stall once, Modbus exception, PR error status */

enum wire_fault {
#define X(name, text) WIRE_##name,
    WIRE_FAULTS(X)
#undef X
};

struct wire_options {
    struct around around;
    const char *run_dir;        // receives symlinks "inclinometer", "radiometer" to the ptys and
                                // "spectrometer.cal", the calibration (nm, uJ/count) of the emulated unit
    const char *serial[WIRE_COUNT]; // each begins with "EMU"
    uint64_t seed;              // of all noise
    double radiometer_hurry;    // divides the radiometer's exposure times, >= 1
    double collector_mm2;       // of the cosine corrector
    double calibration_error;   // relative slope error of spectrometer.cal over 180 nm, 0 = exact
    double camera_pitch_deg;    // of the camera's axis above the horizon, for its own accelerometer
};

struct wire;

// Plugs all four in and starts their threads. NULL with err.
struct wire *wire_start(const struct wire_options *options, struct error *err);

// Any thread.
void wire_set_fault(struct wire *wire, enum wire_instrument instrument, enum wire_fault fault);

// Unplugs everything, joins the threads. Accepts NULL.
void wire_stop(struct wire *wire);

#endif
