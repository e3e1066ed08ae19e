// SPDX-License-Identifier: Apache-2.0
// Which devices the drivers open, and the udev rules that let them.
#ifndef DRIVERS_UDEV_H
#define DRIVERS_UDEV_H

#include <stdio.h>

#include "base/error.h"

// Where the printed rules belong: before 73-seat-late.rules, or uaccess has no
// effect. Error texts on refused permission name this file.
#define UDEV_RULES_FILE "70-boothd.rules"

enum device_bus {
    DEVICE_USB,       // a device node of libusb
    DEVICE_BLUETOOTH, // a hidraw node of a Bluetooth HID
    DEVICE_SERIAL,    // a tty of a USB adapter
};

// One row of a driver's id table; a row without a name ends it.
struct device_id {
    enum device_bus bus;
    unsigned vendor, product;
    const char *name;
};

// Whether an error says that permission is refused and names the rules.
bool udev_refused(const struct error *err);

extern const struct device_id ocean_ids[];
extern const struct device_id wiimote_ids[];
extern const struct device_id witmotion_ids[];

// Prints the rules file for every id of every driver. They match "add" and
// "bind" (a rule for "add" alone is not applied at boot, python-seabreeze #22,
// #66, #300). Serial adapters keep their group and only gain uaccess, since
// other things hang on the same chips. The kernel's accelerometers are files of
// sysfs, which no MODE reaches: their rule opens them to the group.
void udev_rules_print(FILE *out);

#endif
