// SPDX-License-Identifier: Apache-2.0
// From any head tracker to the eye's place in the tracker's frame.
#ifndef DRIVERS_TRACKER_H
#define DRIVERS_TRACKER_H

#include "base/linear.h"
#include "drivers/spectrometer.h"

#define TRACKER_STATUSES(X)                                                                        \
    X(SEEN, "seen")                                                                                \
    X(LOST, "lost")           /* too few markers */                                                \
    X(AMBIGUOUS, "ambiguous") /* collinear markers or a jump */

enum tracker_status {
#define X(name, text) TRACKER_##name,
    TRACKER_STATUSES(X)
#undef X
};

const char *tracker_status_name(enum tracker_status status);

// Tracker frame: origin at the camera, z out of the lens, y up, x = y cross z:
// the axes of a camera that faces the observer are parallel to the booth's
// (x to the observer's right). Metres.
struct head_sample {
    struct interval taken;
    enum tracker_status status;
    struct vec3 eye;        // midpoint of the eyes in the tracker frame, m
    double reprojection_px; // rms residual of the pose; 0 where the tracker has none
    int markers;            // blobs seen, 0..4; 0 where the tracker has none
};

struct tracker_options {
    char serial[64];             // "" = first
    double fov_deg;              // horizontal field of view of the camera, 10..120 (42)
    int sensitivity;             // 1..5, 6 = greatest
    int format;                  // index into tracker_formats: how the camera writes its blobs
    int marker;                  // index into tracker_markers
    double fourth_m[3];          // place of a fourth marker, marker frame; 0 0 0 = none
    double eye_from_marker_m[3]; // marker origin to the midpoint of the eyes, marker frame
    // opentrack only:
    char address[64];   // numeric IPv4 address to listen at
    int port;           // UDP, 1..65535; 0 = any free one
    double origin_m[3]; // of opentrack's zero, tracker frame, -5..5
    double signs[6];    // of x, y, z, yaw, pitch, roll, -1..1; 1 as in opentrack.md (-1 1 1 -1 1 1)
};

extern const struct setting tracker_settings[];
extern const char *const tracker_markers[]; // "clip", "cap", NULL
extern const char *const tracker_formats[]; // "extended", "basic", "full", NULL

struct tracker;

struct tracker_driver {
    const char *name; // "wiimote", "opentrack"
    struct tracker *(*open)(const struct tracker_options *options, int64_t deadline_ns,
                            struct error *err);
    bool (*read)(struct tracker *device, int64_t deadline_ns, struct head_sample *out,
                 struct error *err);
    void (*identify)(const struct tracker *device, struct instrument_identity *out);
    void (*close)(struct tracker *device);
};

extern const struct tracker_driver *const tracker_drivers[];

#endif
