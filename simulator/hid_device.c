// SPDX-License-Identifier: Apache-2.0
#include "simulator/hid_device.h"

#include <linux/hidraw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/wire_device.h"
#include "simulator/wire_fault.h"
#include "simulator/wire_uevent.h"

enum { REPORTS = 64 }; // as the kernel's hidraw keeps for a reader
enum { FLOOD_TIMES = 50, OTHER_REPORT = 0x3D };

struct report {
    uint8_t bytes[HID_REPORT_MOST];
    size_t size;
};

struct hid_device_emulated {
    struct wire_device wire; // its lock guards what follows the paths
    int number;              // of the HID device, 1 at the first plug
    char hid_path[128], hidraw_path[192];
    struct hid_model model;
    struct report queue[REPORTS];
    int queued;
    UMockdevIoctlClient *reader; // waits in a blocking read
};

// ---- reports -----------------------------------------------------------------------

static struct report take(struct hid_device_emulated *d)
{
    struct report first = d->queue[0];
    d->queued--;
    memmove(d->queue, d->queue + 1, (size_t)d->queued * sizeof(d->queue[0]));
    if (d->queued == 0)
        node_set_readable(&d->wire.node, false);
    return first;
}

static void give(UMockdevIoctlClient *client, const struct report *report)
{
    UMockdevIoctlData *arg = umockdev_ioctl_client_get_arg(client);
    size_t room = (size_t)arg->data_len;
    size_t size = report->size < room ? report->size : room;
    umockdev_ioctl_data_update(arg, 0, (guint8 *)report->bytes, (gint)size);
    umockdev_ioctl_client_complete(client, (glong)size, 0);
}

static void queue_once(struct hid_device_emulated *d, struct report report)
{
    report.size = fault_on(d->wire.fault, &d->wire.noise, report.bytes, report.size);
    if (report.size == 0 || d->wire.clients.count == 0)
        return;
    if (d->reader) {
        give(d->reader, &report);
        d->reader = NULL;
        return;
    }
    if (d->queued == REPORTS)
        return;
    d->queue[d->queued++] = report;
    if (d->queued == 1)
        node_set_readable(&d->wire.node, true);
}

static void queue(struct hid_device_emulated *d, struct report report)
{
    if (d->wire.fault == WIRE_WRONG_REPORT)
        report.bytes[0] = OTHER_REPORT;
    int times = d->wire.fault == WIRE_FLOOD ? FLOOD_TIMES : 1;
    for (int i = 0; i < times; i++)
        queue_once(d, report);
}

static int64_t pump(void *owner)
{
    struct hid_device_emulated *d = owner;
    for (;;) {
        struct report report;
        int64_t again_ns;
        int size = d->model.in(d->model.context, clock_now_ns(), report.bytes, &again_ns);
        if (size < 0)
            return again_ns;
        report.size = (size_t)size;
        queue(d, report);
    }
}

// ---- hidraw --------------------------------------------------------------------------

static gboolean on_read(UMockdevIoctlBase *handler, UMockdevIoctlClient *client, gpointer data)
{
    (void)handler;
    struct hid_device_emulated *d = data;
    waiter_lock(&d->wire.waiter);
    if (!clients_have(&d->wire.clients, client)) {
        umockdev_ioctl_client_complete(client, -1, EIO);
    } else if (d->queued > 0) {
        struct report report = take(d);
        give(client, &report);
    } else {
        d->reader = client;
    }
    waiter_unlock(&d->wire.waiter);
    return TRUE;
}

static gboolean on_write(UMockdevIoctlBase *handler, UMockdevIoctlClient *client, gpointer data)
{
    (void)handler;
    struct hid_device_emulated *d = data;
    UMockdevIoctlData *arg = umockdev_ioctl_client_get_arg(client);
    size_t size = (size_t)arg->data_len;
    waiter_lock(&d->wire.waiter);
    int status = -ENODEV;
    if (clients_have(&d->wire.clients, client))
        status = d->model.out(d->model.context, clock_now_ns(), arg->data, size);
    waiter_wake(&d->wire.waiter);
    waiter_unlock(&d->wire.waiter);
    umockdev_ioctl_client_complete(client, status < 0 ? -1 : (glong)size, status < 0 ? -status : 0);
    return TRUE;
}

