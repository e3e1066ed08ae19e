// SPDX-License-Identifier: Apache-2.0
// Puts a usb_model below an unmodified libusb: sysfs, uevents and the answers
// of the kernel's usbfs through umockdev.
#ifndef SIMULATOR_USB_DEVICE_H
#define SIMULATOR_USB_DEVICE_H

#include <pthread.h>
#include <stdbool.h>
#include <umockdev.h>

#include "base/error.h"
#include "simulator/usb_model.h"
#include "simulator/wire.h"

struct usb_device;

// An unplugged device with its thread. Whoever plugs or pulls at the testbed
// holds pulling meanwhile; the device's own thread does when a fault pulls it.
// port (1..) tells several devices of a bus apart. NULL with err.
struct usb_device *usb_device_create(UMockdevTestbed *testbed, pthread_mutex_t *pulling, int port,
                                     const struct usb_model *model, uint64_t seed,
                                     struct error *err);

// Shows up at its port with another device number than before.
bool usb_device_plug(struct usb_device *device, struct error *err);

bool usb_device_is_plugged(struct usb_device *device);

// Goes away as a pulled plug does. Accepts an unplugged device.
void usb_device_unplug(struct usb_device *device);

// Goes away, to come back at the other bus, 1 or 2.
void usb_device_move(struct usb_device *device);

// Goes away, to come back as another device, or as itself.
void usb_device_become(struct usb_device *device, const struct usb_model *model);

// SILENT: data of the device are lost. GARBAGE: random. SHORT: half the first
// packet, the rest is lost. STALL: the next IN transfer stalls, once, and its
// data are lost. OVERFLOW: every IN transfer babbles. FORBIDDEN: the node may
// not be opened. PULLED_IN_COMMAND: goes with the next OUT transfer.
// PULLED_IN_SPECTRUM: goes with the second full packet of the device. Any thread.
void usb_device_set_fault(struct usb_device *device, enum wire_fault fault);

// Calls act while the model is at rest. Any thread.
void usb_with_model(struct usb_device *device, void (*act)(void *context), void *context);

// Unplugs and ends the thread, without pulling held. Accepts NULL.
void usb_device_destroy(struct usb_device *device);

#endif
