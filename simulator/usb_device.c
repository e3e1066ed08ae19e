// SPDX-License-Identifier: Apache-2.0
#include "simulator/usb_device.h"

#include <linux/usbdevice_fs.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>

#include "base/clock.h"
#include "simulator/usb_place.h"
#include "simulator/wire_device.h"
#include "simulator/wire_fault.h"
#include "simulator/wire_uevent.h"

enum { URBS = 64, SETUP_SIZE = 8 };
enum { FULL_PACKETS_TO_PULL = 2 };

struct urb {
    UMockdevIoctlData *data, *buffer; // struct usbdevfs_urb; what it points to
    UMockdevIoctlClient *owner;       // compared only
    unsigned long address;            // of the struct in the host program
    uint8_t type, endpoint;
    size_t length, actual;
    int status;
    uint8_t *received; // copied to buffer when reaped: until then umockdev may be reading that
};

struct urbs {
    struct urb items[URBS];
    int count;
};

struct usb_device {
    struct wire_device wire; // its lock guards what follows shown
    struct usb_place place;
    bool shown; // in the testbed
    struct usb_model model;
    struct urbs pending, done;
    int full_packets; // since the fault was set
    bool stall_armed;
    uint32_t halted; // bit n: IN endpoint n stalled by a fault
};

// ---- request blocks ------------------------------------------------------------

static struct urb take(struct urbs *urbs, int at)
{
    struct urb urb = urbs->items[at];
    urbs->count--;
    memmove(urbs->items + at, urbs->items + at + 1,
            (size_t)(urbs->count - at) * sizeof(urbs->items[0]));
    return urb;
}

static void drop(struct urb *urb)
{
    g_clear_object(&urb->buffer);
    g_clear_object(&urb->data);
    free(urb->received);
}

static void finish(struct usb_device *d, int at, int status)
{
    struct urb urb = take(&d->pending, at);
    urb.status = status;
    if (d->done.count == URBS)
        drop(&urb);
    else
        d->done.items[d->done.count++] = urb;
    node_set_writable(&d->wire.node, true);
}

static int find(const struct urbs *urbs, const UMockdevIoctlClient *owner, unsigned long address)
{
    for (int i = 0; i < urbs->count; i++)
        if (urbs->items[i].owner == owner && (!address || urbs->items[i].address == address))
            return i;
    return -1;
}

static void drop_of(struct urbs *urbs, const UMockdevIoctlClient *owner)
{
    for (int at = find(urbs, owner, 0); at >= 0; at = find(urbs, owner, 0)) {
        struct urb urb = take(urbs, at);
        drop(&urb);
    }
}

// ---- transfers -------------------------------------------------------------------

static size_t packet_size(const struct usb_device *d)
{
    return d->model.megabits == 480 ? 512 : 64;
}

static void drain(struct usb_device *d, uint8_t endpoint, int64_t now_ns)
{
    uint8_t packet[USB_PACKET_MOST];
    int64_t again_ns;
    while (d->model.in(d->model.context, endpoint, now_ns, packet, &again_ns) >= 0)
        continue;
}

// The plug comes out: the host's requests end, the testbed is told by unplug.
static void come_off(struct usb_device *d)
{
    d->wire.plugged = false;
    d->wire.clients.count = 0;
    while (d->pending.count > 0)
        finish(d, 0, -ESHUTDOWN);
    d->model.unplugged(d->model.context, clock_now_ns());
}

static int tear(struct usb_device *d)
{
    d->wire.torn = true;
    waiter_wake(&d->wire.waiter);
    return -ESHUTDOWN;
}

// One packet as the fault lets it through; -EAGAIN when nothing arrives.
static int next_packet(struct usb_device *d, uint8_t endpoint, int64_t now_ns,
                       uint8_t packet[USB_PACKET_MOST], int64_t *again_ns)
{
    uint32_t bit = 1u << (endpoint & 0x0F);
    if (d->halted & bit)
        return -EPIPE;
    int size = d->model.in(d->model.context, endpoint, now_ns, packet, again_ns);
    if (size < 0 || d->wire.fault == WIRE_FINE)
        return size;
    if (d->stall_armed) {
        d->stall_armed = false;
        d->halted |= bit;
        drain(d, endpoint, now_ns);
        return -EPIPE;
    }
    d->full_packets += (size_t)size == packet_size(d);
    if (d->wire.fault == WIRE_PULLED_IN_SPECTRUM && d->full_packets >= FULL_PACKETS_TO_PULL)
        return tear(d);
    if (d->wire.fault == WIRE_SHORT || d->wire.fault == WIRE_SILENT ||
        d->wire.fault == WIRE_OVERFLOW)
        drain(d, endpoint, now_ns);
    if (d->wire.fault == WIRE_OVERFLOW)
        return -EOVERFLOW;
    size = (int)fault_on(d->wire.fault, &d->wire.noise, packet, (size_t)size);
    return size == 0 && d->wire.fault == WIRE_SILENT ? -EAGAIN : size;
}

