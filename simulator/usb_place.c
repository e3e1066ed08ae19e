// SPDX-License-Identifier: Apache-2.0
#include "simulator/usb_place.h"

#include <stdio.h>
#include <string.h>

enum { FIRST_NUMBER = 2, PLUGS_PER_ROUND = 63, BUS_MINORS = 128 };

void usb_place_next(struct usb_place *place)
{
    struct usb_place *p = place;
    p->number = FIRST_NUMBER + USB_PORTS * (p->plugs++ % PLUGS_PER_ROUND) + p->port - 1;
    snprintf(p->devnode, sizeof(p->devnode), "/dev/bus/usb/%03d/%03d", p->bus, p->number);
    snprintf(p->sysfs, sizeof(p->sysfs), "/sys/devices/usb%d/%d-%d", p->bus, p->bus, p->port);
}

int usb_place_minor(const struct usb_place *place)
{
    return (place->bus - 1) * BUS_MINORS + place->number - 1;
}

void usb_place_describe(const struct usb_place *place, const struct usb_model *model,
                        GString *text)
{
    const uint8_t *b = model->descriptors;
    g_string_append_printf(text,
                           "P: %s\nN: %s\nE: SUBSYSTEM=usb\n"
                           "E: DRIVER=usb\nE: BUSNUM=%03d\nE: DEVNUM=%03d\n"
                           "E: DEVNAME=%s\nE: DEVTYPE=usb_device\n"
                           "E: PRODUCT=%x/%x/%x\nE: MAJOR=%d\nE: MINOR=%d\n",
                           place->sysfs + strlen("/sys"), place->devnode + strlen("/dev/"),
                           place->bus, place->number, place->devnode, b[8] | b[9] << 8, b[10] | b[11] << 8,
                           b[12] | b[13] << 8, USB_MAJOR, usb_place_minor(place));
    g_string_append_printf(text,
                           "A: bConfigurationValue=1\\n\nA: busnum=%d\\n\nA: devnum=%d\\n\n"
                           "A: speed=%d\\n\nA: idVendor=%02x%02x\\n\nA: idProduct=%02x%02x\\n\n"
                           "A: manufacturer=%s\\n\nA: product=%s\\n\nA: serial=%s\\n\n"
                           "A: dev=%d:%d\\n\nH: descriptors=",
                           place->bus, place->number, model->megabits, b[9], b[8], b[11], b[10],
                           model->strings[1], model->strings[2], model->strings[3], USB_MAJOR,
                           usb_place_minor(place));
    for (size_t i = 0; i < model->descriptors_size; i++)
        g_string_append_printf(text, "%02x", b[i]);
    g_string_append_c(text, '\n');
}
