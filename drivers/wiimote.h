// SPDX-License-Identifier: Apache-2.0
// The driver of the infrared camera in a Wii remote; see wiimote.md. Its
// decoding, open to tests.
#ifndef DRIVERS_WIIMOTE_H
#define DRIVERS_WIIMOTE_H

#include <stddef.h>
#include <stdint.h>

#include "drivers/tracker.h"

extern const struct tracker_driver wiimote_driver;

enum { WIIMOTE_BLOBS = 4, WIIMOTE_WIDTH = 1024, WIIMOTE_HEIGHT = 768 };

struct wiimote_blob {
    bool seen;
    int x, y; // as sent: x 0..1023 to the camera's right, y 0..767 up
    int size; // 0..15
};

// One blob of the extended format: x low, y low, [y 9:8 | x 9:8 | size]. Unseen
// when all bits are set or y lies below the sensor.
struct wiimote_blob wiimote_decode(const uint8_t bytes[3]);

// All blobs of report 0x33 (report number first). DATA when it is another
// report or too short.
bool wiimote_report(const uint8_t *report, size_t count, struct wiimote_blob blobs[WIIMOTE_BLOBS],
                    struct error *err);

// Focal length in pixels for a horizontal field of view.
double wiimote_focal_px(double fov_deg);

// A blob as direction (x / z, y / z) in the tracker frame, where x points to
// the camera's left (the observer's right).
void wiimote_direction(struct wiimote_blob blob, double focal_px, double out[2]);

#endif
