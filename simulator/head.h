// SPDX-License-Identifier: Apache-2.0
// The emulated head with its clip or cap of three infrared markers, perhaps a
// fourth, and the camera that sees them.
//
// Marker frame: x to the wearer's right, y up, z away from the camera into the
// head; parallel to the booth's axes when the head
// faces along -z. The clip's markers stand at (0, 40, -30), 0 and (0, -70, -80) mm,
// the cap's at 0, (-40, -60, -100) and (40, -60, -100) mm.
// With the clip at clip_from_eye_m = (0, 0.06, 0.02) the eyes' midpoint lies
// at (0, -0.06, -0.02) m in that frame, however the head turns.
#ifndef SIMULATOR_HEAD_H
#define SIMULATOR_HEAD_H

#include "base/linear.h"
#include "simulator/scenario.h"

// Turns with the head: booth_from_marker. The head faces `at` as far as
// turn_most_deg in pitch and in yaw allows.
struct mat3 head_turn(const struct scenario_head *head, struct vec3 eye, struct vec3 at);

// Places of the markers in the booth: top, middle, bottom of the clip; top,
// left, right of the cap.
void clip_markers(const struct scenario_head *head, struct vec3 eye, struct vec3 at,
                  struct vec3 out[3]);

// booth_from_head: where the origin of clip or cap is and how its frame turns.
struct rigid head_pose(const struct scenario_head *head, struct vec3 eye, struct vec3 at);

// Place of the fourth marker; false when none is worn.
bool head_fourth_marker(const struct scenario_head *head, struct vec3 eye, struct vec3 at,
                        struct vec3 *out);

// camera_from_booth. Camera axes: z out of the lens, y up, x = y cross z.
struct rigid camera_pose(const struct scenario_camera *camera);

#endif
