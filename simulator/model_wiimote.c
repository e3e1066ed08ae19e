// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_wiimote.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "simulator/model_noise.h"

enum output {
    OUT_RUMBLE = 0x10,
    OUT_LEDS = 0x11,
    OUT_MODE = 0x12,
    OUT_CAMERA_CLOCK = 0x13,
    OUT_SPEAKER = 0x14,
    OUT_STATUS = 0x15,
    OUT_WRITE = 0x16,
    OUT_READ = 0x17,
    OUT_SPEAKER_DATA = 0x18,
    OUT_SPEAKER_MUTE = 0x19,
    OUT_CAMERA_LOGIC = 0x1A,
};

enum input {
    IN_STATUS = 0x20,
    IN_MEMORY = 0x21,
    IN_ACK = 0x22,
    IN_BUTTONS = 0x30,
    IN_ACCEL = 0x31,
    IN_EXTENSION_8 = 0x32,
    IN_ACCEL_IR12 = 0x33,
    IN_EXTENSION_19 = 0x34,
    IN_ACCEL_EXTENSION = 0x35,
    IN_IR10_EXTENSION = 0x36,
    IN_ACCEL_IR10_EXTENSION = 0x37,
    IN_INTERLEAVED_FIRST = 0x3E,
    IN_INTERLEAVED_SECOND = 0x3F,
};

enum { RUMBLE = 0x01, ASK_ACK = 0x02, ON = 0x04 };
enum { ACK_OK = 0, ACK_ABSENT = 7, ACK_BAD = 8 };
enum { CAMERA_BASIC = 1, CAMERA_EXTENDED = 3, CAMERA_FULL = 5 };
enum { PIXEL_SUBS = 8 }; // steps of a blob's place in one pixel of the sensor
enum { MARKERS = 3, BLOBS = 4, QUEUE = 16, CAMERA_REGISTERS = 0x34, MEMORY_SIZE = 0x1700 };
enum { SENSOR_WIDTH = 1024, SENSOR_HEIGHT = 768 };

#define CAMERA_SPACE 0xB00000u
#define BLOCK_1 0x00
#define BLOCK_2 0x1A
#define SWITCH 0x30
#define CAMERA_MODE 0x33
#define SWITCH_ON 0x08

#define PERIOD_NS (10 * NS_PER_MS)
#define NOISE_PX 0.5
#define NEAREST_M 0.05
#define G_UNITS 26 // accelerometer units in 1 g, 0x80 = 0

// Output reports of 1 to 21 bytes and input reports of 2 to 21, as the real
// descriptor lists them.
#define VARIABLE(id, size, main) 0x85, id, 0x95, size, 0x09, 0x01, main, 0x00
#define OUTPUT(id, size) VARIABLE(id, size, 0x91)
#define INPUT(id, size) VARIABLE(id, size, 0x81)
static const uint8_t descriptor[] = {
    0x05, 0x01, 0x09, 0x05, 0xa1, 0x01, // generic desktop, game pad, application
    0x06, 0x00, 0xff, 0x15, 0x00, 0x26, 0xff, 0x00, 0x75, 0x08, // vendor page, bytes
    OUTPUT(0x10, 1), OUTPUT(0x11, 1), OUTPUT(0x12, 2), OUTPUT(0x13, 1), OUTPUT(0x14, 1),
    OUTPUT(0x15, 1), OUTPUT(0x16, 21), OUTPUT(0x17, 6), OUTPUT(0x18, 21), OUTPUT(0x19, 1),
    OUTPUT(0x1a, 1), INPUT(0x20, 6), INPUT(0x21, 21), INPUT(0x22, 4), INPUT(0x30, 2),
    INPUT(0x31, 5), INPUT(0x32, 10), INPUT(0x33, 17), INPUT(0x34, 21), INPUT(0x35, 21),
    INPUT(0x36, 21), INPUT(0x37, 21), INPUT(0x3d, 21), INPUT(0x3e, 21), INPUT(0x3f, 21),
    0xc0,
};

