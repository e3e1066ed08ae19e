// SPDX-License-Identifier: Apache-2.0
// Raw counts of a spectrometer, as boothd gives them on request or as a file
// holds them.
#ifndef CALIBRATION_RAW_COUNTS_H
#define CALIBRATION_RAW_COUNTS_H

#include <jansson.h>

#include "base/error.h"
#include "drivers/detector.h"
#include "drivers/irradiance.h"

enum { RAW_READINGS_MOST = 1000 };

// Readings of one exposure, taken together.
struct raw_counts {
    char instrument[128]; // model and serial number
    char taken_at[32];    // UTC, "" = not told
    bool emulated;
    struct detector detector;
    int integration_us, readings;
    int saturated;                          // pixels that see light, the most in one reading
    double mean[DETECTOR_PIXELS_MOST];      // counts, [detector.pixels]
    double deviation[DETECTOR_PIXELS_MOST]; // standard deviation of one reading, counts
    double active[RAW_READINGS_MOST];       // mean of the pixels that see light, a reading each
    double black[RAW_READINGS_MOST];        // of the optically black ones
};

// From the reply to CONTROL_RAW. DATA when it is none.
bool raw_counts_of(const json_t *reply, struct raw_counts *out, struct error *err);

// Mean of the black pixels, and rms of what one reading of one of them is off.
double raw_black(const struct raw_counts *raw);
double raw_noise(const struct raw_counts *raw);

// Standard error of raw_black by that noise, were there so many readings.
double raw_black_sigma(const struct raw_counts *raw, int readings);

// Adds the readings of more, which were taken later at the same exposure of the
// same instrument. RANGE when they do not belong together or are too many.
bool raw_join(struct raw_counts *raw, const struct raw_counts *more, struct error *err);

// The unit behind the counts as the driver's own functions take it; model is
// where what the counts say of the model goes, and must live as long as the unit.
struct ocean_unit raw_unit(const struct raw_counts *raw, struct ocean_model *model);

// ---- files -----------------------------------------------------------------

// Writes "pixel,nm,counts,deviation" and, unless dark is NULL, ",dark": a row a
// pixel, the rest in comment lines.
bool raw_save(const char *path, const struct raw_counts *light, const struct raw_counts *dark,
              struct error *err);

// A spectrum above dark of pixels whose wavelengths a file lists.
struct raw_spectrum {
    char source[640]; // file or instrument
    int pixels;
    double wavelength[4]; // nm over pixel^0..3
    double counts[DETECTOR_PIXELS_MOST];
};

// A file as raw_save writes it, any CSV with columns nm and counts (and dark),
// or a Jaz file: counts less dark. DATA when it has other columns, fewer than 8 or more than
// DETECTOR_PIXELS_MOST rows, or wavelengths that are no cubic of the row within
// 0.1 nm.
bool raw_spectrum_load(const char *path, struct raw_spectrum *out, struct error *err);

// The pixels that see light, less dark pixel by pixel (NULL: less the black pixels); 0 elsewhere.
void raw_spectrum_of(const struct raw_counts *light, const struct raw_counts *dark,
                     struct raw_spectrum *out);

#endif
