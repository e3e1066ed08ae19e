// SPDX-License-Identifier: Apache-2.0
// The emulated instruments on their wires: spectrometer of the USB2000+'s
// family, perhaps two (USB), Wii remote infrared camera (HID), WitMotion
// inclinometer (Modbus RTU on a pty, or TCP), PR-655 spectroradiometer (serial
// line on a pty), perhaps opentrack (UDP), and the instrument of an emulated
// spotread, which is a process of its own (spotread_link.h). USB and HID are answered
// below unmodified libusb and hidapi through umockdev; the process must run
// under umockdev-wrapper.
#ifndef SIMULATOR_WIRE_H
#define SIMULATOR_WIRE_H

#include <stdbool.h>

#include "base/error.h"
#include "simulator/around.h"
#include "simulator/model_lapse.h"
#include "simulator/model_ooi_kind.h"
#include "simulator/model_witmotion.h"

#define WIRE_INSTRUMENTS(X)                                                                        \
    X(SPECTROMETER, "spectrometer")                                                                \
    X(INCLINOMETER, "inclinometer")                                                                \
    X(CAMERA, "camera")                                                                            \
    X(RADIOMETER, "radiometer")                                                                    \
    X(SPECTROMETER_2, "spectrometer2")                                                             \
    X(OPENTRACK, "opentrack")                                                                      \
    X(SPOTREAD, "spotread")

enum wire_instrument {
#define X(name, text) WIRE_##name,
    WIRE_INSTRUMENTS(X)
#undef X
        WIRE_COUNT
};

// Which wires know a fault: bits.
enum {
    WIRE_ON_USB = 1 << WIRE_SPECTROMETER | 1 << WIRE_SPECTROMETER_2,
    WIRE_ON_MODBUS = 1 << WIRE_INCLINOMETER,
    WIRE_ON_HID = 1 << WIRE_CAMERA,
    WIRE_ON_SERIAL = 1 << WIRE_RADIOMETER,
    WIRE_ON_UDP = 1 << WIRE_OPENTRACK,
    WIRE_ON_PROCESS = 1 << WIRE_SPOTREAD,
    WIRE_ON_BYTES = WIRE_ON_USB | WIRE_ON_MODBUS | WIRE_ON_HID | WIRE_ON_SERIAL | WIRE_ON_UDP,
    WIRE_ON_ALL = WIRE_ON_BYTES | WIRE_ON_PROCESS,
    WIRE_ON_DEVICES = WIRE_ON_ALL & ~WIRE_ON_UDP,
    WIRE_ON_RADIOMETERS = WIRE_ON_SERIAL | WIRE_ON_PROCESS,
};

// What can go wrong on a wire; each lasts until WIRE_FINE. See wires.md for
// what each does.
#define WIRE_FAULTS(X)                                                                             \
    X(FINE, "fine", WIRE_ON_ALL)                                                                   \
    X(UNPLUGGED, "unplugged", WIRE_ON_ALL)                                                         \
    X(SILENT, "silent", WIRE_ON_ALL)   /* replies are dropped */                                   \
    X(GARBAGE, "garbage", WIRE_ON_BYTES) /* bytes are random: no sync, bad CRC, bad status */      \
    X(SHORT, "short", WIRE_ON_BYTES)     /* replies are cut */                                     \
    X(STALL, "stall", WIRE_ON_DEVICES) /* USB stall once, Modbus exception, PR error status */     \
    X(NO_SYNC, "no-sync", WIRE_ON_USB)         /* spectra end before the sync byte */              \
    X(BAD_SYNC, "bad-sync", WIRE_ON_USB)       /* spectra end with another byte */                 \
    X(OUT_OF_STEP, "out-of-step", WIRE_ON_USB) /* a stale sync byte comes before each spectrum */  \
    X(OTHER_PIXELS, "other-pixels", WIRE_ON_USB) /* spectra have half as many pixels */            \
    X(OVERFLOW, "overflow", WIRE_ON_USB)         /* packets are longer than asked for (babble) */  \
    X(DEAF, "deaf", WIRE_ON_USB)                 /* integration times are silently ignored */      \
    X(PULLED_IN_COMMAND, "pulled-in-command", WIRE_ON_USB)   /* goes with the next command */      \
    X(PULLED_IN_SPECTRUM, "pulled-in-spectrum", WIRE_ON_USB) /* goes within the next spectrum */   \
    X(MOVED, "moved", WIRE_ON_USB) /* at once: pulled and plugged again at the other bus */        \
    X(BLANK, "blank", WIRE_ON_USB) /* comes back without its firmware, as 04B4:8613 */             \
    X(FORBIDDEN, "forbidden", WIRE_ON_DEVICES)               /* opening it fails with EACCES */    \
    X(FLOOD, "flood", WIRE_ON_HID | WIRE_ON_UDP) /* fifty reports where there was one */           \
    X(WRONG_REPORT, "wrong-report", WIRE_ON_HID) /* reports of another kind */                     \
    X(BAD_CRC, "bad-crc", WIRE_ON_MODBUS)                                                          \
    X(WRONG_UNIT, "wrong-unit", WIRE_ON_MODBUS)  /* another device answers */                      \
    X(LATE, "late", WIRE_ON_MODBUS)              /* answers come 2 s late */                       \
    X(DROPPED, "dropped", WIRE_ON_MODBUS)        /* every second answer is lost */                 \
    X(HALF_OPEN, "half-open", WIRE_ON_MODBUS)    /* TCP: connections made until its end are dead */\
    X(BAD_FUNCTION, "illegal-function", WIRE_ON_MODBUS) /* exceptions 01, 02, 03, 04 */            \
    X(BAD_ADDRESS, "illegal-address", WIRE_ON_MODBUS)                                              \
    X(BAD_VALUE, "illegal-value", WIRE_ON_MODBUS)                                                  \
    X(DEVICE_FAILURE, "device-failure", WIRE_ON_MODBUS)                                            \
    X(WEAK_LIGHT, "weak-light", WIRE_ON_RADIOMETERS) /* too little light for it */                 \
    X(OVERLOAD, "overload", WIRE_ON_RADIOMETERS) /* too much */                                    \
    X(DRIFT, "drift", WIRE_ON_RADIOMETERS)     /* readings creep upwards */                        \
    X(MISREAD, "misread", WIRE_ON_RADIOMETERS) /* a reading now and then is false */               \
    X(NOT_A_NUMBER, "not-a-number", WIRE_ON_UDP) /* a value is NaN or infinite */                  \
    X(FROZEN, "frozen", WIRE_ON_UDP)             /* the last datagram again and again */           \
    X(WRONG_SIZE, "wrong-size", WIRE_ON_UDP)                                                       \
    X(OUT_OF_RANGE, "out-of-range", WIRE_ON_UDP) /* a value is impossible */

