// SPDX-License-Identifier: Apache-2.0
// Puts a usb_model below an unmodified libusb: sysfs, uevents and the answers
// of the kernel's usbfs through umockdev.
#ifndef SIMULATOR_USB_DEVICE_H
#define SIMULATOR_USB_DEVICE_H

#include <stdbool.h>
#include <umockdev.h>

#include "base/error.h"
#include "simulator/usb_model.h"
#include "simulator/wire.h"

struct usb_device;

// An unplugged device with its thread. NULL with err.
struct usb_device *usb_device_create(UMockdevTestbed *testbed, const struct usb_model *model,
                                     uint64_t seed, struct error *err);

// Shows up at bus 1, port 1 with the next device number. One thread at a time.
bool usb_device_plug(struct usb_device *device, struct error *err);

// Goes away as a pulled plug does. Accepts an unplugged device.
void usb_device_unplug(struct usb_device *device);

// SILENT: data of the device are lost. GARBAGE: random. SHORT: half the first
// packet, the rest is lost. STALL: the next IN transfer stalls, once, and its
// data are lost. Any thread.
void usb_device_set_fault(struct usb_device *device, enum wire_fault fault);

// Unplugs and ends the thread. Accepts NULL.
void usb_device_destroy(struct usb_device *device);

#endif
