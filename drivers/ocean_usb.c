// SPDX-License-Identifier: Apache-2.0
#include "drivers/ocean_usb.h"

#include <libusb.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/deadline.h"
#include "drivers/udev.h"

enum {
    EP_COMMAND = 0x01,
    EP_REPLY = 0x81,
    EP_SPECTRUM = 0x82,
    EP_SPLIT = 0x86,
    COMMAND_MS = 500,
    QUIET_MS = 10,
    DRAIN_TRIES = 32,
    BUFFER_BYTES = 16384, // a multiple of every packet size, so that nothing overflows
};

// What a unit looks like whose firmware did not load from its EEPROM.
static const struct device_id bare_chip = {DEVICE_USB, 0x04b4, 0x8613, "bare FX2"};

struct ocean_usb {
    libusb_context *context;
    libusb_device_handle *handle;
    const struct ocean_model *model;
    bool claimed;
    uint8_t buffer[BUFFER_BYTES];
};

static bool fail_usb(struct error *err, int code, const char *doing)
{
    switch (code) {
    case LIBUSB_ERROR_ACCESS:
        return fail(err, ERROR_SYSTEM,
                    "%s: no permission; install the udev rules " UDEV_RULES_FILE
                    " (boothcal list --udev) and replug",
                    doing);
    case LIBUSB_ERROR_BUSY:
        return fail(err, ERROR_SYSTEM, "%s: another program uses the spectrometer", doing);
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
    case LIBUSB_ERROR_IO:
        return fail(err, ERROR_GONE, "%s: the spectrometer is gone", doing);
    case LIBUSB_ERROR_TIMEOUT:
        return fail(err, ERROR_RETRY, "%s: no answer in time", doing);
    case LIBUSB_ERROR_PIPE:
        return fail(err, ERROR_RETRY, "%s: endpoint stalled", doing);
    case LIBUSB_ERROR_OVERFLOW:
        return fail(err, ERROR_RETRY, "%s: more bytes than asked for", doing);
    }
    return fail(err, ERROR_SYSTEM, "%s: %s", doing, libusb_error_name(code));
}

static bool is(const struct libusb_device_descriptor *d, const struct device_id *id)
{
    return d->idVendor == id->vendor && d->idProduct == id->product;
}

// The index-th unit, referenced; bare tells whether an unloaded chip was seen.
static libusb_device *find(struct ocean_usb *usb, int index, bool *bare)
{
    libusb_device **list, *found = NULL;
    ssize_t count = libusb_get_device_list(usb->context, &list);
    for (ssize_t i = 0; i < count && !found; i++) {
        struct libusb_device_descriptor d;
        if (libusb_get_device_descriptor(list[i], &d) != 0)
            continue;
        *bare = *bare || is(&d, &bare_chip);
        usb->model = d.idVendor == OCEAN_VENDOR ? ocean_model(d.idProduct) : NULL;
        if (usb->model && index-- == 0)
            found = libusb_ref_device(list[i]);
    }
    if (count >= 0)
        libusb_free_device_list(list, 1);
    return found;
}

static bool has_bulk(const struct libusb_interface_descriptor *face, int address)
{
    for (int i = 0; i < face->bNumEndpoints; i++)
        if (face->endpoint[i].bEndpointAddress == address)
            return (face->endpoint[i].bmAttributes & 3) == LIBUSB_TRANSFER_TYPE_BULK &&
                   face->endpoint[i].wMaxPacketSize > 0;
    return false;
}

static bool check_descriptors(const struct ocean_usb *usb, libusb_device *device, struct error *err)
{
    struct libusb_config_descriptor *config;
    int code = libusb_get_config_descriptor(device, 0, &config);
    if (code)
        return fail_usb(err, code, "reading the USB descriptors");
    bool fits = config->bNumInterfaces > 0 && config->interface[0].num_altsetting > 0;
    const struct libusb_interface_descriptor *face = fits ? config->interface[0].altsetting : NULL;
    fits = fits && has_bulk(face, EP_COMMAND) && has_bulk(face, EP_REPLY) &&
           has_bulk(face, EP_SPECTRUM) && (!usb->model->split_bytes || has_bulk(face, EP_SPLIT));
    libusb_free_config_descriptor(config);
    return fits || fail(err, ERROR_DATA, "the %s lacks one of the endpoints 01, 81, 82%s",
                        usb->model->name, usb->model->split_bytes ? ", 86" : "");
}

static bool claim(struct ocean_usb *usb, struct error *err)
{
    int configured = 0;
    libusb_set_auto_detach_kernel_driver(usb->handle, 1);
    int code = libusb_get_configuration(usb->handle, &configured);
    if (!code && configured != 1)
        code = libusb_set_configuration(usb->handle, 1);
    if (!code)
        code = libusb_claim_interface(usb->handle, 0);
    if (code)
        return fail_usb(err, code, "claiming the spectrometer");
    usb->claimed = true;
    return true;
}

