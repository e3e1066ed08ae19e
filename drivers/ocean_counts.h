// SPDX-License-Identifier: Apache-2.0
// From the raw counts of a USB2000+ or Flame-S to spectral irradiance: pure
// functions, no hardware. Counts are "raw" (as the converter gives them) or
// "scaled" (raw x 65535 / saturation), the axis that the calibration and the
// non-linearity polynomial belong to. See ocean.md for the sources.
#ifndef DRIVERS_OCEAN_COUNTS_H
#define DRIVERS_OCEAN_COUNTS_H

#include <stdint.h>

#include "colorimetry/spectrum.h"
#include "files/table.h"

enum {
    OCEAN_PIXELS = 2048,
    OCEAN_DARK_FIRST = 6, // optical black, the range on which all sources agree
    OCEAN_DARK_LAST = 17,
    OCEAN_ACTIVE_FIRST = 20,
    OCEAN_SLOTS = 18,
    OCEAN_SLOT_BYTES = 17, // 05, slot, 15 bytes
    OCEAN_SPECTRUM_BYTES = 2 * OCEAN_PIXELS + 1,
    OCEAN_LEAST_US = 1000,
    OCEAN_MOST_US = 65535000,
};

// What the information slots say of a unit.
struct ocean_unit {
    char serial[16];
    double wavelength[4];   // nm = sum of wavelength[i] x pixel^i, pixel from 0
    double nonlinearity[8]; // over scaled counts above dark
    int order;              // of nonlinearity, 0..7; -1: slots invalid, no correction
    double saturation;      // raw counts, > 0
};

// Reads the replies to slots 0..17. DATA when an echo is wrong, the serial is
// empty or the wavelengths do not ascend through the visible; a bad
// non-linearity only sets order to -1.
bool ocean_unit_parse(const uint8_t replies[OCEAN_SLOTS][OCEAN_SLOT_BYTES], struct ocean_unit *out,
                      struct error *err);

// Finite, constant term within (0.5, 1.5), and the polynomial within (0.5, 1.5)
// over 0..65535 scaled counts; order 0..7.
bool ocean_nonlinearity_valid(const double *coefficients, int order);

// Checks length and sync byte. DATA on failure.
bool ocean_unpack(const uint8_t *bytes, size_t count, uint16_t raw[OCEAN_PIXELS],
                  struct error *err);

// Where each pixel lies and what a count there is worth.
struct ocean_axis {
    double edge_nm[OCEAN_PIXELS + 1];  // pixel i covers edge i..i + 1
    double uj_per_count[OCEAN_PIXELS]; // 0 where the calibration does not reach
    int first, last;                   // pixels used: active, calibrated, on the inner grid
};

// From a table of two columns, nm and uJ per scaled count, nm ascending, no
// negative value. DATA names the file and the line; also when no pixel is used.
bool ocean_axis_make(const struct ocean_unit *unit, const struct table *calibration,
                     struct ocean_axis *out, struct error *err);

// Counts of averaged readings of one exposure.
struct ocean_reading {
    double raw[OCEAN_PIXELS]; // sum over the readings
    int averaged;             // 0: empty
    int integration_us;
    int saturated; // used pixels that reached saturation, the most in one reading
    double peak;   // largest used raw count over saturation, 0..1
};

void ocean_reading_add(const struct ocean_unit *unit, const struct ocean_axis *axis,
                       const uint16_t raw[OCEAN_PIXELS], struct ocean_reading *reading);

// Mean raw count of the optical black pixels.
double ocean_dark(const struct ocean_reading *reading);

// Largest scaled count above dark among the used pixels.
double ocean_signal(const struct ocean_unit *unit, const struct ocean_axis *axis,
                    const struct ocean_reading *reading);

// E = k (S - D) / (A t dl), binned by overlap onto the inner grid; W m-2 nm-1.
// sigma: shot noise of a well of 160 000 electrons, 50 scaled counts of read
// noise, the mean of the black pixels; per bin, 1 standard deviation. Both 0
// where less than half of a bin is seen.
void ocean_irradiance(const struct ocean_unit *unit, const struct ocean_axis *axis,
                      double collector_mm2, const struct ocean_reading *reading,
                      struct spectrum *irradiance, struct spectrum *sigma);

// The exposure to try after one of us that gave peak and dark (over
// saturation, 0..1): towards 85 % of saturation, us itself within 78..92 %, at
// most 8 times up; after saturation a quarter, or a sixteenth when more than
// 200 pixels were saturated. From half a mains period on, its multiples; where
// none of them falls between 78 and 92 %, the longest that stays below 88 %.
// Always within 1000..longest_us.
int ocean_next_exposure(int us, double peak, double dark, int saturated, double mains_hz,
                        int longest_us);

// The exposure as the instrument can hold it: steps of 10 us, above 655 ms of
// 1 ms, and multiples of half a mains period from one on.
int ocean_round_exposure(double us, double mains_hz, int longest_us);

#endif
