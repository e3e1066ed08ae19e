// SPDX-License-Identifier: Apache-2.0
// An emulated USB device as a state machine: what the bus asks of it and what
// it answers. It knows no clock and no operating system; usb_device.h puts it
// below libusb, tests drive it by hand.
#ifndef SIMULATOR_USB_MODEL_H
#define SIMULATOR_USB_MODEL_H

#include <errno.h>
#include <stddef.h>
#include <stdint.h>

enum { USB_PACKET_MOST = 512, USB_DESCRIPTOR_MOST = 256 };

// All calls of one model come from one thread at a time, now_ns never goes
// back. -EAGAIN is NAK, -EPIPE a stall.
struct usb_model {
    void *context;
    const uint8_t *descriptors; // device descriptor, then one configuration with all that is in it
    size_t descriptors_size;
    const char *strings[4];     // [1]..[3], as the device descriptor numbers them; NULL = none
    int megabits;               // 480 or 12

    // One OUT transfer. Returns 0 or a negative errno.
    int (*out)(void *context, uint8_t endpoint, int64_t now_ns, const uint8_t *bytes, size_t size);

    // One IN packet into packet. Returns its size (0..packet size of the
    // endpoint) or a negative errno; with -EAGAIN *again_ns is when asking
    // again is worth while, INT64_MAX = not before something else happened.
    int (*in)(void *context, uint8_t endpoint, int64_t now_ns, uint8_t packet[USB_PACKET_MOST],
              int64_t *again_ns);

    // The host cleared a halt of this endpoint.
    void (*clear_halt)(void *context, uint8_t endpoint);

    // The plug was pulled: when it is back, so is power.
    void (*unplugged)(void *context, int64_t now_ns);
};

// The bridge chip of such instruments (Cypress FX2) when it found no firmware:
// 04B4:8613, nothing to talk to.
struct usb_model usb_blank_model(void);

// What the device answers to GET_DESCRIPTOR; returns its size, 0 = it has none.
size_t usb_descriptor(const struct usb_model *model, int type, int index,
                      uint8_t out[USB_DESCRIPTOR_MOST]);

#endif
