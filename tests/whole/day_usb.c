// SPDX-License-Identifier: Apache-2.0
// libusb as the Ocean driver calls it, with the spectrometer's model behind it
// and no bus between: the symbols of the program come before the library's.
#include <libusb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "files/write.h"
#include "simulator/model_ooi.h"
#include "simulator/wire_fault.h"
#include "tests/whole/day.h"

enum { HUB_VENDOR = 0x1d6b, PACKET = 512, PACKETS_TO_PULL = 2, ENDPOINTS_MOST = 4 };
enum { CALIBRATION_FIRST_NM = 340, CALIBRATION_LAST_NM = 1027 };
static const int64_t TRANSFER_NS = 120 * NS_PER_US; // of one packet at high speed, with its turn

struct libusb_context {
    int devices;
};

struct libusb_device {
    struct libusb_context *context;
    int references, bus, address;
    bool hub;
    uint8_t descriptors[USB_DESCRIPTOR_MOST];
};

struct libusb_device_handle {
    struct libusb_device *device;
};

static struct {
    struct ooi *ooi;
    struct usb_model model;
    struct noise noise;
    bool plugged, blank, stall_armed;
    int bus, address, fault, packets;
    uint32_t halted; // bit n: IN endpoint n
    int held;
} bus;

// ---- the plug ------------------------------------------------------------------

static void pull(void)
{
    if (bus.plugged)
        bus.model.unplugged(bus.model.context, clock_now_ns());
    bus.plugged = false;
}

static void plug(bool blank)
{
    if (bus.plugged && blank == bus.blank)
        return;
    pull();
    bus.model = blank ? usb_blank_model() : ooi_model(bus.ooi);
    bus.blank = blank;
    bus.address = bus.address % 127 + 1;
    bus.halted = 0;
    bus.plugged = true;
}

static enum ooi_upset upset_of(int fault)
{
    return fault == WIRE_DEAF           ? OOI_DEAF
           : fault == WIRE_NO_SYNC      ? OOI_NO_SYNC
           : fault == WIRE_BAD_SYNC     ? OOI_BAD_SYNC
           : fault == WIRE_OUT_OF_STEP  ? OOI_OUT_OF_STEP
           : fault == WIRE_OTHER_PIXELS ? OOI_OTHER_PIXELS
                                        : OOI_WELL;
}

void day_usb_strike(int fault)
{
    if (fault == WIRE_UNPLUGGED || fault == WIRE_MOVED || fault == WIRE_FORBIDDEN ||
        fault == DAY_BUSY)
        pull();
    bus.bus = fault == WIRE_MOVED ? 3 - bus.bus : bus.bus;
    if (fault != WIRE_UNPLUGGED)
        plug(fault == WIRE_BLANK);
    bus.fault = fault;
    bus.packets = 0;
    bus.stall_armed = fault == WIRE_STALL;
    ooi_upset(bus.ooi, upset_of(fault));
}

static bool write_calibration(const char *path)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, NULL))
        return false;
    fprintf(file.stream, "nm,uJ_per_count\n");
    for (int nm = CALIBRATION_FIRST_NM; nm <= CALIBRATION_LAST_NM; nm++)
        fprintf(file.stream, "%d,%.8e\n", nm, ooi_calibration(bus.ooi, nm));
    return whole_file_commit(&file, NULL);
}

bool day_usb_open(const struct around *around, int64_t now_ns, const char *calibration_path)
{
    struct ooi_options options = {.around = *around,
                                  .serial = "EMU2P0001",
                                  .seed = 1,
                                  .collector_mm2 = 11.95,
                                  .powered_ns = now_ns};
    bus.ooi = ooi_create(&options);
    bus.bus = 1;
    noise_init(&bus.noise, options.seed, 'u');
    if (!bus.ooi)
        return false;
    plug(false);
    return write_calibration(calibration_path);
}

int day_usb_held(void)
{
    return bus.held;
}

void day_usb_close(void)
{
    ooi_destroy(bus.ooi);
    bus.ooi = NULL;
}

// ---- what libusb finds ---------------------------------------------------------

int LIBUSB_CALL libusb_init(libusb_context **context)
{
    *context = calloc(1, sizeof **context);
    bus.held += *context != NULL;
    return *context ? 0 : LIBUSB_ERROR_NO_MEM;
}

void LIBUSB_CALL libusb_exit(libusb_context *context)
{
    bus.held -= 1 + (context->devices != 0); // what is left is left for good
    free(context);
}

static libusb_device *device_new(libusb_context *context, bool hub)
{
    libusb_device *d = calloc(1, sizeof *d);
    if (!d)
        return NULL;
    *d = (struct libusb_device){context, 1, bus.bus, hub ? 0 : bus.address, hub, {0}};
    if (hub)
        memcpy(d->descriptors + 8, (const uint8_t[]){HUB_VENDOR & 0xff, HUB_VENDOR >> 8, 2, 0}, 4);
    else
        memcpy(d->descriptors, bus.model.descriptors, bus.model.descriptors_size);
    context->devices++;
    bus.held++;
    return d;
}

