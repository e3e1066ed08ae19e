// SPDX-License-Identifier: Apache-2.0
// What an Ocean spectrometer says of itself, and its raw counts: pure
// functions, no hardware. Counts are "raw" (as the converter gives them) or
// "scaled" (raw x full_counts / saturation), the axis that the calibration and
// the non-linearity polynomial belong to. See ocean.md for the sources.
#ifndef DRIVERS_OCEAN_COUNTS_H
#define DRIVERS_OCEAN_COUNTS_H

#include "drivers/ocean_models.h"

enum {
    OCEAN_SLOTS = 18,
    OCEAN_SLOT_BYTES = 17, // 05, slot, 15 bytes
};

// What the information slots say of a unit.
struct ocean_unit {
    const struct ocean_model *model;
    char serial[16];
    double wavelength[4];     // nm = sum of wavelength[i] x pixel^i, pixel from 0
    double own_wavelength[4]; // as the slots say; wavelength may be a refit's
    double nonlinearity[8];   // over scaled counts
    int order;                // of nonlinearity, 0..7; -1: slots invalid, no correction
    double stray;             // part of the mean signal that is stray light, 0..0.1
    double saturation;        // raw counts, > 0
};

// Reads the replies to slots 0..17. DATA when an echo is wrong, the serial is
// empty or the wavelengths do not ascend through the visible; a bad
// non-linearity only sets order to -1, a bad stray-light constant is 0.
bool ocean_unit_parse(const struct ocean_model *model,
                      const uint8_t replies[OCEAN_SLOTS][OCEAN_SLOT_BYTES], struct ocean_unit *out,
                      struct error *err);

// Other wavelengths than the unit's own (see wavelength_refit.h). False and
// untouched when they do not ascend through the visible.
bool ocean_unit_rewave(struct ocean_unit *unit, const double wavelength[4]);

// What its raw counts are about.
struct detector ocean_detector(const struct ocean_unit *unit);

// Finite, constant term within (0.5, 1.5), and the polynomial within (0.5, 1.5)
// over 0..most scaled counts; order 0..7.
bool ocean_nonlinearity_valid(const double *coefficients, int order, double most);

// The divisor of a scaled count, within 0..full_counts; 1 without a polynomial.
double ocean_bend(const struct ocean_unit *unit, double counts);

// nm of a pixel, its centre at whole numbers.
double ocean_wavelength(const struct ocean_unit *unit, double pixel);

// Counts of averaged readings of one exposure.
struct ocean_reading {
    double raw[OCEAN_PIXELS_MOST]; // sum over the readings
    int averaged;                  // 0: empty
    int integration_us;
    int saturated; // used pixels that reached saturation, the most in one reading
    double peak;   // largest used raw count over saturation, 0..1
};

// used: the pixels that peak and saturated look at.
void ocean_reading_add(const struct ocean_unit *unit, struct pixel_range used,
                       const uint16_t raw[OCEAN_PIXELS_MOST], struct ocean_reading *reading);

// Mean of the black pixels of raw counts.
double ocean_black_mean(const struct ocean_model *model, const double raw[OCEAN_PIXELS_MOST]);

// Mean raw count of the optical black pixels.
double ocean_black(const struct ocean_unit *unit, const struct ocean_reading *reading);

// Its standard deviation by read noise, in scaled counts.
double ocean_black_sigma(const struct ocean_model *model, int averaged);

// Largest scaled count above the black pixels among the used ones.
double ocean_signal(const struct ocean_unit *unit, struct pixel_range used,
                    const struct ocean_reading *reading);

#endif
