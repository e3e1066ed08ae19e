// SPDX-License-Identifier: Apache-2.0
#include "drivers/tracker.h"

#include "drivers/opentrack.h"
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
const char *const tracker_formats[] = {"extended", "basic", "full", NULL};

const struct setting tracker_settings[] = {
    {"serial", SETTING_TEXT, FIELD(serial), SIZE(serial), .unit = "", .preset = "",
     .help = "Serial number (Bluetooth address) of the camera; empty takes the first one found."},
    {"fov_deg", SETTING_DOUBLE, FIELD(fov_deg), .least = 10, .most = 120, .unit = "deg",
     .preset = "42", .help = "Horizontal field of view; calibrate per unit."},
    {"sensitivity", SETTING_INT, FIELD(sensitivity), .least = 1, .most = 6, .unit = "",
     .preset = "3", .help = "Sensitivity of the camera, 6 is the greatest."},
    {"format", SETTING_ENUM, FIELD(format), .unit = "", .choices = tracker_formats,
     .preset = "extended",
     .help = "How the camera writes its blobs; all give the same places, full half as often."},
    {"marker", SETTING_ENUM, FIELD(marker), .unit = "", .choices = tracker_markers,
     .preset = "clip", .help = "Which set of three markers the observer wears."},
    {"fourth_m", SETTING_VECTOR, FIELD(fourth_m), 3, -1, 1, .unit = "m", .preset = "0 0 0",
     .help =
         "Place of a fourth marker from the marker origin: observer's right, up, into the head; "
         "0 0 0 is none. It tells poses apart that three markers leave open."},
    {"eye_from_marker_m", SETTING_VECTOR, FIELD(eye_from_marker_m), 3, -1, 1, .unit = "m",
     .preset = "0 0 0",
     .help = "From the marker origin to the midpoint of the eyes: observer's right, up, into the "
             "head."},
    {"address", SETTING_TEXT, FIELD(address), SIZE(address), .unit = "", .preset = "127.0.0.1",
     .help = "opentrack: numeric IPv4 address to listen at; 0.0.0.0 lets the whole network in."},
    {"port", SETTING_INT, FIELD(port), .least = 1, .most = 65535, .unit = "", .preset = "4242",
     .help = "opentrack: UDP port to listen at."},
    {"origin_m", SETTING_VECTOR, FIELD(origin_m), 3, -5, 5, .unit = "m", .preset = "0 0 0",
     .help = "opentrack: where its zero lies from the camera: observer's right, up, away from it."},
    {"signs", SETTING_VECTOR, FIELD(signs), 6, -1, 1, .unit = "", .preset = "-1 1 1 -1 1 1",
     .help =
         "opentrack: factors of x, y, z, yaw, pitch and roll; 0 leaves one out. The preset fits "
         "a camera's picture as it is; a mirrored one needs 1 1 1 1 1 -1. For an axis that is "
         "inverted in opentrack take the opposite."},
    {0},
};

const struct tracker_driver *const tracker_drivers[] = {&wiimote_driver, &opentrack_driver, NULL};
