// SPDX-License-Identifier: Apache-2.0
// The Ocean Optics spectrometers that share the FPGA protocol, as one table.
// Pixels are counted from 0 as they come over the wire. Sources: ocean.md.
#ifndef DRIVERS_OCEAN_MODELS_H
#define DRIVERS_OCEAN_MODELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "drivers/detector.h"

enum {
    OCEAN_PIXELS_MOST = 3840,
    OCEAN_BYTES_MOST = 2 * OCEAN_PIXELS_MOST + 1,
    OCEAN_DARK_RANGES = DETECTOR_BLACK_RANGES,
    OCEAN_VENDOR = 0x2457,
};

enum ocean_saturation {
    OCEAN_SATURATION_FIXED, // full_counts
    OCEAN_SATURATION_AT_4,  // u16 at bytes 4..5 of slot 17's data, 0 = full_counts
    OCEAN_SATURATION_AT_0,  // u16 at bytes 0..1, up to 32768 = not set = full_counts
};

struct ocean_model {
    unsigned product; // USB product id, vendor 2457
    const char *name;
    int raw_pixels;                              // on the wire, 2 bytes each, then the sync byte
    int pixels;                                  // that exist, raw_pixels or fewer
    struct pixel_range active;                   // that see light
    struct pixel_range black[OCEAN_DARK_RANGES]; // optically black
    unsigned flip;                               // XORed onto each count
    double full_counts;                          // the scale of scaled counts
    enum ocean_saturation saturation;            // where it stands
    int least_us, most_us;                       // exposures it takes
    int base_us;                                 // unit of the integration command
    int split_bytes;                             // sent first on 0x86 at high speed, or 0
    int least_cycle_us;    // of a unit that never stops acquiring, 0 = it stops when nobody asks
    double read_noise;     // counts RMS on the scale of full_counts
    double well_electrons; // at full_counts
};

// Ends with a row without a name; ocean_ids (drivers/udev.h) names the same.
extern const struct ocean_model ocean_models[];

// NULL when there is none.
const struct ocean_model *ocean_model(unsigned product);

// Bytes of one spectrum with its sync byte.
static inline size_t ocean_bytes(const struct ocean_model *model)
{
    return 2 * (size_t)model->raw_pixels + 1;
}

// Checks length and sync byte; takes the flipped bit back. DATA on failure.
bool ocean_unpack(const struct ocean_model *model, const uint8_t *bytes, size_t count,
                  uint16_t raw[OCEAN_PIXELS_MOST], struct error *err);

// The integration command's five bytes for us.
void ocean_integration_command(const struct ocean_model *model, int us, uint8_t command[5]);

#endif
