// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_fault.h"

size_t fault_on(enum wire_fault fault, struct noise *noise, uint8_t *bytes, size_t size)
{
    switch (fault) {
    case WIRE_SILENT:
    case WIRE_UNPLUGGED:
        return 0;
    case WIRE_GARBAGE:
        noise_bytes(noise, bytes, size);
        return size;
    case WIRE_SHORT:
        return size / 2;
    case WIRE_FINE:
    case WIRE_STALL:
        break;
    }
    return size;
}
