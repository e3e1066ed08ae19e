// SPDX-License-Identifier: Apache-2.0
// What a person does in the booth, over the control socket (base/control.h),
// and the truth that a test asks for.
//
//   lamp   name or "none", [level 0..1.2 = 1], [add false]  (add: others stay as they are)
//   tilt   deg, [over_s 0]
//   head   eye_m [x, y, z], [over_s 0]
//   aim    target "screen", x_px, y_px, [from_m [x, y, z]]
//          target "ceiling", x_m, z_m
//   fault  instrument, kind
//   protractor  nothing; the reply is deg alone
//   tape   x_m, y_m on the screen from its centre; the reply is point_m [x, y, z]
//   radiance  nothing -> at_s, radiance {first_nm, step_nm, values} of what the radiometer is
//          aimed at, W m-2 sr-1 nm-1
//   truth  nothing: what is so now (see below)
//          reflectance 0..2, or {"nm": [...], "values": [...]}; [name]
//          samples [{name, reflectance}, ...]
//          each with [x_px, y_px]: place on the screen; else where the
//          radiometer is aimed, or the centre when that is the ceiling
//
// Every other reply holds the state: at_s, lamp ("none", a name, or names joined by
// '+'), level, levels {name: level}, lux (at that place in the screen's plane),
// tilt_deg, eye_m, aim, illuminant_xyz (cd/m2 of the perfect diffuser there).
// truth adds, per sample, name, XYZ (cd/m2, CIE 1931 2 degrees) and Y.
#ifndef SIMULATOR_WORLD_CONTROL_H
#define SIMULATOR_WORLD_CONTROL_H

#include "base/control.h"
#include "simulator/world.h"

// Carries out a request at now_ns. A new object, or NULL with err: RANGE for
// what the booth does not have, CONFIG for a request that is not well formed.
json_t *world_answer(struct world *world, int64_t now_ns, const char *what, json_t *request,
                     struct error *err);

#endif