struct report {
    uint8_t bytes[HID_REPORT_MOST];
    size_t size;
};

struct wiimote {
    struct wiimote_options options;
    struct noise noise;
    char serial[64];
    uint8_t leds, mode;
    bool continuous, clock, logic, reporting, second_half;
    uint8_t camera[CAMERA_REGISTERS];
    uint8_t memory[MEMORY_SIZE];
    struct report queue[QUEUE];
    int queued;
    struct report last;
    int64_t next_ns;
};

struct wiimote *wiimote_create(const struct wiimote_options *options)
{
    struct wiimote *d = calloc(1, sizeof(*d));
    if (!d)
        return NULL;
    d->options = *options;
    snprintf(d->serial, sizeof(d->serial), "%s", options->serial);
    noise_init(&d->noise, options->seed, 'w');
    memset(d->memory, 0xFF, sizeof(d->memory));
    wiimote_connect(d);
    return d;
}

void wiimote_connect(struct wiimote *device)
{
    struct wiimote *d = device;
    d->mode = IN_BUTTONS;
    d->reporting = true;
    d->continuous = d->clock = d->logic = false;
    d->leds = 0;
    d->queued = 0;
    d->last.size = 0;
    memset(d->camera, 0, sizeof(d->camera));
}

void wiimote_destroy(struct wiimote *device)
{
    free(device);
}

// ---- answers -------------------------------------------------------------------

static void answer(struct wiimote *d, const uint8_t *bytes, size_t size)
{
    if (d->queued == QUEUE)
        return;
    struct report *r = &d->queue[d->queued++];
    memcpy(r->bytes, bytes, size);
    r->size = size;
}

static void acknowledge(struct wiimote *d, uint8_t report, uint8_t error)
{
    answer(d, (uint8_t[]){IN_ACK, 0, 0, report, error}, 5);
}

static bool camera_powered(const struct wiimote *d)
{
    return d->clock && d->logic;
}

static bool camera_sees(const struct wiimote *d)
{
    bool exposed = d->camera[BLOCK_1 + 6] != 0 && d->camera[BLOCK_2] != 0;
    return camera_powered(d) && d->camera[SWITCH] == SWITCH_ON && exposed;
}

static void answer_status(struct wiimote *d)
{
    uint8_t flags = (uint8_t)(d->leds | (camera_powered(d) ? 0x08 : 0));
    answer(d, (uint8_t[]){IN_STATUS, 0, 0, flags, 0, 0, 0xB4}, 7);
}

void wiimote_upset(struct wiimote *device)
{
    device->clock = device->logic = device->reporting = false;
    memset(device->camera, 0, sizeof(device->camera));
    answer_status(device);
}

// ---- memory --------------------------------------------------------------------

static uint8_t *place(struct wiimote *d, bool registers, uint32_t address, size_t size,
                      uint8_t *error)
{
    *error = ACK_BAD;
    if (!registers)
        return address + size <= MEMORY_SIZE ? d->memory + address : NULL;
    *error = ACK_ABSENT;
    if (!camera_powered(d) || address < CAMERA_SPACE)
        return NULL;
    address -= CAMERA_SPACE;
    return address + size <= CAMERA_REGISTERS ? d->camera + address : NULL;
}

static uint32_t address_of(const uint8_t *report)
{
    return (uint32_t)report[2] << 16 | (uint32_t)report[3] << 8 | report[4];
}

static void write_memory(struct wiimote *d, const uint8_t *report)
{
    size_t size = report[5];
    uint8_t error;
    uint8_t *to = size >= 1 && size <= 16
                      ? place(d, report[1] & ON, address_of(report), size, &error)
                      : NULL;
    if (to)
        memcpy(to, report + 6, size);
    acknowledge(d, OUT_WRITE, to ? ACK_OK : size >= 1 && size <= 16 ? error : ACK_BAD);
}

