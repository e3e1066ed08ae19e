// SPDX-License-Identifier: Apache-2.0
// An emulated HID device as a state machine: reports out, reports in. It knows
// no clock and no operating system; hid_device.h puts it below hidapi, tests
// drive it by hand.
#ifndef SIMULATOR_HID_MODEL_H
#define SIMULATOR_HID_MODEL_H

#include <errno.h>
#include <stddef.h>
#include <stdint.h>

enum { HID_REPORT_MOST = 64 };

// All calls of one model come from one thread at a time, now_ns never goes back.
struct hid_model {
    void *context;
    uint16_t bus, vendor, product; // bus as in linux/input.h
    const char *name, *unique;
    const uint8_t *descriptor; // report descriptor
    size_t descriptor_size;

    // One output report, its id first. Returns 0 or a negative errno.
    int (*out)(void *context, int64_t now_ns, const uint8_t *report, size_t size);

    // The next input report that is due, its id first. Returns its size, or
    // -EAGAIN with *again_ns = when the next one may be due, INT64_MAX = not
    // before something is sent out.
    int (*in)(void *context, int64_t now_ns, uint8_t report[HID_REPORT_MOST], int64_t *again_ns);
};

#endif
