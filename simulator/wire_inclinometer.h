// SPDX-License-Identifier: Apache-2.0
// The inclinometer at the end of its line: libmodbus's server in front of the
// register model.
#ifndef SIMULATOR_WIRE_INCLINOMETER_H
#define SIMULATOR_WIRE_INCLINOMETER_H

#include "simulator/wire_line.h"

struct inclinometer;

// NULL with err.
struct inclinometer *inclinometer_create(const struct wire_options *options, struct error *err);

// After its line is destroyed. Accepts NULL.
void inclinometer_destroy(struct inclinometer *inclinometer);

struct line_end inclinometer_end(struct inclinometer *inclinometer);

#endif
