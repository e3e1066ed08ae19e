// SPDX-License-Identifier: Apache-2.0
// Where on the emulated buses a USB device hangs, and what the kernel would show
// of it there.
#ifndef SIMULATOR_USB_PLACE_H
#define SIMULATOR_USB_PLACE_H

#include <glib.h>

#include "simulator/usb_model.h"

enum { USB_MAJOR = 189, USB_PORTS = 2 };

struct usb_place {
    int bus, port; // 1..; both set by whoever owns it
    int plugs;     // so far
    int number;    // of the device, 2..127
    char devnode[32], sysfs[64];
};

// The next device number, as Linux goes round; no two ports of a bus share one.
void usb_place_next(struct usb_place *place);

// Of the device node.
int usb_place_minor(const struct usb_place *place);

// Appends the device as umockdev_testbed_add_from_string takes it.
void usb_place_describe(const struct usb_place *place, const struct usb_model *model,
                        GString *text);

#endif
