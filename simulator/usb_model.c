// SPDX-License-Identifier: Apache-2.0
#include "simulator/usb_model.h"

#include <string.h>

enum { DEVICE = 1, CONFIGURATION = 2, STRING = 3, DEVICE_SIZE = 18, US_ENGLISH = 0x0409 };

static size_t string_descriptor(const struct usb_model *m, int index, uint8_t *out)
{
    const char *text = index == 0 ? "" : index < 4 ? m->strings[index] : NULL;
    if (!text)
        return 0;
    size_t size = 2;
    for (; *text && size < USB_DESCRIPTOR_MOST - 2; text++, size += 2) {
        out[size] = (uint8_t)*text;
        out[size + 1] = 0;
    }
    if (index == 0) { // the one language
        out[2] = US_ENGLISH & 0xFF;
        out[3] = US_ENGLISH >> 8;
        size = 4;
    }
    out[0] = (uint8_t)size;
    out[1] = STRING;
    return size;
}

size_t usb_descriptor(const struct usb_model *model, int type, int index,
                      uint8_t out[USB_DESCRIPTOR_MOST])
{
    if (type == STRING)
        return string_descriptor(model, index, out);
    if (type != DEVICE && type != CONFIGURATION)
        return 0;
    size_t from = type == DEVICE ? 0 : DEVICE_SIZE;
    size_t size = type == DEVICE ? DEVICE_SIZE : model->descriptors_size - DEVICE_SIZE;
    memcpy(out, model->descriptors + from, size);
    return size;
}

// ---- without firmware -------------------------------------------------------------

static const uint8_t blank_descriptors[] = {
    18, 1, 0x00, 0x02, 0xff, 0xff, 0xff, 64, 0xb4, 0x04, 0x13, 0x86, 0x00, 0x00, 0, 0, 0, 1,
    9,  2, 18,   0,    1,    1,    0,    0x80, 50,
    9,  4, 0,    0,    0,    0xff, 0xff, 0xff, 0,
};

static int blank_out(void *context, uint8_t endpoint, int64_t now_ns, const uint8_t *bytes,
                     size_t size)
{
    (void)context, (void)endpoint, (void)now_ns, (void)bytes, (void)size;
    return -EPIPE;
}

static int blank_in(void *context, uint8_t endpoint, int64_t now_ns,
                    uint8_t packet[USB_PACKET_MOST], int64_t *again_ns)
{
    (void)context, (void)endpoint, (void)now_ns, (void)packet;
    *again_ns = INT64_MAX;
    return -EPIPE;
}

static void blank_clear_halt(void *context, uint8_t endpoint)
{
    (void)context, (void)endpoint;
}

static void blank_unplugged(void *context, int64_t now_ns)
{
    (void)context, (void)now_ns;
}

struct usb_model usb_blank_model(void)
{
    return (struct usb_model){.descriptors = blank_descriptors,
                              .descriptors_size = sizeof(blank_descriptors),
                              .strings = {NULL, "", "", ""},
                              .megabits = 480,
                              .out = blank_out,
                              .in = blank_in,
                              .clear_halt = blank_clear_halt,
                              .unplugged = blank_unplugged};
}
