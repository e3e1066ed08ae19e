// SPDX-License-Identifier: Apache-2.0
// What a fault does to the bytes of one reply on its way to the host.
#ifndef SIMULATOR_WIRE_FAULT_H
#define SIMULATOR_WIRE_FAULT_H

#include <stddef.h>
#include <stdint.h>

#include "simulator/model_lapse.h"
#include "simulator/model_noise.h"
#include "simulator/wire.h"

// Changes bytes in place and returns how many of them arrive: all random
// (GARBAGE), the first half (SHORT), none (SILENT, UNPLUGGED), else as they are.
size_t fault_on(enum wire_fault fault, struct noise *noise, uint8_t *bytes, size_t size);

// What it does to a radiometer's readings.
enum lapse_kind lapse_of_fault(enum wire_fault fault);

#endif
