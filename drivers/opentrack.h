// SPDX-License-Identifier: Apache-2.0
// The driver of poses that opentrack sends over the network; see opentrack.md.
// What its datagrams mean, open to tests.
#ifndef DRIVERS_OPENTRACK_H
#define DRIVERS_OPENTRACK_H

#include <stddef.h>
#include <stdint.h>

#include "drivers/tracker.h"

extern const struct tracker_driver opentrack_driver;

enum { OPENTRACK_AXES = 6, OPENTRACK_BYTES = 48 };

// x, y, z in cm, yaw, pitch, roll in degrees from one datagram. DATA unless it
// has exactly 48 bytes, all values finite, in range, and 0 or at least 1e-20.
bool opentrack_decode(const uint8_t *bytes, size_t count, double pose[OPENTRACK_AXES],
                      struct error *err);

// The midpoint of the eyes in the tracker frame: origin_m, signs and
// eye_from_marker_m of options applied to a pose.
struct vec3 opentrack_eye(const struct tracker_options *options, const double pose[OPENTRACK_AXES]);

#endif