static void read_memory(struct wiimote *d, const uint8_t *report)
{
    uint32_t address = address_of(report);
    size_t left = (size_t)report[5] << 8 | report[6];
    uint8_t error;
    const uint8_t *from = place(d, report[1] & ON, address, left, &error);
    do {
        size_t size = left < 16 ? left : 16;
        uint8_t r[22] = {IN_MEMORY};
        r[3] = (uint8_t)((size ? size - 1 : 0) << 4 | (from ? 0 : error));
        r[4] = (uint8_t)(address >> 8);
        r[5] = (uint8_t)address;
        if (from)
            memcpy(r + 6, from, size);
        answer(d, r, sizeof(r));
        left -= size;
        address += (uint32_t)size;
        from = from ? from + size : NULL;
    } while (from && left > 0);
}

// ---- output reports --------------------------------------------------------------

static size_t payload_of(uint8_t id)
{
    switch (id) {
    case OUT_MODE:
        return 2;
    case OUT_WRITE:
    case OUT_SPEAKER_DATA:
        return 21;
    case OUT_READ:
        return 6;
    default:
        return id >= OUT_RUMBLE && id <= OUT_CAMERA_LOGIC ? 1 : 0;
    }
}

static bool interleaved(uint8_t mode)
{
    return mode == IN_INTERLEAVED_FIRST || mode == IN_INTERLEAVED_SECOND;
}

static bool known_mode(uint8_t mode)
{
    return (mode >= IN_BUTTONS && mode <= IN_ACCEL_IR10_EXTENSION) || interleaved(mode);
}

static void set_mode(struct wiimote *d, const uint8_t *report)
{
    if (!known_mode(report[2]))
        return;
    d->continuous = report[1] & ON;
    d->mode = report[2];
    d->second_half = false;
    d->reporting = true;
    d->last.size = 0;
}

static int on_out(void *context, int64_t now_ns, const uint8_t *report, size_t size)
{
    struct wiimote *d = context;
    (void)now_ns;
    size_t payload = size ? payload_of(report[0]) : 0;
    if (payload == 0 || size < 1 + payload)
        return size ? 0 : -EINVAL; // the radio carries it, the remote drops it
    switch (report[0]) {
    case OUT_LEDS:
        d->leds = report[1] & 0xF0;
        break;
    case OUT_MODE:
        set_mode(d, report);
        break;
    case OUT_CAMERA_CLOCK:
        d->clock = report[1] & ON;
        break;
    case OUT_CAMERA_LOGIC:
        d->logic = report[1] & ON;
        break;
    case OUT_STATUS:
        answer_status(d);
        return 0;
    case OUT_WRITE:
        write_memory(d, report);
        return 0;
    case OUT_READ:
        read_memory(d, report);
        return 0;
    default: // rumble and speaker: taken and without effect
        break;
    }
    if (!camera_powered(d))
        memset(d->camera, 0, sizeof(d->camera));
    if (report[1] & ASK_ACK)
        acknowledge(d, report[0], ACK_OK);
    return 0;
}

// ---- the camera ------------------------------------------------------------------

struct blob {
    int x, y, size; // x < 0: none
};

// The sensor's raw axes as its users found them: x grows to the camera's own
// right (the observer's left), y grows upwards, both from the lower left corner.
static struct blob project(struct wiimote *d, struct vec3 marker)
{
    struct blob none = {-1, 0, 0};
    if (marker.z < NEAREST_M)
        return none;
    double x = SENSOR_WIDTH / 2.0 - WIIMOTE_FOCAL_PX * marker.x / marker.z;
    double y = SENSOR_HEIGHT / 2.0 + WIIMOTE_FOCAL_PX * marker.y / marker.z;
    x = round(x + NOISE_PX * noise_normal(&d->noise));
    y = round(y + NOISE_PX * noise_normal(&d->noise));
    if (x < 0 || x >= SENSOR_WIDTH || y < 0 || y >= SENSOR_HEIGHT)
        return none;
    double gain = d->camera[BLOCK_1 + 8] < 0x30 ? 2.0 : 1.5; // a lower threshold sees more
    int size = (int)lround(gain / marker.z);
    return (struct blob){(int)x, (int)y, size < 1 ? 1 : size > 15 ? 15 : size};
}

