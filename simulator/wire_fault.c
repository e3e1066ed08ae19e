// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_fault.h"

size_t fault_on(enum wire_fault fault, struct noise *noise, uint8_t *bytes, size_t size)
{
    if (fault == WIRE_SILENT || fault == WIRE_UNPLUGGED)
        return 0;
    if (fault == WIRE_GARBAGE)
        noise_bytes(noise, bytes, size);
    return fault == WIRE_SHORT ? size / 2 : size;
}

enum lapse_kind lapse_of_fault(enum wire_fault fault)
{
    return fault == WIRE_DRIFT ? LAPSE_DRIFT : fault == WIRE_MISREAD ? LAPSE_MISREAD : LAPSE_NONE;
}

bool wire_fault_suits(enum wire_instrument instrument, enum wire_fault fault)
{
    static const unsigned wires[] = {
#define X(name, text, wires) wires,
        WIRE_FAULTS(X)
#undef X
    };
    bool known = fault >= 0 && (size_t)fault < sizeof(wires) / sizeof(wires[0]);
    return known && instrument >= 0 && instrument < WIRE_COUNT && wires[fault] & 1u << instrument;
}
