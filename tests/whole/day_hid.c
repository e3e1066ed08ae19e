// SPDX-License-Identifier: Apache-2.0
// hidapi as the Wii remote's driver calls it, with the remote's model behind
// it: reports queue up as they do in the kernel while nobody reads.
#include <hidapi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>

#include "base/clock.h"
#include "simulator/model_noise.h"
#include "simulator/model_wiimote.h"
#include "simulator/wire_fault.h"
#include "tests/whole/day.h"

enum { QUEUE = 64, FLOOD_TIMES = 50, OTHER_REPORT = 0x3d };
static const int64_t CALL_NS = 50 * NS_PER_US;
static const char NODE[] = "/dev/hidraw-of-the-day";
static const char UNWRITABLE[] = "/proc/sys/kernel/osrelease"; // by root either

struct hid_device_ {
    int plugs;
};

struct queued {
    uint8_t bytes[HID_REPORT_MOST];
    size_t size;
};

static struct {
    struct wiimote *remote;
    struct hid_model model;
    struct noise noise;
    bool plugged, upset_armed;
    int plugs, fault, held, first, count;
    struct queued queue[QUEUE];
    int64_t due_ns; // when the remote may have something to say
} air;

static void plug(void)
{
    if (air.plugged)
        return;
    wiimote_connect(air.remote);
    air.plugged = true;
    air.plugs++;
    air.count = 0;
}

void day_hid_strike(int fault)
{
    if (fault == WIRE_UNPLUGGED || fault == WIRE_FORBIDDEN)
        air.plugged = false;
    if (fault != WIRE_UNPLUGGED)
        plug();
    if (fault == WIRE_STALL || fault == DAY_AWAY_UPSET)
        wiimote_upset(air.remote);
    air.fault = fault;
}

bool day_hid_open(const struct around *around)
{
    struct wiimote_options options = {
        .around = *around, .serial = "EMUWIIMOTE", .seed = 1, .pitch_deg = 10};
    air.remote = wiimote_create(&options);
    if (!air.remote)
        return false;
    air.model = wiimote_model(air.remote);
    noise_init(&air.noise, options.seed, 'h');
    plug();
    return true;
}

int day_hid_held(void)
{
    return air.held;
}

void day_hid_close(void)
{
    wiimote_destroy(air.remote);
    air.remote = NULL;
}

// ---- reports -------------------------------------------------------------------

static void queue_once(struct queued report)
{
    if (air.fault < DAY_BUSY)
        report.size = fault_on((enum wire_fault)air.fault, &air.noise, report.bytes, report.size);
    if (report.size > 0 && air.count < QUEUE) // a full queue takes no more
        air.queue[(air.first + air.count++) % QUEUE] = report;
}

static void queue(struct queued report)
{
    if (air.fault == WIRE_WRONG_REPORT)
        report.bytes[0] = OTHER_REPORT;
    for (int i = 0; i < (air.fault == WIRE_FLOOD ? FLOOD_TIMES : 1); i++)
        queue_once(report);
}

// All that is due by now, each at its time; when the queue is full there is no
// need to see what else is lost.
static void pump(void)
{
    const int64_t now_ns = clock_now_ns();
    while (air.plugged) {
        struct queued report;
        int64_t at_ns = air.count < QUEUE && air.due_ns < now_ns ? air.due_ns : now_ns;
        int size = air.model.in(air.model.context, at_ns, report.bytes, &air.due_ns);
        report.size = (size_t)size;
        if (size >= 0)
            queue(report);
        else if (at_ns == now_ns)
            return;
    }
}

// ---- hidapi --------------------------------------------------------------------

struct hid_device_info *HID_API_EXPORT hid_enumerate(unsigned short vendor, unsigned short product)
{
    lane_pass(clock_now_ns() + CALL_NS);
    if (!air.plugged || vendor != air.model.vendor || product != air.model.product)
        return NULL;
    struct hid_device_info *info = calloc(1, sizeof *info);
    if (!info)
        return NULL;
    info->path = strdup(air.fault == WIRE_FORBIDDEN ? UNWRITABLE : NODE);
    info->serial_number = wcsdup(L"EMUWIIMOTE");
    info->product_string = wcsdup(L"Nintendo RVL-CNT-01");
    air.held++;
    return info;
}

void HID_API_EXPORT hid_free_enumeration(struct hid_device_info *info)
{
    if (!info)
        return;
    free(info->path);
    free(info->serial_number);
    free(info->product_string);
    free(info);
    air.held--;
}

hid_device *HID_API_EXPORT hid_open_path(const char *path)
{
    if (!air.plugged || strcmp(path, NODE))
        return NULL;
    hid_device *d = calloc(1, sizeof *d);
    if (!d)
        return NULL;
    d->plugs = air.plugs;
    air.held++;
    air.count = 0; // the kernel queues for who is there
    air.due_ns = clock_now_ns();
    return d;
}

void HID_API_EXPORT hid_close(hid_device *device)
{
    free(device);
    air.held--;
}

static bool is_there(const hid_device *d)
{
    return air.plugged && d->plugs == air.plugs;
}

int HID_API_EXPORT hid_write(hid_device *device, const unsigned char *bytes, size_t size)
{
    lane_pass(clock_now_ns() + CALL_NS);
    if (!is_there(device))
        return -1;
    pump();
    return air.model.out(air.model.context, clock_now_ns(), bytes, size) < 0 ? -1 : (int)size;
}

static int take(unsigned char *bytes, size_t size)
{
    struct queued *first = &air.queue[air.first];
    size_t count = first->size < size ? first->size : size;
    memcpy(bytes, first->bytes, count);
    air.first = (air.first + 1) % QUEUE;
    air.count--;
    return (int)count;
}

int HID_API_EXPORT hid_read_timeout(hid_device *device, unsigned char *bytes, size_t size,
                                    int timeout_ms)
{
    int64_t until_ns = clock_now_ns() + timeout_ms * NS_PER_MS;
    for (;;) {
        if (!is_there(device))
            return -1;
        pump();
        if (air.count)
            return take(bytes, size);
        if (clock_now_ns() >= until_ns)
            return 0;
        lane_pass(air.due_ns < until_ns ? air.due_ns : until_ns);
    }
}
