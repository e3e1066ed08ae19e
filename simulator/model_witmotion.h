// SPDX-License-Identifier: Apache-2.0
// A WitMotion inclinometer as its holding registers show it: WT901C-485 of the
// standard family or HWT9073-485 of the high-precision one. See wires.md.
#ifndef SIMULATOR_MODEL_WITMOTION_H
#define SIMULATOR_MODEL_WITMOTION_H

#include "simulator/around.h"
#include "simulator/model_noise.h"

enum { WITMOTION_ADDRESS = 0x50, WITMOTION_BAUD = 9600, WITMOTION_REGISTERS = 0x85 };

#define WITMOTION_MAPS(X)                                                                          \
    X(STANDARD, "wt901c")                                                                          \
    X(PRECISE, "hwt9073") /* angles of 32 bits, low word first */

enum witmotion_map {
#define X(name, text) WITMOTION_##name,
    WITMOTION_MAPS(X)
#undef X
};

struct witmotion {
    enum witmotion_map map;
    struct around around;
    struct noise noise;
    int64_t powered_ns, unlocked_until_ns;
    uint16_t registers[WITMOTION_REGISTERS];
};

// serial: up to 12 characters, kept in the registers 0x7F..0x84 (two a register).
void witmotion_init(struct witmotion *device, enum witmotion_map map, const struct around *around,
                    const char *serial, uint64_t seed, int64_t now_ns);

// Measures: brings the registers up to now_ns.
void witmotion_refresh(struct witmotion *device, int64_t now_ns);

// One register written by the master: without effect while locked, or where
// nothing may be written.
void witmotion_write(struct witmotion *device, uint16_t address, uint16_t value, int64_t now_ns);

#endif
