// SPDX-License-Identifier: Apache-2.0
#include <libusb.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/found.h"
#include "drivers/ocean_usb.h"
#include "drivers/udev.h"

enum { QUERY_SLOT = 0x05, SLOT_SERIAL = 0, SLOT_BYTES = 17, READ_FPGA = 0x6b, FPGA_VERSION = 4 };

static const struct device_id *known(libusb_device *device)
{
    struct libusb_device_descriptor d;
    if (libusb_get_device_descriptor(device, &d) != 0)
        return NULL;
    for (const struct device_id *id = ocean_ids; id->name; id++)
        if (d.idVendor == id->vendor && d.idProduct == id->product)
            return id;
    return NULL;
}

static bool ask(struct ocean_usb *usb, struct found *f, int64_t deadline_ns, struct error *err)
{
    uint8_t slot[SLOT_BYTES], version[3];
    if (!ocean_usb_drain(usb, deadline_ns, err) ||
        !ocean_usb_send(usb, (const uint8_t[]){QUERY_SLOT, SLOT_SERIAL}, 2, deadline_ns, err) ||
        !ocean_usb_reply(usb, slot, sizeof slot, deadline_ns, err))
        return while_doing(err, "asking for the serial number");
    char text[SLOT_BYTES - 1];
    snprintf(text, sizeof text, "%.15s", (const char *)slot + 2);
    found_text(f->serial, sizeof f->serial, text);
    f->emulated = !strncmp(f->serial, "EMU", 3);
    if (!ocean_usb_send(usb, (const uint8_t[]){READ_FPGA, FPGA_VERSION}, 2, deadline_ns, err) ||
        !ocean_usb_reply(usb, version, sizeof version, deadline_ns, err))
        return while_doing(err, "asking for the firmware");
    snprintf(f->firmware, sizeof f->firmware, "%d.%02d.%d", version[2] >> 4,
             (version[2] & 15) << 4 | version[1] >> 4, version[1] & 15);
    return true;
}

// The index-th unit of the bus, counted as ocean_usb_open counts.
static void describe(struct found *f, int index, int64_t deadline_ns)
{
    struct error err = {0};
    if (f->access == FOUND_REFUSED)
        return;
    struct ocean_usb *usb = ocean_usb_open(index, &err);
    if (!usb || !ask(usb, f, deadline_ns, &err))
        found_blame(f, &err);
    ocean_usb_close(usb);
}

void found_spectrometers(struct found_list *list, int64_t deadline_ns)
{
    libusb_context *context;
    libusb_device **all;
    if (libusb_init(&context) != 0)
        return;
    ssize_t count = libusb_get_device_list(context, &all);
    for (ssize_t i = 0, index = 0; i < count; i++) {
        const struct device_id *id = known(all[i]);
        char node[64];
        if (!id)
            continue;
        snprintf(node, sizeof node, "/dev/bus/usb/%03d/%03d", libusb_get_bus_number(all[i]),
                 libusb_get_device_address(all[i]));
        struct found *f = found_add(list, "spectrometer", "ocean", node);
        if (!f)
            break;
        found_text(f->model, sizeof f->model, id->name);
        if (clock_now_ns() < deadline_ns)
            describe(f, (int)index, deadline_ns);
        index++;
    }
    if (count >= 0)
        libusb_free_device_list(all, 1);
    libusb_exit(context);
}
