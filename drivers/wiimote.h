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

// How the camera writes its blobs; index as in tracker_formats. Report and mode
// of the camera belong together.
enum wiimote_format {
    WIIMOTE_EXTENDED, // report 33: place and size, a hundred times a second
    WIIMOTE_BASIC,    // report 37: place only
    WIIMOTE_FULL,     // reports 3e and 3f by turns, two blobs each: box and brightness too
};

// What was decoded so far; zeroed at the start.
struct wiimote_frame {
    struct wiimote_blob blobs[WIIMOTE_BLOBS];
    bool half; // FULL: the first two are there
};

// One blob of the extended format, also the beginning of a full one: x low, y low,
// [y 9:8 | x 9:8 | size]. Unseen when all bits are set or y lies below the sensor.
struct wiimote_blob wiimote_decode(const uint8_t bytes[3]);

// Two blobs of the basic format: x1 low, y1 low, [y1 9:8 | x1 9:8 | y2 9:8 | x2 9:8], x2 low, y2
// low. Their size is 0.
void wiimote_decode_basic(const uint8_t bytes[5], struct wiimote_blob out[2]);

// Takes a report (its number first). *whole tells whether the frame now holds all
// blobs of one moment. DATA when the format has no such report, or it is too short.
bool wiimote_report(enum wiimote_format format, const uint8_t *report, size_t count,
                    struct wiimote_frame *frame, bool *whole, struct error *err);

// Focal length in pixels for a horizontal field of view.
double wiimote_focal_px(double fov_deg);

// A blob as direction (x / z, y / z) in the tracker frame, where x points to
// the camera's left (the observer's right).
void wiimote_direction(struct wiimote_blob blob, double focal_px, double out[2]);

#endif
