// SPDX-License-Identifier: Apache-2.0
// Where the head tracker is in the booth and where it looks: from known places at
// which its marker was held, beside where it saw them.
// The model is booth_from_tracker of config/booth.h.
#ifndef CALIBRATION_TRACKER_FIT_H
#define CALIBRATION_TRACKER_FIT_H

#include "base/error.h"
#include "base/linear.h"

enum { TRACKER_POINTS_MOST = 128 };

struct tracker_point {
    struct vec3 held; // booth frame, m
    struct vec3 seen; // tracker frame, m
};

struct tracker_problem {
    double point_m; // standard uncertainty of a point on each axis, as held and as seen together
    int count;      // 1..TRACKER_POINTS_MOST
    struct tracker_point points[TRACKER_POINTS_MOST];
};

#define TRACKER_PARAMETERS(X)                                                                      \
    X(X, "place_m x", "m")                                                                         \
    X(Y, "place_m y", "m")                                                                         \
    X(Z, "place_m z", "m")                                                                         \
    X(PITCH, "pitch_deg", "deg")                                                                   \
    X(YAW, "yaw_deg", "deg")                                                                       \
    X(ROLL, "roll_deg", "deg")

enum tracker_parameter {
#define X(name, text, unit) TRACKER_##name,
    TRACKER_PARAMETERS(X)
#undef X
        TRACKER_PARAMETER_COUNT
};

const char *tracker_parameter_name(enum tracker_parameter parameter);
const char *tracker_parameter_unit(enum tracker_parameter parameter);

struct tracker_fit {
    double value[TRACKER_PARAMETER_COUNT];       // angles in -180..180, pitch in -90..90
    double uncertainty[TRACKER_PARAMETER_COUNT]; // expanded, k = 2
    double eye_m; // expanded uncertainty, on the worst axis, of where it places an eye among the
                  // points
    struct rigid booth_from_tracker;
    int points;
    double rms_m;   // of the residuals on an axis, by degrees of freedom
    double stretch; // distances as seen over distances as held
    struct vec3 residuals[TRACKER_POINTS_MOST]; // held less found, booth frame, m
    char warning[256]; // distances as seen are not those as held, "" = they are
};

// Errors (DATA) say why: fewer than three points, too close together, all along
// one line; that an eye would be placed to worse than 20 mm; which point
// contradicts the others, or that all contradict a rigid transform.
bool tracker_fit(const struct tracker_problem *problem, struct tracker_fit *out, struct error *err);

#endif