static int put_descriptor(const struct hid_model *m, UMockdevIoctlData *arg)
{
    struct hidraw_report_descriptor text = {.size = (uint32_t)m->descriptor_size};
    memcpy(text.value, m->descriptor, m->descriptor_size);
    int result = wire_device_put(arg, sizeof(text), &text, sizeof(text));
    return result < 0 ? result : 0;
}

static int answer(void *owner, UMockdevIoctlClient *client)
{
    struct hid_device_emulated *d = owner;
    gulong request = umockdev_ioctl_client_get_request(client);
    UMockdevIoctlData *arg = umockdev_ioctl_client_get_arg(client);
    const struct hid_model *m = &d->model;
    if (!clients_have(&d->wire.clients, client))
        return -ENODEV;
    if (request == HIDIOCGRDESCSIZE) {
        int size = (int)m->descriptor_size;
        return wire_device_put(arg, sizeof(size), &size, sizeof(size)) < 0 ? -EFAULT : 0;
    }
    if (request == HIDIOCGRDESC)
        return put_descriptor(m, arg);
    if (request == HIDIOCGRAWINFO) {
        struct hidraw_devinfo info = {m->bus, (int16_t)m->vendor, (int16_t)m->product};
        return wire_device_put(arg, sizeof(info), &info, sizeof(info)) < 0 ? -EFAULT : 0;
    }
    size_t size = _IOC_SIZE(request);
    if (_IOC_TYPE(request) != 'H')
        return -ENOTTY;
    if (_IOC_NR(request) == _IOC_NR(HIDIOCGRAWNAME(0)))
        return wire_device_put(arg, size, m->name, strlen(m->name) + 1);
    if (_IOC_NR(request) == _IOC_NR(HIDIOCGRAWUNIQ(0)))
        return wire_device_put(arg, size, m->unique, strlen(m->unique) + 1);
    return -EPIPE; // feature reports: this device has none
}

static void vanished(void *owner, UMockdevIoctlClient *client)
{
    struct hid_device_emulated *d = owner;
    if (d->reader == client)
        d->reader = NULL;
    while (d->wire.clients.count == 0 && d->queued > 0)
        take(d);
}

// ---- the radio link ------------------------------------------------------------------

static void describe_hid(const struct hid_device_emulated *d, GString *text)
{
    const struct hid_model *m = &d->model;
    g_string_append_printf(text,
                           "P: %s\nE: SUBSYSTEM=hid\nE: HID_ID=%04X:%08X:%08X\nE: HID_NAME=%s\n"
                           "E: HID_PHYS=00:1f:00:00:00:01\nE: HID_UNIQ=%s\n"
                           "E: MODALIAS=hid:b%04Xg0001v%08Xp%08X\nH: report_descriptor=",
                           d->hid_path, m->bus, m->vendor, m->product, m->name, m->unique, m->bus,
                           m->vendor, m->product);
    for (size_t i = 0; i < m->descriptor_size; i++)
        g_string_append_printf(text, "%02x", m->descriptor[i]);
    g_string_append_c(text, '\n');
}

// hidapi finds a device by the number of its node, so the terminal's stands here.
static void describe_hidraw(const struct hid_device_emulated *d, GString *text)
{
    g_string_append_printf(text,
                           "P: %s\nN: %s=00\nE: SUBSYSTEM=hidraw\nE: DEVNAME=%s\nE: MAJOR=%d\n"
                           "E: MINOR=%d\nA: dev=%d:%d\\n\nL: device=../../../%s\n",
                           d->hidraw_path, d->wire.devnode + strlen("/dev/"), d->wire.devnode,
                           d->wire.node.major_number, d->wire.node.minor_number,
                           d->wire.node.major_number, d->wire.node.minor_number,
                           strrchr(d->hid_path, '/') + 1);
}

static bool add(struct hid_device_emulated *d,
                void (*describe)(const struct hid_device_emulated *, GString *), struct error *err)
{
    GString *text = g_string_new(NULL);
    describe(d, text);
    return wire_device_add(&d->wire, text, err);
}