// 1 = goes on waiting, else the status it ends with.
static int transfer_in(struct usb_device *d, struct urb *urb, int64_t now_ns, int64_t *again_ns)
{
    for (;;) {
        uint8_t packet[USB_PACKET_MOST];
        int size = next_packet(d, urb->endpoint, now_ns, packet, again_ns);
        if (size == -EAGAIN)
            return 1;
        if (size < 0)
            return size;
        size_t room = urb->length - urb->actual;
        bool overflow = (size_t)size > room;
        size_t count = overflow ? room : (size_t)size;
        if (count)
            memcpy(urb->received + urb->actual, packet, count);
        urb->actual += count;
        if (overflow)
            return -EOVERFLOW;
        if ((size_t)size < packet_size(d) || urb->actual == urb->length)
            return 0;
    }
}

static int transfer_out(struct usb_device *d, struct urb *urb, int64_t now_ns)
{
    const uint8_t *bytes = urb->buffer ? urb->buffer->data : NULL;
    if (d->wire.fault == WIRE_PULLED_IN_COMMAND)
        return tear(d);
    int status = d->model.out(d->model.context, urb->endpoint, now_ns, bytes, urb->length);
    urb->actual = status == 0 ? urb->length : 0;
    return status;
}

static int transfer_control(struct usb_device *d, struct urb *urb)
{
    enum { FROM_DEVICE = 0x80, GET_DESCRIPTOR = 6 };
    const uint8_t *setup = urb->buffer ? urb->buffer->data : NULL;
    uint8_t descriptor[USB_DESCRIPTOR_MOST];
    if (!setup || urb->length < SETUP_SIZE || setup[0] != FROM_DEVICE || setup[1] != GET_DESCRIPTOR)
        return -EPIPE;
    size_t size = usb_descriptor(&d->model, setup[3], setup[2], descriptor);
    size_t wanted = (size_t)setup[6] | (size_t)setup[7] << 8;
    if (size == 0)
        return -EPIPE;
    size = size < wanted ? size : wanted;
    size = size < urb->length - SETUP_SIZE ? size : urb->length - SETUP_SIZE;
    memcpy(urb->received, descriptor, size);
    urb->actual = size;
    return 0;
}

static int transfer(struct usb_device *d, struct urb *urb, int64_t now_ns, int64_t *again_ns)
{
    if (urb->type == USBDEVFS_URB_TYPE_CONTROL)
        return transfer_control(d, urb);
    if (urb->type != USBDEVFS_URB_TYPE_BULK)
        return -EINVAL;
    if (urb->endpoint & 0x80)
        return transfer_in(d, urb, now_ns, again_ns);
    return transfer_out(d, urb, now_ns);
}

// Moves every transfer as far as it goes; those of one endpoint wait for each
// other. Returns when to come back.
static int64_t pump(void *owner)
{
    struct usb_device *d = owner;
    int64_t now_ns = clock_now_ns(), again_ns = INT64_MAX;
    bool busy[256] = {false};
    for (int i = 0; !d->wire.torn && i < d->pending.count;) {
        struct urb *urb = &d->pending.items[i];
        int64_t this_ns = INT64_MAX;
        int status = busy[urb->endpoint] ? 1 : transfer(d, urb, now_ns, &this_ns);
        if (status == 1) {
            busy[urb->endpoint] = true;
            again_ns = this_ns < again_ns ? this_ns : again_ns;
            i++;
        } else {
            finish(d, i, status);
        }
    }
    if (d->wire.torn && d->wire.plugged)
        come_off(d);
    return again_ns;
}

// ---- usbfs -----------------------------------------------------------------------