libusb_device *LIBUSB_CALL libusb_ref_device(libusb_device *device)
{
    device->references++;
    return device;
}

void LIBUSB_CALL libusb_unref_device(libusb_device *device)
{
    if (--device->references > 0)
        return;
    device->context->devices--;
    bus.held--;
    free(device);
}

ssize_t LIBUSB_CALL libusb_get_device_list(libusb_context *context, libusb_device ***list)
{
    libusb_device **all = calloc(3, sizeof *all);
    ssize_t count = 0;
    if (!all)
        return LIBUSB_ERROR_NO_MEM;
    lane_pass(clock_now_ns() + TRANSFER_NS);
    all[count++] = device_new(context, true);
    if (bus.plugged)
        all[count++] = device_new(context, false);
    bus.held++;
    *list = all;
    return count;
}

void LIBUSB_CALL libusb_free_device_list(libusb_device **list, int unreference)
{
    for (libusb_device **d = list; unreference && *d; d++)
        libusb_unref_device(*d);
    bus.held--;
    free(list);
}

int LIBUSB_CALL libusb_get_device_descriptor(libusb_device *device,
                                             struct libusb_device_descriptor *out)
{
    const uint8_t *d = device->descriptors;
    *out = (struct libusb_device_descriptor){.idVendor = (uint16_t)(d[8] | d[9] << 8),
                                             .idProduct = (uint16_t)(d[10] | d[11] << 8)};
    return 0;
}

// The descriptors of one configuration with one interface, unpacked.
struct unpacked {
    struct libusb_config_descriptor config;
    struct libusb_interface face;
    struct libusb_interface_descriptor setting;
    struct libusb_endpoint_descriptor endpoints[ENDPOINTS_MOST];
};

int LIBUSB_CALL libusb_get_config_descriptor(libusb_device *device, uint8_t index,
                                             struct libusb_config_descriptor **out)
{
    const uint8_t *config = device->descriptors + 18, *setting = config + 9, *at = setting + 9;
    struct unpacked *u = calloc(1, sizeof *u);
    (void)index;
    if (!u)
        return LIBUSB_ERROR_NO_MEM;
    u->config.bNumInterfaces = config[4];
    u->config.interface = &u->face;
    u->face.altsetting = &u->setting;
    u->face.num_altsetting = 1;
    u->setting.bNumEndpoints = setting[4];
    u->setting.endpoint = u->endpoints;
    for (int i = 0; i < setting[4] && i < ENDPOINTS_MOST; i++, at += 7)
        u->endpoints[i] =
            (struct libusb_endpoint_descriptor){.bEndpointAddress = at[2],
                                                .bmAttributes = at[3],
                                                .wMaxPacketSize = (uint16_t)(at[4] | at[5] << 8)};
    bus.held++;
    *out = &u->config;
    return 0;
}

void LIBUSB_CALL libusb_free_config_descriptor(struct libusb_config_descriptor *config)
{
    bus.held--;
    free(config);
}

// ---- one that is open ----------------------------------------------------------

static bool is_there(const libusb_device *d)
{
    return bus.plugged && d->bus == bus.bus && d->address == bus.address;
}

int LIBUSB_CALL libusb_open(libusb_device *device, libusb_device_handle **handle)
{
    if (!is_there(device))
        return LIBUSB_ERROR_NO_DEVICE;
    if (bus.fault == WIRE_FORBIDDEN)
        return LIBUSB_ERROR_ACCESS;
    *handle = calloc(1, sizeof **handle);
    if (!*handle)
        return LIBUSB_ERROR_NO_MEM;
    (*handle)->device = libusb_ref_device(device);
    bus.held++;
    return 0;
}

void LIBUSB_CALL libusb_close(libusb_device_handle *handle)
{
    libusb_unref_device(handle->device);
    bus.held--;
    free(handle);
}

int LIBUSB_CALL libusb_set_auto_detach_kernel_driver(libusb_device_handle *handle, int enable)
{
    (void)handle, (void)enable;
    return 0;
}

int LIBUSB_CALL libusb_get_configuration(libusb_device_handle *handle, int *configuration)
{
    *configuration = 1;
    return is_there(handle->device) ? 0 : LIBUSB_ERROR_NO_DEVICE;
}

int LIBUSB_CALL libusb_set_configuration(libusb_device_handle *handle, int configuration)
{
    (void)configuration;
    return is_there(handle->device) ? 0 : LIBUSB_ERROR_NO_DEVICE;
}

int LIBUSB_CALL libusb_claim_interface(libusb_device_handle *handle, int number)
{
    (void)number;
    return !is_there(handle->device) ? LIBUSB_ERROR_NO_DEVICE
           : bus.fault == DAY_BUSY   ? LIBUSB_ERROR_BUSY
                                     : 0;
}

int LIBUSB_CALL libusb_release_interface(libusb_device_handle *handle, int number)
{
    (void)number;
    return is_there(handle->device) ? 0 : LIBUSB_ERROR_NO_DEVICE;
}

