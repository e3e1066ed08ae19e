// SPDX-License-Identifier: Apache-2.0
// cmocka and what it needs before it, and a booth for the tests of the world.
#ifndef TESTS_SIMULATOR_CMOCKA_HERE_H
#define TESTS_SIMULATOR_CMOCKA_HERE_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "simulator/scenario.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/fakes/near.h"

#define SHIPPED "simulator/scenarios/booth.ini"

// The shipped booth with ceilings coarse enough for a test to be quick, and
// lamps that are warm at once.
static inline void small_booth(struct scenario *scenario)
{
    struct error err = {0};
    if (!scenario_load(SHIPPED, scenario, &err))
        fail_msg("%s", err.text);
    scenario->world.cold = false;
    scenario->ceiling.true_px[0] = 128;
    scenario->ceiling.true_px[1] = 85;
    scenario->ceiling.map_px[0] = 64;
    scenario->ceiling.map_px[1] = 42;
}

#endif
