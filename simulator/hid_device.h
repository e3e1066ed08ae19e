// SPDX-License-Identifier: Apache-2.0
// Puts a hid_model below an unmodified hidapi (hidraw): sysfs, uevents and the
// answers of the kernel's hidraw through umockdev.
#ifndef SIMULATOR_HID_DEVICE_H
#define SIMULATOR_HID_DEVICE_H

#include <stdbool.h>
#include <umockdev.h>

#include "base/error.h"
#include "simulator/hid_model.h"
#include "simulator/wire.h"

struct hid_device_emulated;

// An unplugged device with its thread. NULL with err.
struct hid_device_emulated *hid_emulate(UMockdevTestbed *testbed, const struct hid_model *model,
                                        uint64_t seed, struct error *err);

// Shows up as the next /dev/hidrawN. One thread at a time.
bool hid_plug(struct hid_device_emulated *device, struct error *err);

bool hid_is_plugged(const struct hid_device_emulated *device);

// Goes away as a lost radio link does. Accepts an unplugged device.
void hid_unplug(struct hid_device_emulated *device);

// SILENT: input reports are lost. GARBAGE: random. SHORT: halved. Any thread.
void hid_set_fault(struct hid_device_emulated *device, enum wire_fault fault);

// Runs act(context) while the model is at rest. Any thread.
void hid_with_model(struct hid_device_emulated *device, void (*act)(void *context),
                    void *context);

// Unplugs and ends the thread. Accepts NULL.
void hid_emulation_end(struct hid_device_emulated *device);

#endif