static int submit(struct usb_device *d, UMockdevIoctlClient *client, UMockdevIoctlData *arg)
{
    if (d->pending.count == URBS)
        return -ENOMEM;
    struct urb urb = {.owner = client};
    urb.data = umockdev_ioctl_data_resolve(arg, 0, sizeof(struct usbdevfs_urb), NULL);
    if (!urb.data)
        return -EFAULT;
    const struct usbdevfs_urb *u = (const struct usbdevfs_urb *)(const void *)urb.data->data;
    urb.address = urb.data->client_addr;
    urb.type = u->type;
    urb.endpoint = u->endpoint;
    urb.length = u->buffer_length > 0 ? (size_t)u->buffer_length : 0;
    if (urb.length)
        urb.buffer = umockdev_ioctl_data_resolve(urb.data, offsetof(struct usbdevfs_urb, buffer),
                                                 urb.length, NULL);
    urb.received = malloc(urb.length + 1);
    if ((urb.length && !urb.buffer) || !urb.received) {
        drop(&urb);
        return -EFAULT;
    }
    d->pending.items[d->pending.count++] = urb;
    pump(d);
    waiter_wake(&d->wire.waiter);
    return 0;
}

static int reap(struct usb_device *d, UMockdevIoctlClient *client, UMockdevIoctlData *arg)
{
    int at = find(&d->done, client, 0);
    if (at < 0)
        return clients_have(&d->wire.clients, client) ? -EAGAIN : -ENODEV;
    UMockdevIoctlData *pointer = umockdev_ioctl_data_resolve(arg, 0, sizeof(void *), NULL);
    if (!pointer)
        return -EFAULT;
    struct urb urb = take(&d->done, at);
    struct usbdevfs_urb *u = (struct usbdevfs_urb *)(void *)urb.data->data;
    u->status = urb.status;
    u->actual_length = (int)urb.actual;
    size_t before = urb.type == USBDEVFS_URB_TYPE_CONTROL ? SETUP_SIZE : 0;
    if (urb.actual && (before || urb.endpoint & 0x80))
        memcpy(urb.buffer->data + before, urb.received, urb.actual);
    umockdev_ioctl_data_set_ptr(pointer, 0, urb.data);
    drop(&urb);
    g_object_unref(pointer);
    node_set_writable(&d->wire.node, d->done.count > 0);
    return 0;
}

static int discard(struct usb_device *d, UMockdevIoctlClient *client, UMockdevIoctlData *arg)
{
    unsigned long address;
    memcpy(&address, arg->data, sizeof(address));
    int at = find(&d->pending, client, address);
    if (at < 0)
        return -EINVAL;
    finish(d, at, -ENOENT);
    return 0;
}

static int get_capabilities(UMockdevIoctlData *arg)
{
    guint32 capabilities = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                           USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_BULK_SCATTER_GATHER |
                           USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
    int result = wire_device_put(arg, sizeof(capabilities), &capabilities, sizeof(capabilities));
    return result < 0 ? result : 0;
}

static int clear_halt(struct usb_device *d, UMockdevIoctlData *arg)
{
    UMockdevIoctlData *in = umockdev_ioctl_data_resolve(arg, 0, sizeof(unsigned int), NULL);
    if (!in)
        return -EFAULT;
    uint8_t endpoint = in->data[0];
    g_object_unref(in);
    if (endpoint & 0x80)
        d->halted &= ~(1u << (endpoint & 0x0F));
    d->model.clear_halt(d->model.context, endpoint);
    return 0;
}

static int answer(void *owner, UMockdevIoctlClient *client)
{
    struct usb_device *d = owner;
    UMockdevIoctlData *arg = umockdev_ioctl_client_get_arg(client);
    gulong request = umockdev_ioctl_client_get_request(client);
    if (request == USBDEVFS_REAPURBNDELAY || request == USBDEVFS_REAPURB)
        return reap(d, client, arg);
    if (!d->wire.plugged || !clients_have(&d->wire.clients, client))
        return -ENODEV;
    switch (request) {
    case USBDEVFS_SUBMITURB:
        return submit(d, client, arg);
    case USBDEVFS_DISCARDURB:
        return discard(d, client, arg);
    case USBDEVFS_GET_CAPABILITIES:
        return get_capabilities(arg);
    case USBDEVFS_CLEAR_HALT:
        return clear_halt(d, arg);
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_SETINTERFACE:
    case USBDEVFS_RESET:
        return 0;
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL: // asks to detach a kernel driver: there is none
        return -ENODATA;
    default:
        return -ENOTTY;
    }
}

static void vanished(void *owner, UMockdevIoctlClient *client)
{
    struct usb_device *d = owner;
    drop_of(&d->pending, client);
    drop_of(&d->done, client);
}

