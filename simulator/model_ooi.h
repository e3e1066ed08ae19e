// SPDX-License-Identifier: Apache-2.0
// An Ocean Optics spectrometer of the USB2000+'s family as the OEM data sheets
// describe it: commands, EEPROM slots, status, and the acquisition cycles that
// run ahead of the requests. See wires.md.
#ifndef SIMULATOR_MODEL_OOI_H
#define SIMULATOR_MODEL_OOI_H

#include <stdbool.h>

#include "simulator/around.h"
#include "simulator/model_ooi_kind.h"
#include "simulator/usb_model.h"

struct ooi_options {
    struct around around;
    enum ooi_name kind;        // 0 = USB2000+
    const char *serial;        // slot 0, at most 15 characters
    uint64_t seed;
    double collector_mm2;
    int64_t powered_ns;        // when power first came on
    bool full_speed;           // 12 Mbit/s bus
    bool flame;                // USB2000+: firmware 3: register reads echo 0xFE
    bool blank_nonlinearity;   // slots 6..14 never programmed (0xFF)
};

struct ooi;

// NULL when out of memory.
struct ooi *ooi_create(const struct ooi_options *options);
void ooi_destroy(struct ooi *device);

// What goes wrong inside the device, until OOI_WELL.
enum ooi_upset {
    OOI_WELL,
    OOI_DEAF,         // to integration times
    OOI_NO_SYNC,      // spectra end before their sync byte
    OOI_BAD_SYNC,     // another byte stands there
    OOI_OUT_OF_STEP,  // the last spectrum's sync byte comes before each
    OOI_OTHER_PIXELS, // spectra have half as many pixels
};

// From the next spectrum on.
void ooi_upset(struct ooi *device, enum ooi_upset upset);

// The calibration of this unit in uJ per linearised count on its vendor's
// axis (ooi_kind.full).
double ooi_calibration(const struct ooi *device, double nm);

// The device's face to the bus; lives as long as the device.
struct usb_model ooi_model(struct ooi *device);

#endif