static void look(struct wiimote *d, int64_t now_ns, struct blob blobs[BLOBS])
{
    for (int i = 0; i < BLOBS; i++)
        blobs[i].x = -1;
    if (!camera_sees(d))
        return;
    struct vec3 markers[MARKERS + 1];
    const struct around *around = &d->options.around;
    around->markers(around->context, now_ns, markers);
    int seen = 0, count = MARKERS;
    if (around->fourth_marker && around->fourth_marker(around->context, now_ns, &markers[MARKERS]))
        count++;
    for (int i = 0; i < count; i++) {
        struct blob blob = project(d, markers[i]);
        if (blob.x >= 0)
            blobs[seen++] = blob;
    }
}

static void put_three(const struct blob *b, uint8_t out[3])
{
    out[0] = b->x & 0xFF;
    out[1] = b->y & 0xFF;
    out[2] = (uint8_t)((b->y >> 8) << 6 | (b->x >> 8) << 4 | b->size);
}

static void put_extended(const struct blob blobs[BLOBS], uint8_t out[12])
{
    for (int i = 0; i < BLOBS; i++)
        if (blobs[i].x >= 0)
            put_three(&blobs[i], out + 3 * i);
}

static uint8_t edge(int at, int most)
{
    int pixel = at < 0 ? 0 : at / PIXEL_SUBS;
    return (uint8_t)(pixel < most ? pixel : most);
}

// Two blobs: place and size, the box around each in pixels of the sensor, and
// its brightness.
static void put_full(const struct blob blobs[2], uint8_t out[18])
{
    for (int i = 0; i < 2; i++) {
        const struct blob *b = &blobs[i];
        uint8_t *at = out + 9 * i;
        int reach = b->size * PIXEL_SUBS / 2;
        if (b->x < 0)
            continue;
        put_three(b, at);
        at[3] = edge(b->x - reach, SENSOR_WIDTH / PIXEL_SUBS - 1);
        at[4] = edge(b->y - reach, SENSOR_HEIGHT / PIXEL_SUBS - 1);
        at[5] = edge(b->x + reach, SENSOR_WIDTH / PIXEL_SUBS - 1);
        at[6] = edge(b->y + reach, SENSOR_HEIGHT / PIXEL_SUBS - 1);
        at[7] = 0;
        at[8] = (uint8_t)(b->size * 16);
    }
}

static void put_basic(const struct blob blobs[BLOBS], uint8_t out[10])
{
    for (int i = 0; i < BLOBS; i++) {
        const struct blob *b = &blobs[i];
        if (b->x < 0)
            continue;
        uint8_t *pair = out + 5 * (i / 2), *at = pair + (i % 2 ? 3 : 0);
        int shift = i % 2 ? 0 : 4;
        at[0] = b->x & 0xFF;
        at[1] = b->y & 0xFF;
        pair[2] &= (uint8_t)~(0x0F << shift);
        pair[2] |= (uint8_t)(((b->y >> 8) << 2 | b->x >> 8) << shift);
    }
}

// ---- input reports -----------------------------------------------------------------

static uint8_t *put_accel(struct wiimote *d, uint8_t *at)
{
    double pitch = d->options.pitch_deg * (M_PI / 180);
    double g[3] = {0, -sin(pitch), cos(pitch)};
    for (int i = 0; i < 3; i++)
        at[i] = (uint8_t)lround(0x80 + G_UNITS * g[i] + 0.4 * noise_normal(&d->noise));
    return at + 3;
}

static size_t size_of(uint8_t mode)
{
    switch (mode) {
    case IN_BUTTONS:
        return 3;
    case IN_ACCEL:
        return 6;
    case IN_EXTENSION_8:
        return 11;
    case IN_ACCEL_IR12:
        return 18;
    default:
        return 22;
    }
}