// ---- the plug ----------------------------------------------------------------------

static void tell(struct usb_device *d, const char *action)
{
    struct uevent uevent = {d->place.sysfs,   "usb",     "usb_device",
                            d->place.devnode, USB_MAJOR, usb_place_minor(&d->place)};
    uevent_tell(d->wire.testbed, &uevent, action);
}

static bool show(void *owner, struct error *err)
{
    struct usb_device *d = owner;
    GString *text = g_string_new(NULL);
    usb_place_describe(&d->place, &d->model, text);
    if (!wire_device_add(&d->wire, text, err) ||
        !node_link_device(&d->wire.node, d->wire.testbed, d->wire.devnode, err))
        return false;
    d->shown = true;
    tell(d, "add");
    return true;
}

static void withdraw(struct usb_device *d)
{
    tell(d, "remove");
    umockdev_testbed_remove_device(d->wire.testbed, d->place.sysfs);
    node_forget_number(d->wire.testbed, USB_MAJOR, usb_place_minor(&d->place));
    wire_device_hide(&d->wire);
    d->shown = false;
}

bool usb_device_is_plugged(struct usb_device *device)
{
    waiter_lock(&device->wire.waiter);
    bool plugged = device->wire.plugged && !device->wire.torn;
    waiter_unlock(&device->wire.waiter);
    return plugged;
}

bool usb_device_plug(struct usb_device *device, struct error *err)
{
    struct usb_device *d = device;
    if (usb_device_is_plugged(d))
        return true;
    usb_device_unplug(d); // when it is torn and its thread has not seen to it yet
    usb_place_next(&d->place);
    snprintf(d->wire.devnode, sizeof(d->wire.devnode), "%s", d->place.devnode);
    if (!wire_device_attach(&d->wire, err))
        return false;
    node_set_writable(&d->wire.node, false);
    d->halted = 0;
    return wire_device_come_in(&d->wire, err);
}

static void torn_off(void *owner)
{
    usb_device_unplug(owner);
}

void usb_device_unplug(struct usb_device *device)
{
    struct usb_device *d = device;
    waiter_lock(&d->wire.waiter);
    if (d->wire.plugged)
        come_off(d);
    d->wire.torn = false;
    waiter_unlock(&d->wire.waiter);
    if (d->shown)
        withdraw(d);
}

void usb_device_move(struct usb_device *device)
{
    usb_device_unplug(device);
    device->place.bus = device->place.bus == 1 ? 2 : 1;
}

void usb_device_become(struct usb_device *device, const struct usb_model *model)
{
    usb_device_unplug(device);
    waiter_lock(&device->wire.waiter);
    device->model = *model;
    waiter_unlock(&device->wire.waiter);
}

static const struct wire_device_bus bus = {.noise = 'u',
                                           .pump = pump,
                                           .answer = answer,
                                           .vanished = vanished,
                                           .show = show,
                                           .torn_off = torn_off};

struct usb_device *usb_device_create(UMockdevTestbed *testbed, pthread_mutex_t *pulling, int port,
                                     const struct usb_model *model, uint64_t seed,
                                     struct error *err)
{
    struct usb_device *d = calloc(1, sizeof(*d));
    if (!d) {
        fail(err, ERROR_SYSTEM, "out of memory");
        return NULL;
    }
    d->model = *model;
    d->wire.pulling = pulling;
    d->place.bus = 1;
    d->place.port = port;
    bool started = wire_device_start(&d->wire, testbed, seed, &bus, d, err);
    if (started)
        return d;
    usb_device_destroy(d);
    return NULL;
}

void usb_device_set_fault(struct usb_device *device, enum wire_fault fault)
{
    waiter_lock(&device->wire.waiter);
    device->stall_armed = fault == WIRE_STALL;
    device->full_packets = 0;
    waiter_unlock(&device->wire.waiter);
    wire_device_set_fault(&device->wire, fault);
}

void usb_with_model(struct usb_device *device, void (*act)(void *context), void *context)
{
    wire_device_with(&device->wire, act, context);
}

void usb_device_destroy(struct usb_device *device)
{
    struct usb_device *d = device;
    if (!d)
        return;
    wire_device_stop(&d->wire);
    usb_device_unplug(d);
    wire_device_end(&d->wire);
    for (; d->done.count > 0; d->done.count--)
        drop(&d->done.items[d->done.count - 1]);
    free(d);
}