static void tell(struct hid_device_emulated *d, const char *path, const char *action)
{
    char sys[256];
    bool raw = path == d->hidraw_path;
    snprintf(sys, sizeof(sys), "/sys%s", path);
    struct uevent uevent = {.sysfs = sys,
                            .subsystem = raw ? "hidraw" : "hid",
                            .devnode = raw ? d->wire.devnode : NULL,
                            .major_number = d->wire.node.major_number,
                            .minor_number = d->wire.node.minor_number};
    uevent_tell(d->wire.testbed, &uevent, action);
}

static void remove_from_sysfs(struct hid_device_emulated *d, const char *path)
{
    char sys[256];
    snprintf(sys, sizeof(sys), "/sys%s", path);
    tell(d, path, "remove");
    umockdev_testbed_remove_device(d->wire.testbed, sys);
}

static bool show(void *owner, struct error *err)
{
    struct hid_device_emulated *d = owner;
    if (!add(d, describe_hid, err) || !add(d, describe_hidraw, err) ||
        !node_link_device(&d->wire.node, d->wire.testbed, d->wire.devnode, err))
        return false;
    tell(d, d->hid_path, "add");
    tell(d, d->hidraw_path, "add");
    return true;
}

bool hid_plug(struct hid_device_emulated *device, struct error *err)
{
    struct hid_device_emulated *d = device;
    if (d->wire.plugged)
        return true;
    const struct hid_model *m = &d->model;
    d->number++;
    snprintf(d->wire.devnode, sizeof(d->wire.devnode), "/dev/hidraw%d", d->number - 1);
    snprintf(d->hid_path, sizeof(d->hid_path), "/devices/virtual/misc/uhid/%04X:%04X:%04X.%04X",
             m->bus, m->vendor, m->product, d->number);
    snprintf(d->hidraw_path, sizeof(d->hidraw_path), "%s/hidraw/hidraw%d", d->hid_path,
             d->number - 1);
    return wire_device_attach(&d->wire, err) && wire_device_come_in(&d->wire, err);
}

bool hid_is_plugged(const struct hid_device_emulated *device)
{
    return device->wire.plugged;
}

void hid_unplug(struct hid_device_emulated *device)
{
    struct hid_device_emulated *d = device;
    if (!d->wire.plugged)
        return;
    waiter_lock(&d->wire.waiter);
    d->wire.plugged = false;
    d->wire.clients.count = 0;
    d->queued = 0;
    if (d->reader)
        umockdev_ioctl_client_complete(d->reader, -1, EIO);
    d->reader = NULL;
    waiter_unlock(&d->wire.waiter);
    remove_from_sysfs(d, d->hidraw_path);
    remove_from_sysfs(d, d->hid_path);
    node_forget_number(d->wire.testbed, d->wire.node.major_number, d->wire.node.minor_number);
    wire_device_hide(&d->wire);
}

static const struct wire_device_bus bus = {
    .noise = 'h', .pump = pump, .answer = answer, .vanished = vanished, .show = show};

struct hid_device_emulated *hid_emulate(UMockdevTestbed *testbed, const struct hid_model *model,
                                        uint64_t seed, struct error *err)
{
    struct hid_device_emulated *d = calloc(1, sizeof(*d));
    if (!d) {
        fail(err, ERROR_SYSTEM, "out of memory");
        return NULL;
    }
    d->model = *model;
    bool started = wire_device_start(&d->wire, testbed, seed, &bus, d, err);
    g_signal_connect(d->wire.handler, "handle-read", G_CALLBACK(on_read), d);
    g_signal_connect(d->wire.handler, "handle-write", G_CALLBACK(on_write), d);
    if (started)
        return d;
    hid_emulation_end(d);
    return NULL;
}

void hid_set_fault(struct hid_device_emulated *device, enum wire_fault fault)
{
    wire_device_set_fault(&device->wire, fault);
}

void hid_with_model(struct hid_device_emulated *device, void (*act)(void *context), void *context)
{
    wire_device_with(&device->wire, act, context);
}

void hid_emulation_end(struct hid_device_emulated *device)
{
    struct hid_device_emulated *d = device;
    if (!d)
        return;
    hid_unplug(d);
    wire_device_end(&d->wire);
    free(d);
}
