// SPDX-License-Identifier: Apache-2.0
// Where the hinge is, where the screen is from it, and how the inclinometer is
// turned on the screen: from poses whose angle a protractor read, or whose
// corners a tape measured, beside what the inclinometer said.
// The model is render/stand.h and drivers/accelerometer.h; each pose's true tilt
// is an unknown of its own, so that no reading counts as exact (errors in
// variables, Fuller 1987).
#ifndef CALIBRATION_STAND_FIT_H
#define CALIBRATION_STAND_FIT_H

#include "base/error.h"
#include "render/stand.h"

enum { STAND_POSES_MOST = 64 };

// Places of the screen that a tape can find: corners of the active area.
#define SCREEN_PLACES(X)                                                                           \
    X(CENTRE, "centre", 0, 0)                                                                      \
    X(TOP_LEFT, "top_left", -0.5, 0.5)                                                             \
    X(TOP_RIGHT, "top_right", 0.5, 0.5)                                                            \
    X(BOTTOM_LEFT, "bottom_left", -0.5, -0.5)                                                      \
    X(BOTTOM_RIGHT, "bottom_right", 0.5, -0.5)

enum screen_place {
#define X(name, text, x, y) PLACE_##name,
    SCREEN_PLACES(X)
#undef X
        PLACE_COUNT
};

const char *screen_place_name(enum screen_place place);
struct vec3 screen_place_at(const struct screen *screen, enum screen_place place); // screen frame

// What was read at one pose; NAN is not read.
struct stand_pose_read {
    double protractor_deg;     // tilt by a protractor on the screen
    double inclinometer_deg;   // as the instrument says it
    double lateral;            // gravity along the sensor's right over all of it, -1..1
    double at[PLACE_COUNT][3]; // by tape, booth frame, m
};

// Every value NAN.
struct stand_pose_read stand_pose_unread(void);

// Standard uncertainties (k = 1) of one reading.
struct stand_instruments {
    double protractor_deg, inclinometer_deg, lateral, tape_m;
};
extern const struct stand_instruments STAND_INSTRUMENTS; // 0.1 degree, 0.03 degree, 0.0005, 1 mm

#define STAND_PARAMETERS(X)                                                                        \
    X(HINGE_Y, "hinge_m y", "m")                                                                   \
    X(HINGE_Z, "hinge_m z", "m")                                                                   \
    X(CENTRE_X, "centre_from_hinge_m x", "m")                                                      \
    X(CENTRE_Y, "centre_from_hinge_m y", "m")                                                      \
    X(CENTRE_Z, "centre_from_hinge_m z", "m")                                                      \
    X(TURN_X, "turned_deg 1", "deg")                                                               \
    X(TURN_Y, "turned_deg 2", "deg")                                                               \
    X(TURN_Z, "turned_deg 3", "deg")

enum stand_parameter {
#define X(name, text, unit) STAND_##name,
    STAND_PARAMETERS(X)
#undef X
        STAND_PARAMETER_COUNT
};

const char *stand_parameter_name(enum stand_parameter parameter);
const char *stand_parameter_unit(enum stand_parameter parameter);

struct stand_problem {
    struct screen screen; // its size counts
    struct stand stand;   // as known before: what cannot be found keeps its value
    double turned_deg[3]; // likewise
    struct stand_instruments instruments;
    int count; // 1..STAND_POSES_MOST
    struct stand_pose_read poses[STAND_POSES_MOST];
};

struct stand_fit {
    struct stand stand;
    double turned_deg[3];
    double value[STAND_PARAMETER_COUNT];
    double uncertainty[STAND_PARAMETER_COUNT]; // expanded, k = 2; 0 = kept as it was
    bool fitted[STAND_PARAMETER_COUNT];
    int poses, readings, unknowns;
    double rms; // of the residuals over their uncertainties, by degrees of freedom; about 1
    double tilt_deg[STAND_POSES_MOST];                  // as found
    struct stand_pose_read residuals[STAND_POSES_MOST]; // read less found; NAN = not read
    char warning[256]; // what could not be found and why, "" = all was
};

// Errors (DATA) say why: fewer than three poses, angles too close together, no
// angle in one; an unknown that would be known to worse than 20 mm or 1 degree;
// which reading contradicts the others (by more than five times its uncertainty
// and theirs), or that all contradict the model.
bool stand_fit(const struct stand_problem *problem, struct stand_fit *out, struct error *err);

#endif
