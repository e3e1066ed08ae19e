// SPDX-License-Identifier: Apache-2.0
// The driver of Photo Research PR-655 and PR-670; see pr655.md. What its lines
// mean, open to tests.
#ifndef DRIVERS_PR655_H
#define DRIVERS_PR655_H

#include <stddef.h>

#include "drivers/radiometer.h"

extern const struct radiometer_driver pr655_driver;

// The status number that begins a reply; *rest is what follows its comma, ""
// without one. False when the line does not begin with a whole number.
bool pr655_status(const char *line, int *status, const char **rest);

// Fills err for a status other than 0, with the number and its meaning: RANGE
// for overload, DATA for a command the instrument does not know, else RETRY.
// True for 0.
bool pr655_check(int status, struct error *err);

// "nm,value" and nothing else, nm 200..2500. False otherwise.
bool pr655_point(const char *line, double *nm, double *value);

// "units,X,Y,Z", the rest of a reply to D2. DATA when it is not that, or not
// in SI units.
bool pr655_xyz(const char *rest, struct xyz *out, struct error *err);

// Whether the points read so far have equal steps and, when complete is true,
// run on to where such an instrument ends (780 nm). DATA when not.
bool pr655_spectrum_check(const double *nm, int count, bool complete, struct error *err);

#endif
