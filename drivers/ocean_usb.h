// SPDX-License-Identifier: Apache-2.0
// The USB transport of the Ocean family with an FPGA: commands out on 0x01,
// replies in on 0x81, spectra in on 0x82. No time-out is unbounded, nothing is
// reset. One thread.
#ifndef DRIVERS_OCEAN_USB_H
#define DRIVERS_OCEAN_USB_H

#include <stddef.h>
#include <stdint.h>

#include "drivers/ocean_models.h"

struct ocean_usb;

// Opens and claims the index-th (0, 1, ...) unit on the bus after checking its
// descriptors: the model by its product id, the endpoints 01, 81, 82 and, where
// the model splits its spectra, 86. NULL with GONE (no such unit), SYSTEM (not permitted: names the
// udev rule; or in use), DATA (the endpoints are not there).
struct ocean_usb *ocean_usb_open(int index, struct error *err);

// Of what was opened.
const struct ocean_model *ocean_usb_model(const struct ocean_usb *usb);

// Accepts NULL.
void ocean_usb_close(struct ocean_usb *usb);

// One command. RETRY on a time-out or a stall (which is cleared), GONE.
bool ocean_usb_send(struct ocean_usb *usb, const uint8_t *bytes, size_t count, int64_t deadline_ns,
                    struct error *err);

// One reply of exactly count (1..64) bytes. RETRY as above; DATA when shorter
// or longer.
bool ocean_usb_reply(struct ocean_usb *usb, uint8_t *bytes, size_t count, int64_t deadline_ns,
                     struct error *err);

// One spectrum of at most size bytes within timeout_ms (> 0); *count is what
// came. At high speed (told by the unit's status) a model that splits its
// spectra sends the first part on 86, the rest on 82. RETRY as above, GONE.
bool ocean_usb_spectrum(struct ocean_usb *usb, bool high_speed, uint8_t *bytes, size_t size,
                        int timeout_ms, size_t *count, struct error *err);

// Reads away what the IN endpoints still hold, until each is quiet for 10 ms.
// False only with GONE, or RETRY when they do not fall quiet by deadline_ns.
bool ocean_usb_drain(struct ocean_usb *usb, int64_t deadline_ns, struct error *err);

#endif