const char *LIBUSB_CALL libusb_error_name(int code)
{
    static char text[32];
    snprintf(text, sizeof text, "libusb error %d", code);
    return text;
}

int LIBUSB_CALL libusb_clear_halt(libusb_device_handle *handle, unsigned char endpoint)
{
    if (!is_there(handle->device))
        return LIBUSB_ERROR_NO_DEVICE;
    if (endpoint & 0x80)
        bus.halted &= ~(1u << (endpoint & 0x0f));
    bus.model.clear_halt(bus.model.context, endpoint);
    return 0;
}

// ---- transfers -----------------------------------------------------------------

static void drain(uint8_t endpoint)
{
    uint8_t packet[USB_PACKET_MOST];
    int64_t again_ns;
    while (bus.model.in(bus.model.context, endpoint, clock_now_ns(), packet, &again_ns) >= 0)
        continue;
}

static bool loses_the_rest(int fault)
{
    return fault == WIRE_SHORT || fault == WIRE_SILENT || fault == WIRE_OVERFLOW;
}

// One packet as the fault lets it through; -EAGAIN when nothing arrives.
static int next_packet(uint8_t endpoint, uint8_t packet[USB_PACKET_MOST], int64_t *again_ns)
{
    const uint32_t bit = 1u << (endpoint & 0x0f);
    if (bus.halted & bit)
        return -EPIPE;
    int size = bus.model.in(bus.model.context, endpoint, clock_now_ns(), packet, again_ns);
    if (size < 0 || bus.fault == WIRE_FINE)
        return size;
    if (bus.stall_armed) {
        bus.stall_armed = false;
        bus.halted |= bit;
        drain(endpoint);
        return -EPIPE;
    }
    bus.packets += size == PACKET;
    if (bus.fault == WIRE_PULLED_IN_SPECTRUM && bus.packets >= PACKETS_TO_PULL) {
        pull();
        return -ENODEV;
    }
    if (loses_the_rest(bus.fault))
        drain(endpoint);
    if (bus.fault == WIRE_OVERFLOW || bus.fault == DAY_IO_ERROR)
        return bus.fault == WIRE_OVERFLOW ? -EOVERFLOW : -EIO;
    if (bus.fault >= DAY_BUSY)
        return size;
    size = (int)fault_on((enum wire_fault)bus.fault, &bus.noise, packet, (size_t)size);
    return size == 0 && bus.fault == WIRE_SILENT ? -EAGAIN : size;
}

static int code_of(int error)
{
    return error == -EPIPE       ? LIBUSB_ERROR_PIPE
           : error == -EOVERFLOW ? LIBUSB_ERROR_OVERFLOW
           : error == -ENODEV    ? LIBUSB_ERROR_NO_DEVICE
           : error               ? LIBUSB_ERROR_IO
                                 : 0;
}

static int receive(const libusb_device *d, uint8_t endpoint, uint8_t *bytes, int length, int *moved,
                   int64_t until_ns)
{
    while (*moved < length) {
        uint8_t packet[USB_PACKET_MOST];
        int64_t again_ns;
        if (!is_there(d))
            return -ENODEV;
        int size = next_packet(endpoint, packet, &again_ns);
        if (size == -EAGAIN && clock_now_ns() >= until_ns)
            return -ETIMEDOUT;
        if (size == -EAGAIN) {
            lane_pass(again_ns < until_ns ? again_ns : until_ns);
            continue;
        }
        if (size < 0)
            return size;
        int room = length - *moved, count = size < room ? size : room;
        memcpy(bytes + *moved, packet, (size_t)count);
        *moved += count;
        lane_pass(clock_now_ns() + TRANSFER_NS);
        if (size > room)
            return -EOVERFLOW;
        if (size < PACKET)
            return 0;
    }
    return 0;
}

static int transmit(uint8_t endpoint, const uint8_t *bytes, int length, int *moved)
{
    if (bus.fault == WIRE_PULLED_IN_COMMAND) {
        pull();
        return -ENODEV;
    }
    int error = bus.model.out(bus.model.context, endpoint, clock_now_ns(), bytes, (size_t)length);
    *moved = error ? 0 : length;
    lane_pass(clock_now_ns() + TRANSFER_NS);
    return error;
}

// A time-out of 0 is none in libusb: the driver never asks for that.
int LIBUSB_CALL libusb_bulk_transfer(libusb_device_handle *handle, unsigned char endpoint,
                                     unsigned char *bytes, int length, int *moved,
                                     unsigned timeout_ms)
{
    *moved = 0;
    if (!is_there(handle->device))
        return LIBUSB_ERROR_NO_DEVICE;
    if (!timeout_ms)
        abort();
    int64_t until_ns = clock_now_ns() + timeout_ms * NS_PER_MS;
    int error = endpoint & 0x80 ? receive(handle->device, endpoint, bytes, length, moved, until_ns)
                                : transmit(endpoint, bytes, length, moved);
    return error == -ETIMEDOUT ? LIBUSB_ERROR_TIMEOUT : code_of(error);
}
