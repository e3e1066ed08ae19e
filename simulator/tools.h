// SPDX-License-Identifier: Apache-2.0
// What the technician measures the stand with: a protractor laid on the screen
// and a tape from the booth's origin. Both are off by a little each time, by
// [tools] of the scenario.
#ifndef SIMULATOR_TOOLS_H
#define SIMULATOR_TOOLS_H

#include "simulator/world.h"

// The screen's tilt in degrees, 0 lies flat.
double tools_protractor(struct world *world, int64_t at_ns);

// Where a place of the screen is in the booth; x_m to the right of its centre,
// y_m up along it.
struct vec3 tools_tape(struct world *world, int64_t at_ns, double x_m, double y_m);

#endif
