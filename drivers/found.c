// SPDX-License-Identifier: Apache-2.0
#include "drivers/found.h"

#include <errno.h>
#include <fcntl.h>
#include <hidapi.h>
#include <libudev.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <wchar.h>

#include "drivers/udev.h"

const char *found_access_name(enum found_access access)
{
    switch (access) {
#define X(name, text)                                                                              \
    case FOUND_##name:                                                                             \
        return text;
        FOUND_ACCESSES(X)
#undef X
    }
    return "";
}

void found_text(char *out, size_t size, const char *text)
{
    size_t n = 0;
    text = text ? text + strspn(text, " \t\n") : "";
    for (; *text && n + 1 < size; text++)
        out[n++] = *text >= ' ' && *text <= '~' ? *text : '?';
    while (n > 0 && (out[n - 1] == ' ' || out[n - 1] == '?'))
        n--;
    out[n] = 0;
}

struct found *found_add(struct found_list *list, const char *kind, const char *driver,
                        const char *place)
{
    if (list->count >= FOUND_MOST)
        return NULL;
    struct found *f = &list->of[list->count++];
    *f = (struct found){.access = FOUND_USABLE};
    snprintf(f->kind, sizeof f->kind, "%s", kind);
    snprintf(f->driver, sizeof f->driver, "%s", driver);
    snprintf(f->place, sizeof f->place, "%s", place);
    if (access(place, R_OK | W_OK) != 0 && (errno == EACCES || errno == EPERM))
        found_refuse(f);
    return f;
}

void found_refuse(struct found *f)
{
    f->access = FOUND_REFUSED;
    snprintf(f->note, sizeof f->note, "no permission; install the udev rules %s", UDEV_RULES_FILE);
}

void found_blame(struct found *f, const struct error *err)
{
    f->access = udev_refused(err)           ? FOUND_REFUSED
                : err->code == ERROR_SYSTEM ? FOUND_IN_USE
                                            : FOUND_FAULTY;
    found_text(f->note, sizeof f->note, err->text);
}

// Opening a hidraw node does nothing to the device, and says more than its mode.
static void try_to_open(struct found *f)
{
    int fd = open(f->place, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd >= 0)
        close(fd);
    else if (errno == EACCES || errno == EPERM)
        found_refuse(f);
}

static void narrow(char *out, size_t size, const wchar_t *wide)
{
    char text[128];
    size_t n = 0;
    for (; wide && *wide && n + 1 < sizeof text; wide++)
        text[n++] = *wide > 0 && *wide < 127 ? (char)*wide : '?';
    text[n] = 0;
    found_text(out, size, text);
}

void found_trackers(struct found_list *list)
{
    for (const struct device_id *id = wiimote_ids; id->name; id++) {
        struct hid_device_info *all =
            hid_enumerate((unsigned short)id->vendor, (unsigned short)id->product);
        for (struct hid_device_info *info = all; info; info = info->next) {
            struct found *f = found_add(list, "tracker", "wiimote", info->path);
            if (!f)
                break;
            narrow(f->model, sizeof f->model, info->product_string);
            narrow(f->serial, sizeof f->serial, info->serial_number);
            if (info->release_number)
                snprintf(f->firmware, sizeof f->firmware, "%x.%02x", info->release_number >> 8,
                         info->release_number & 255);
            f->emulated = !strncmp(f->serial, "EMU", 3);
            try_to_open(f);
        }
        hid_free_enumeration(all);
    }
}

static const char *attribute(struct udev_device *usb, const char *name)
{
    const char *text = udev_device_get_sysattr_value(usb, name);
    return text ? text : "";
}

static unsigned number(struct udev_device *usb, const char *name)
{
    return (unsigned)strtoul(attribute(usb, name), NULL, 16);
}

static const char *adapter_name(unsigned vendor, unsigned product)
{
    for (const struct device_id *id = witmotion_ids; id->name; id++)
        if (id->bus == DEVICE_SERIAL && id->vendor == vendor && id->product == product)
            return id->name;
    return NULL;
}

// A line with a USB adapter behind it; on-board ports are always there and say
// nothing.
static void add_line(struct found_list *list, struct udev_device *tty)
{
    struct udev_device *usb =
        udev_device_get_parent_with_subsystem_devtype(tty, "usb", "usb_device");
    const char *node = udev_device_get_devnode(tty);
    struct found *f = usb && node ? found_add(list, "serial line", "", node) : NULL;
    if (!f)
        return;
    const char *known = adapter_name(number(usb, "idVendor"), number(usb, "idProduct"));
    found_text(f->model, sizeof f->model, known ? known : attribute(usb, "product"));
    found_text(f->serial, sizeof f->serial, attribute(usb, "serial"));
    found_text(f->firmware, sizeof f->firmware, attribute(usb, "bcdDevice"));
    f->emulated = !strncmp(f->serial, "EMU", 3);
}

void found_serial_lines(struct found_list *list)
{
    struct udev *udev = udev_new();
    struct udev_enumerate *all = udev ? udev_enumerate_new(udev) : NULL;
    struct udev_list_entry *entry = NULL;
    if (all && udev_enumerate_add_match_subsystem(all, "tty") >= 0 &&
        udev_enumerate_scan_devices(all) >= 0)
        entry = udev_enumerate_get_list_entry(all);
    for (; entry; entry = udev_list_entry_get_next(entry)) {
        struct udev_device *tty =
            udev_device_new_from_syspath(udev, udev_list_entry_get_name(entry));
        if (tty)
            add_line(list, tty);
        udev_device_unref(tty);
    }
    udev_enumerate_unref(all);
    udev_unref(udev);
}

void found_all(struct found_list *list, int64_t deadline_ns)
{
    found_spectrometers(list, deadline_ns);
    found_trackers(list);
    found_iio(list);
    found_serial_lines(list);
}
