// SPDX-License-Identifier: Apache-2.0
// From raw counts of any Ocean spectrometer to spectral irradiance with its
// uncertainty: pure functions, no hardware. The order of steps and its sources
// stand in ocean.md.
#ifndef DRIVERS_IRRADIANCE_H
#define DRIVERS_IRRADIANCE_H

#include "colorimetry/spectrum.h"
#include "drivers/ocean_counts.h"
#include "files/table.h"

// Over which counts the non-linearity polynomial is evaluated: it depends on
// how it was made. seabreeze: scaled counts above dark; ooacquire: counts as
// read, light and dark each.
enum bend { BEND_ABOVE_DARK, BEND_AS_READ, BEND_OFF };

// Where each pixel lies and what a count there is worth.
struct ocean_axis {
    double edge_nm[OCEAN_PIXELS_MOST + 1]; // pixel i covers edge i..i + 1
    double worth[OCEAN_PIXELS_MOST]; // W m-2 nm-1 per scaled count per second, 0 = not calibrated
    double worth_sigma[OCEAN_PIXELS_MOST]; // relative standard uncertainty of it
    struct pixel_range used;               // active, calibrated, on the inner grid
};

// From a table "nm, value" or "nm, value, sigma_percent", nm ascending, no
// negative value. The name of the second column says what the values are:
//   uJ_per_count, [uJoule/count] or none: energy on the collector,
//     divided by collector_mm2 and the pixel's width;
//   uW_per_cm2_nm_per_count_per_s, W_per_m2_nm_per_count_per_s: irradiance.
// Linear between its rows. sigma_percent (0..100): standard uncertainty.
// DATA names the file and the line; also when no pixel is used.
bool ocean_axis_make(const struct ocean_unit *unit, const struct table *calibration,
                     double collector_mm2, struct ocean_axis *out, struct error *err);

// What the detector reads without light, pixel by pixel.
struct ocean_dark {
    double raw[OCEAN_PIXELS_MOST]; // mean
    double black;                  // mean of its black pixels
    int averaged;                  // readings behind it, >= 1
};

// Stored dark spectra of one unit, ascending by integration_us.
struct ocean_darks {
    int count;
    int *integration_us;
    struct ocean_dark *darks;
};

void ocean_darks_fini(struct ocean_darks *darks);

// From a table with one row for each pixel (model->pixels of them) and one
// column for each exposure, named "us100000" or "us100000x20" (mean of 20),
// raw counts. DATA names file and line or column.
bool ocean_darks_make(const struct ocean_unit *unit, const struct table *table,
                      struct ocean_darks *out, struct error *err);

// The dark at an exposure: the stored one, or between its neighbours in
// proportion (dark current grows with time). False beyond the stored ones: then
// only the black pixels can tell.
bool ocean_dark_at(const struct ocean_darks *darks, const struct ocean_unit *unit, int us,
                   struct ocean_dark *out);

// How a reading is to be processed; all zero is fine.
struct ocean_process {
    enum bend bend;
    int boxcar;                    // half width in pixels, 0..100
    const struct ocean_dark *dark; // of the reading's exposure, or NULL: black pixels only
};

// One pixel's counts above dark on the scale of full_counts, made linear; *slope
// (may be NULL) is its derivative by the scaled counts read.
double ocean_linear_counts(const struct ocean_unit *unit, enum bend bend, double light, double dark,
                           double *slope);

// Standard uncertainties by cause, W m-2 nm-1.
struct ocean_sigma {
    struct spectrum shot, read, dark, calibration;
};

// On the inner grid, W m-2 nm-1; 0 where less than half of a bin is seen.
// sigma: the root of the four squares; parts may be NULL. Shot and read noise
// are independent from pixel to pixel before the boxcar; the mean of the black
// pixels and the calibration are common to all pixels of a bin.
void ocean_irradiance(const struct ocean_unit *unit, const struct ocean_axis *axis,
                      const struct ocean_process *process, const struct ocean_reading *reading,
                      struct spectrum *irradiance, struct spectrum *sigma,
                      struct ocean_sigma *parts);

#endif
