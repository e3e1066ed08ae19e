// SPDX-License-Identifier: Apache-2.0
// The radiometer at the end of its line.
#ifndef SIMULATOR_WIRE_RADIOMETER_H
#define SIMULATOR_WIRE_RADIOMETER_H

#include "simulator/wire_line.h"

struct radiometer_end;

// NULL with err.
struct radiometer_end *radiometer_create(const struct wire_options *options, struct error *err);

// After its line is destroyed. Accepts NULL.
void radiometer_destroy(struct radiometer_end *radiometer);

struct line_end radiometer_end(struct radiometer_end *radiometer);

#endif
