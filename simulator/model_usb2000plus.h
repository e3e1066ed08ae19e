// SPDX-License-Identifier: Apache-2.0
// An Ocean Optics USB2000+ as its OEM data sheet describes it: commands,
// EEPROM slots, status, and the acquisition cycles that run ahead of the
// requests. See wires.md.
#ifndef SIMULATOR_MODEL_USB2000PLUS_H
#define SIMULATOR_MODEL_USB2000PLUS_H

#include <stdbool.h>

#include "simulator/around.h"
#include "simulator/usb_model.h"

struct usb2000plus_options {
    struct around around;
    const char *serial;        // slot 0, at most 15 characters
    uint64_t seed;
    double collector_mm2;
    int64_t powered_ns;        // when power first came on
    bool full_speed;           // 12 Mbit/s bus
    bool flame;                // firmware 3: register reads echo 0xFE
    bool blank_nonlinearity;   // slots 6..14 never programmed (0xFF)
};

struct usb2000plus;

// NULL when out of memory.
struct usb2000plus *usb2000plus_create(const struct usb2000plus_options *options);
void usb2000plus_destroy(struct usb2000plus *device);

// Power comes back: settings and acquisition begin anew, the EEPROM stays.
// Call while it is unplugged.
void usb2000plus_power_on(struct usb2000plus *device, int64_t now_ns);

// The device's face to the bus; lives as long as the device.
struct usb_model usb2000plus_model(struct usb2000plus *device);

#endif