static bool open_on_bus(struct ocean_usb *usb, int index, struct error *err)
{
    bool bare = false;
    int code = libusb_init(&usb->context);
    if (code)
        return fail_usb(err, code, "starting libusb");
    libusb_device *device = find(usb, index, &bare);
    if (!device)
        return fail(err, ERROR_GONE, "no spectrometer on the USB bus%s",
                    bare ? "; a bare FX2 (04b4:8613) is: its firmware did not load, replug it"
                         : "");
    bool fits = check_descriptors(usb, device, err);
    code = fits ? libusb_open(device, &usb->handle) : 0;
    libusb_unref_device(device);
    if (code)
        return fail_usb(err, code, "opening the spectrometer");
    return fits && claim(usb, err);
}

struct ocean_usb *ocean_usb_open(int index, struct error *err)
{
    struct ocean_usb *usb = calloc(1, sizeof *usb);
    if (!usb) {
        fail_errno(err, "opening the spectrometer");
        return NULL;
    }
    if (open_on_bus(usb, index, err))
        return usb;
    ocean_usb_close(usb);
    return NULL;
}

const struct ocean_model *ocean_usb_model(const struct ocean_usb *usb)
{
    return usb->model;
}

void ocean_usb_close(struct ocean_usb *usb)
{
    if (!usb)
        return;
    if (usb->claimed)
        libusb_release_interface(usb->handle, 0);
    if (usb->handle)
        libusb_close(usb->handle);
    if (usb->context)
        libusb_exit(usb->context);
    free(usb);
}

// libusb takes a time-out of 0 for unlimited.
static int bulk(struct ocean_usb *usb, int endpoint, uint8_t *bytes, int size, int timeout_ms,
                int *moved)
{
    *moved = 0;
    if (timeout_ms <= 0)
        return LIBUSB_ERROR_TIMEOUT;
    int code = libusb_bulk_transfer(usb->handle, (unsigned char)endpoint, bytes, size, moved,
                                    (unsigned)timeout_ms);
    if (code == LIBUSB_ERROR_PIPE)
        libusb_clear_halt(usb->handle, (unsigned char)endpoint);
    return code;
}

bool ocean_usb_send(struct ocean_usb *usb, const uint8_t *bytes, size_t count, int64_t deadline_ns,
                    struct error *err)
{
    int moved;
    memcpy(usb->buffer, bytes, count);
    int code = bulk(usb, EP_COMMAND, usb->buffer, (int)count, deadline_ms(deadline_ns, COMMAND_MS),
                    &moved);
    if (!code && moved != (int)count)
        code = LIBUSB_ERROR_TIMEOUT;
    return !code || fail_usb(err, code, "sending a command");
}

bool ocean_usb_reply(struct ocean_usb *usb, uint8_t *bytes, size_t count, int64_t deadline_ns,
                     struct error *err)
{
    int moved;
    int code = bulk(usb, EP_REPLY, usb->buffer, 512, deadline_ms(deadline_ns, COMMAND_MS), &moved);
    if (code)
        return fail_usb(err, code, "waiting for a reply");
    if (moved != (int)count)
        return fail(err, ERROR_DATA, "reply of %d bytes instead of %zu", moved, count);
    memcpy(bytes, usb->buffer, count);
    return true;
}

// The first part decides how long to wait, the rest follows at once.
bool ocean_usb_spectrum(struct ocean_usb *usb, bool high_speed, uint8_t *bytes, size_t size,
                        int timeout_ms, size_t *count, struct error *err)
{
    int first = 0, moved = 0, code = 0, split = high_speed ? usb->model->split_bytes : 0;
    const int64_t end_ns = clock_now_ns() + timeout_ms * NS_PER_MS;
    if (split)
        code = bulk(usb, EP_SPLIT, usb->buffer, split, timeout_ms, &first);
    if (!code && first == split)
        code = bulk(usb, EP_SPECTRUM, usb->buffer + first, BUFFER_BYTES / 2,
                    deadline_ms(end_ns, split ? COMMAND_MS : timeout_ms), &moved);
    if (code)
        return fail_usb(err, code, "waiting for a spectrum");
    *count = (size_t)(first + moved);
    memcpy(bytes, usb->buffer, *count < size ? *count : size);
    return true;
}

static bool drain_endpoint(struct ocean_usb *usb, int endpoint, int64_t deadline_ns,
                           struct error *err)
{
    for (int tries = 0; tries < DRAIN_TRIES; tries++) {
        int moved, timeout = deadline_ms(deadline_ns, QUIET_MS);
        if (timeout <= 0)
            break;
        int code = bulk(usb, endpoint, usb->buffer, BUFFER_BYTES, timeout, &moved);
        if (code == LIBUSB_ERROR_TIMEOUT && moved == 0)
            return true;
        if (code && code != LIBUSB_ERROR_TIMEOUT && code != LIBUSB_ERROR_PIPE &&
            code != LIBUSB_ERROR_OVERFLOW)
            return fail_usb(err, code, "draining the spectrometer");
    }
    return fail(err, ERROR_RETRY, "endpoint %02x does not fall quiet", endpoint);
}

bool ocean_usb_drain(struct ocean_usb *usb, int64_t deadline_ns, struct error *err)
{
    return (!usb->model->split_bytes || drain_endpoint(usb, EP_SPLIT, deadline_ns, err)) &&
           drain_endpoint(usb, EP_SPECTRUM, deadline_ns, err) &&
           drain_endpoint(usb, EP_REPLY, deadline_ns, err);
}