enum wire_fault {
#define X(name, text, wires) WIRE_##name,
    WIRE_FAULTS(X)
#undef X
};

struct wire_options {
    struct around around;
    const char *run_dir;        // receives symlinks "inclinometer", "radiometer" to the ptys and
                                // "spectrometer.cal", the calibration (nm, uJ/count) of the emulated unit
    const char *serial[WIRE_COUNT]; // each begins with "EMU"; no second spectrometer when NULL
                                    // or ""; its calibration is "spectrometer2.cal"
    enum ooi_name model, model_2;   // of the spectrometers; 0 = USB2000+
    enum witmotion_map inclinometer_map;
    bool inclinometer_tcp;      // Modbus TCP at 127.0.0.1 instead of RTU; the port's number is left
                                // in the file "inclinometer.port"
    int inclinometer_port;      // 0 = any that is free
    uint64_t seed;              // of all noise
    double radiometer_hurry;    // divides the radiometer's exposure times, >= 1
    struct lapse_rates radiometer_lapses; // of the faults drift and misread
    double enumeration_s;       // from plugging it in again until a USB device or the camera shows
    double line_enumeration_s;  // the same of a serial line; a TCP port is there at once
    double collector_mm2;       // of the cosine corrector
    double calibration_error;   // relative slope error of spectrometer.cal over 180 nm, 0 = exact
    double camera_pitch_deg;    // of the camera's axis above the horizon, for its own accelerometer
    int opentrack_port;         // UDP at 127.0.0.1; 0 = no opentrack
    double opentrack_rate_hz;
    struct vec3 opentrack_zero; // where it was centred, in its camera's frame
    bool opentrack_mirrored;    // see model_opentrack.h
};

struct wire;

// Plugs all in and starts their threads. NULL with err.
struct wire *wire_start(const struct wire_options *options, struct error *err);

// Whether the instrument's wire knows this fault.
bool wire_fault_suits(enum wire_instrument instrument, enum wire_fault fault);

// One that does not suit is ignored. What comes back after being away shows
// when it is enumerated: at once when that takes no time, else by
// wire_enumerate. Any thread.
void wire_set_fault(struct wire *wire, enum wire_instrument instrument, enum wire_fault fault);

// What the instrument suffers; UNPLUGGED too while it is not enumerated again.
// *pulled is how often its plug came out. Any thread.
enum wire_fault wire_fault_of(struct wire *wire, enum wire_instrument instrument, int *pulled);

// Shows what was plugged in long enough ago. To be called now and then. Any thread.
void wire_enumerate(struct wire *wire, int64_t now_ns);

// Unplugs everything, joins the threads. Accepts NULL.
void wire_stop(struct wire *wire);

#endif
