// SPDX-License-Identifier: Apache-2.0
// Poses and points as they were measured, as CSV: a first line of names, a line
// each. What a column holds stands in its name; columns may be missing, cells not.
#ifndef CALIBRATION_POSE_FILES_H
#define CALIBRATION_POSE_FILES_H

#include "calibration/stand_fit.h"
#include "calibration/tracker_fit.h"

// tilt_deg (protractor), reading_deg (inclinometer), gravity_x, gravity_y, gravity_z
// (its acceleration, any unit), and centre_x_m … bottom_right_z_m (tape). Fills
// count and poses. Errors (DATA) name file and column; an unknown column is
// refused.
bool poses_load(const char *path, struct stand_problem *problem, struct error *err);

// The columns that any pose has; gravity as gravity_x alone, over its length.
bool poses_save(const char *path, const struct stand_problem *problem, struct error *err);

// A point as it was measured.
struct held_point {
    double screen_x_m, screen_y_m; // on the screen, from its centre
    double standoff_m;             // before it
    double tilt_deg;               // of the screen then
    struct vec3 tracker_m;         // as the tracker saw it
};

// screen_x_m, screen_y_m, standoff_m, [tilt_deg], tracker_x_m, tracker_y_m,
// tracker_z_m. preset_deg: the tilt without that column. Up to TRACKER_POINTS_MOST.
bool points_load(const char *path, double preset_deg, struct held_point *points, int *count,
                 struct error *err);
bool points_save(const char *path, const struct held_point *points, int count, struct error *err);

// Where it was held in the booth.
struct vec3 held_at(const struct stand *stand, const struct held_point *point);

#endif