static bool has_accel(uint8_t mode)
{
    return mode == IN_ACCEL || mode == IN_ACCEL_IR12 || mode == IN_ACCEL_EXTENSION ||
           mode == IN_ACCEL_IR10_EXTENSION;
}

// Half of the camera's data and two thirds of the acceleration in each of two
// reports that take turns; z is spread over the spare bits of the buttons.
static void compose_interleaved(struct wiimote *d, const struct blob blobs[BLOBS],
                                struct report *out)
{
    bool second = d->second_half;
    uint8_t accel[3], *at = out->bytes;
    put_accel(d, accel);
    d->second_half = !second;
    at[0] = second ? IN_INTERLEAVED_SECOND : IN_INTERLEAVED_FIRST;
    int shift = second ? 0 : 4;
    at[1] |= (uint8_t)((accel[2] >> shift & 3) << 5);
    at[2] |= (uint8_t)((accel[2] >> (shift + 2) & 3) << 5);
    at[3] = second ? accel[1] : accel[0];
    memset(at + 4, 0xFF, 18);
    if (d->camera[CAMERA_MODE] == CAMERA_FULL)
        put_full(blobs + (second ? 2 : 0), at + 4);
}

// Blob data of the wrong format for the report do not get through.
static void compose(struct wiimote *d, int64_t now_ns, struct report *out)
{
    struct blob blobs[BLOBS];
    look(d, now_ns, blobs);
    *out = (struct report){{d->mode}, size_of(d->mode)};
    uint8_t *at = out->bytes + 3;
    if (interleaved(d->mode)) {
        compose_interleaved(d, blobs, out);
        return;
    }
    if (has_accel(d->mode))
        at = put_accel(d, at);
    if (d->mode == IN_ACCEL_IR12) {
        memset(at, 0xFF, 12);
        if (d->camera[CAMERA_MODE] == CAMERA_EXTENDED)
            put_extended(blobs, at);
    } else if (d->mode == IN_IR10_EXTENSION || d->mode == IN_ACCEL_IR10_EXTENSION) {
        memset(at, 0xFF, 10);
        if (d->camera[CAMERA_MODE] == CAMERA_BASIC)
            put_basic(blobs, at);
    }
}

static int next_answer(struct wiimote *d, uint8_t *report)
{
    struct report first = d->queue[0];
    d->queued--;
    memmove(d->queue, d->queue + 1, (size_t)d->queued * sizeof(d->queue[0]));
    memcpy(report, first.bytes, first.size);
    return (int)first.size;
}

static int on_in(void *context, int64_t now_ns, uint8_t report[HID_REPORT_MOST],
                 int64_t *again_ns)
{
    struct wiimote *d = context;
    if (d->queued > 0)
        return next_answer(d, report);
    if (now_ns >= d->next_ns) {
        int64_t late = now_ns - d->next_ns;
        d->next_ns = late > 10 * PERIOD_NS ? now_ns + PERIOD_NS : d->next_ns + PERIOD_NS;
        struct report r;
        compose(d, now_ns, &r);
        bool changed = r.size != d->last.size || memcmp(r.bytes, d->last.bytes, r.size) != 0;
        if (d->reporting && (d->continuous || (d->last.size && changed))) {
            d->last = r;
            memcpy(report, r.bytes, r.size);
            return (int)r.size;
        }
        d->last = r;
    }
    *again_ns = d->next_ns;
    return -EAGAIN;
}

struct hid_model wiimote_model(struct wiimote *device)
{
    return (struct hid_model){
        .context = device,
        .bus = 0x05,
        .vendor = 0x057E,
        .product = 0x0306,
        .name = "Nintendo RVL-CNT-01",
        .unique = device->serial,
        .descriptor = descriptor,
        .descriptor_size = sizeof(descriptor),
        .out = on_out,
        .in = on_in,
    };
}
