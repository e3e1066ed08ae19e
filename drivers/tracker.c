// SPDX-License-Identifier: Apache-2.0
#include "drivers/tracker.h"

#include "drivers/wiimote.h"

#define FIELD(name) SETTING_FIELD(struct tracker_options, name)
#define SIZE(name) SETTING_SIZE(struct tracker_options, name)

const char *tracker_status_name(enum tracker_status status)
{
    switch (status) {
#define X(name, text)                                                                              \
    case TRACKER_##name:                                                                           \
        return text;
        TRACKER_STATUSES(X)
#undef X
    }
    return "unknown";
}

const char *const tracker_markers[] = {"clip", "cap", NULL};

const struct setting tracker_settings[] = {
    {"serial", SETTING_TEXT, FIELD(serial), SIZE(serial), .unit = "", .preset = "",
     .help = "Serial number (Bluetooth address) of the camera; empty takes the first one found."},
    {"fov_deg", SETTING_DOUBLE, FIELD(fov_deg), .least = 10, .most = 120, .unit = "deg",
     .preset = "42", .help = "Horizontal field of view; calibrate per unit."},
    {"sensitivity", SETTING_INT, FIELD(sensitivity), .least = 1, .most = 6, .unit = "",
     .preset = "3", .help = "Sensitivity of the camera, 6 is the greatest."},
    {"marker", SETTING_ENUM, FIELD(marker), .unit = "", .choices = tracker_markers,
     .preset = "clip", .help = "Which set of three markers the observer wears."},
    {"eye_from_marker_m", SETTING_VECTOR, FIELD(eye_from_marker_m), 3, -1, 1, .unit = "m",
     .preset = "0 0 0",
     .help = "From the marker origin to the midpoint of the eyes: observer's right, up, into the "
             "head."},
    {0},
};

const struct tracker_driver *const tracker_drivers[] = {&wiimote_driver, NULL};
