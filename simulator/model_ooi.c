// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_ooi.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "simulator/model_detector.h"

enum command {
    INITIALISE = 0x01,
    SET_INTEGRATION = 0x02,
    SET_STROBE = 0x03,
    SET_POWER = 0x04,
    READ_SLOT = 0x05,
    WRITE_SLOT = 0x06,
    REQUEST_SPECTRUM = 0x09,
    SET_TRIGGER = 0x0A,
    WRITE_REGISTER = 0x6A,
    READ_REGISTER = 0x6B,
    READ_TEMPERATURE = 0x6C,
    READ_IRRADIANCE = 0x6D,
    ENABLE_COOLER = 0x71,
    READ_COOLER = 0x72,
    SET_COOLER = 0x73,
    STATUS = 0xFE,
};

enum { COMMAND_OUT = 0x01, REPLY_IN = 0x81, SPECTRUM_IN = 0x82, APART_IN = 0x86 };

enum {
    SLOTS = 20,
    WRITABLE_SLOTS = 19,
    SLOT_SIZE = 15,
    SYNC = 0x69,
    WRONG_SYNC = 0x96,
    SPECTRUM_MOST = 2 * MODEL_PIXELS_MOST + 1,
    ROOM_TENTHS = 240, // degrees
    REPLIES = 4,
    REPLY_MOST = 64,
    SPARE_CYCLES = 2,
    TRIGGER_MODES = 4,
};

enum { REGISTER_VERSION = 0x04, REGISTER_PROGRAMMED = 0x64, REGISTER_SATURATION = 0x68 };

#define COARSE_FROM_US 655000u
#define START_DELAY_NS 8500
#define READOUT_NS 900000
#define SHUTTER_BELOW_US 3800u // of a free-running device
#define SHUTTER_PERIOD_NS (3 * 3800 * INT64_C(1000))

struct reply {
    uint8_t bytes[REPLY_MOST];
    size_t size;
};

struct ooi {
    struct ooi_options options;
    const struct ooi_kind *kind;
    enum ooi_upset upset;
    struct detector_model *detector;
    struct noise noise;
    uint8_t descriptors[18 + 9 + 9 + 4 * 7];
    char serial[SLOT_SIZE + 1];
    uint8_t slots[SLOTS][SLOT_SIZE];
    uint16_t registers[256];

    uint32_t integration_us;
    bool strobe, powered, halted, cooling;
    int cooler_tenths;
    uint8_t trigger;

    struct reply replies[REPLIES];
    int reply_count;

    bool integrating;
    int requests, spare;
    int64_t light_from_ns, light_to_ns, ready_ns;

    uint8_t spectrum[SPECTRUM_MOST];
    bool loaded, stale; // stale: a byte of the spectrum before is still to be sent
    size_t size;
    struct {
        size_t from, to; // of spectrum, still to be sent
    } apart, rest;
};

// ---- what the factory wrote --------------------------------------------------

static void set_slot(struct ooi *d, int slot, const char *text)
{
    noise_bytes(&d->noise, d->slots[slot], SLOT_SIZE);
    size_t size = strlen(text) + 1; // with its NUL, unless it fills the slot
    memcpy(d->slots[slot], text, size < SLOT_SIZE ? size : SLOT_SIZE);
}

static void set_slots(struct ooi *d)
{
    memset(d->slots, 0xFF, sizeof(d->slots));
    set_slot(d, 0, d->serial);
    for (int i = 0; i < 4; i++)
        set_slot(d, 1 + i, d->kind->wavelength[i]);
    set_slot(d, 5, "2.0e-04");
    if (!d->options.blank_nonlinearity) {
        for (int i = 0; i < 8; i++)
            set_slot(d, 6 + i, d->kind->nonlinearity[i]);
        set_slot(d, 14, "7");
    }
    set_slot(d, 15, "3 000 025");
    set_slot(d, 16, "SVL 4");
    noise_bytes(&d->noise, d->slots[17], SLOT_SIZE);
    d->slots[17][d->kind->saturation_at] = d->kind->saturation & 0xFF;
    d->slots[17][d->kind->saturation_at + 1] = (uint8_t)(d->kind->saturation >> 8);
}

static size_t put(uint8_t *to, const uint8_t *bytes, size_t size)
{
    memcpy(to, bytes, size);
    return size;
}

static void set_descriptors(struct ooi *d)
{
    uint8_t packet_lo = d->options.full_speed ? 64 : 0, packet_hi = d->options.full_speed ? 0 : 2;
    uint8_t product_lo = d->kind->product & 0xFF, product_hi = d->kind->product >> 8;
    const uint8_t device[18] = {18,   1,          0x00,       0x02, 0,    0, 0, 64, 0x57,
                                0x24, product_lo, product_hi, 0x02, 0x00, 1, 2, 3,  1};
    const uint8_t configuration[9] = {9, 2, 9 + 9 + 4 * 7, 0, 1, 1, 0, 0x80, 125};
    const uint8_t interface[9] = {9, 4, 0, 0, 4, 0xff, 0, 0, 0};
    const uint8_t endpoints[4] = {COMMAND_OUT, SPECTRUM_IN, APART_IN, REPLY_IN};
    uint8_t *at = d->descriptors;
    at += put(at, device, sizeof(device));
    at += put(at, configuration, sizeof(configuration));
    at += put(at, interface, sizeof(interface));
    for (int i = 0; i < 4; i++) {
        const uint8_t endpoint[7] = {7, 5, endpoints[i], 2, packet_lo, packet_hi, 0};
        at += put(at, endpoint, sizeof(endpoint));
    }
}

static struct detector_model *make_detector(const struct ooi *d)
{
    struct detector_options detector = {.saturation = d->kind->saturation,
                                        .zones = d->kind->zones,
                                        .full = d->kind->full,
                                        .collector_mm2 = d->options.collector_mm2,
                                        .seed = d->options.seed};
    for (int i = 0; i < 4; i++)
        detector.wavelength[i] = strtod(d->kind->wavelength[i], NULL);
    for (int i = 0; i < 8; i++)
        detector.nonlinearity[i] = strtod(d->kind->nonlinearity[i], NULL);
    return detector_create(&detector);
}

double ooi_calibration(const struct ooi *device, double nm)
{
    return detector_calibration(nm) * 65535 / device->kind->full;
}

void ooi_upset(struct ooi *device, enum ooi_upset upset)
{
    device->upset = upset;
}

static void start_cycle(struct ooi *d, int64_t at_ns);

static void power_on(void *context, int64_t now_ns)
{
    struct ooi *d = context;
    d->options.powered_ns = now_ns;
    memset(d->registers, 0, sizeof(d->registers));
    d->registers[REGISTER_VERSION] = d->options.flame ? 0x3012 : 0x2012;
    d->registers[REGISTER_PROGRAMMED] = 0x5501;
    d->registers[REGISTER_SATURATION] = (uint16_t)d->kind->saturation;
    d->integration_us = 100000;
    d->powered = true;
    d->strobe = d->halted = d->integrating = d->loaded = d->stale = d->cooling = false;
    d->cooler_tenths = ROOM_TENTHS;
    d->trigger = 0;
    d->reply_count = d->requests = d->spare = 0;
    if (d->kind->free_running)
        start_cycle(d, now_ns);
}

struct ooi *ooi_create(const struct ooi_options *options)
{
    struct ooi *d = calloc(1, sizeof(*d));
    if (!d)
        return NULL;
    d->options = *options;
    d->kind = ooi_kind(options->kind);
    snprintf(d->serial, sizeof(d->serial), "%s", options->serial);
    noise_init(&d->noise, options->seed, 's');
    set_slots(d);
    set_descriptors(d);
    power_on(d, options->powered_ns);
    d->detector = make_detector(d);
    if (d->detector)
        return d;
    ooi_destroy(d);
    return NULL;
}

void ooi_destroy(struct ooi *device)
{
    if (!device)
        return;
    detector_destroy(device->detector);
    free(device);
}

// ---- acquisition ---------------------------------------------------------------

// The device integrates ahead: a cycle in progress keeps the integration time
// and the light it began with, whatever the host changes meanwhile.
static void start_cycle(struct ooi *d, int64_t at_ns)
{
    int64_t light_ns = (int64_t)d->integration_us * 1000;
    d->integrating = true;
    if (d->kind->free_running && d->integration_us < SHUTTER_BELOW_US) {
        d->ready_ns = at_ns + SHUTTER_PERIOD_NS;
        d->light_to_ns = d->ready_ns - READOUT_NS;
        d->light_from_ns = d->light_to_ns - light_ns;
        return;
    }
    d->light_from_ns = at_ns + START_DELAY_NS;
    d->light_to_ns = d->light_from_ns + light_ns;
    d->ready_ns = d->light_to_ns + READOUT_NS;
}

static void put_in_parts(struct ooi *d)
{
    size_t apart = d->options.full_speed ? 0 : (size_t)d->kind->apart;
    apart = apart < d->size ? apart : d->size;
    d->apart.from = 0;
    d->apart.to = d->rest.from = apart;
    d->rest.to = d->size;
}

static void load_spectrum(struct ooi *d)
{
    struct spectrum light;
    d->options.around.irradiance(d->options.around.context, d->light_from_ns, d->light_to_ns,
                                 &light);
    uint16_t raw[MODEL_PIXELS_MOST];
    detector_expose(d->detector, &light, (double)(d->light_to_ns - d->light_from_ns) * 1e-9,
                    (double)(d->light_to_ns - d->options.powered_ns) * 1e-9, &d->noise, raw);
    int pixels = d->upset == OOI_OTHER_PIXELS ? d->kind->pixels / 2 : d->kind->pixels;
    for (int p = 0; p < pixels; p++) {
        uint16_t sent = raw[p] ^ d->kind->inverted;
        d->spectrum[2 * p] = sent & 0xFF;
        d->spectrum[2 * p + 1] = sent >> 8;
    }
    d->spectrum[2 * pixels] = d->upset == OOI_BAD_SYNC ? WRONG_SYNC : SYNC;
    d->size = 2 * (size_t)pixels + (d->upset != OOI_NO_SYNC);
    d->stale = d->upset == OOI_OUT_OF_STEP;
    d->loaded = true;
    put_in_parts(d);
}

// Cycles that nobody asked for end unseen.
static void skip(struct ooi *d, int64_t now_ns)
{
    int64_t end_ns = d->ready_ns;
    start_cycle(d, end_ns);
    int64_t period_ns = d->ready_ns - end_ns;
    if (now_ns >= d->ready_ns)
        start_cycle(d, end_ns + (now_ns - end_ns) / period_ns * period_ns);
}

static void advance(struct ooi *d, int64_t now_ns)
{
    while (d->integrating && now_ns >= d->ready_ns) {
        d->integrating = false;
        if (d->requests > 0) {
            d->requests--;
            load_spectrum(d);
        } else if (d->kind->free_running) {
            skip(d, now_ns);
        } else if (--d->spare > 0) {
            start_cycle(d, d->ready_ns);
        }
    }
}

static void start_if_idle(struct ooi *d, int64_t now_ns)
{
    if (d->requests > 0 && !d->integrating && !d->loaded && d->powered && d->trigger == 0)
        start_cycle(d, now_ns);
}

static void read_out(struct ooi *d, int64_t now_ns)
{
    d->loaded = false;
    d->spare = SPARE_CYCLES;
    if (d->trigger == 0)
        start_cycle(d, now_ns);
}

static void stop(struct ooi *d)
{
    d->integrating = d->loaded = false;
    d->requests = 0;
}

// ---- commands ------------------------------------------------------------------

static uint32_t little(const uint8_t *bytes, int count)
{
    uint32_t value = 0;
    for (int i = count - 1; i >= 0; i--)
        value = value << 8 | bytes[i];
    return value;
}

static void reply(struct ooi *d, const uint8_t *bytes, size_t size)
{
    if (d->reply_count == REPLIES)
        return;
    struct reply *r = &d->replies[d->reply_count++];
    memcpy(r->bytes, bytes, size);
    r->size = size;
}

static void set_integration(struct ooi *d, uint32_t units)
{
    uint64_t us = (uint64_t)units * d->kind->unit_us;
    if (us < d->kind->least_us || us > d->kind->most_us || d->upset == OOI_DEAF)
        return;
    d->integration_us = (uint32_t)(us - us % (us < COARSE_FROM_US ? 10 : 1000));
}

static void read_slot(struct ooi *d, uint8_t slot)
{
    if (slot >= SLOTS)
        return;
    uint8_t bytes[2 + SLOT_SIZE] = {READ_SLOT, slot};
    memcpy(bytes + 2, d->slots[slot], SLOT_SIZE);
    reply(d, bytes, sizeof(bytes));
}

static void write_slot(struct ooi *d, const uint8_t *bytes, size_t size)
{
    if (bytes[1] >= WRITABLE_SLOTS || bytes[1] == 17)
        return;
    size_t count = size - 2 < SLOT_SIZE ? size - 2 : SLOT_SIZE;
    memcpy(d->slots[bytes[1]], bytes + 2, count);
}

static void read_register(struct ooi *d, uint8_t address)
{
    uint16_t value = d->registers[address];
    uint8_t echo = d->options.flame ? 0xFE : address;
    reply(d, (uint8_t[]){echo, value & 0xFF, value >> 8}, 3);
}

static void read_temperature(struct ooi *d, int64_t now_ns)
{
    double age_s = (double)(now_ns - d->options.powered_ns) * 1e-9;
    double degrees = 24 + 5 * (1 - 1 / (1 + age_s / 600));
    int value = (int)(degrees / 0.003906);
    reply(d, (uint8_t[]){0x08, value & 0xFF, (uint8_t)(value >> 8)}, 3);
}

static void read_status(struct ooi *d)
{
    size_t packet = d->options.full_speed ? 64 : 512;
    size_t left = d->loaded ? d->apart.to - d->apart.from + d->rest.to - d->rest.from : 0;
    size_t whole = 2 * (size_t)d->kind->pixels + 1;
    uint8_t s[16] = {d->kind->pixels & 0xFF, (uint8_t)(d->kind->pixels >> 8)};
    for (int i = 0; i < 4; i++)
        s[2 + i] = (uint8_t)(d->integration_us / d->kind->unit_us >> (8 * i));
    s[6] = d->strobe;
    s[7] = d->trigger;
    s[8] = d->loaded ? 0x04 : d->requests > 0 ? 0x02 : 0;
    s[9] = (uint8_t)((whole + packet - 1) / packet);
    s[10] = d->powered;
    s[11] = (uint8_t)((left + packet - 1) / packet);
    s[14] = d->options.full_speed ? 0x00 : 0x80;
    reply(d, s, sizeof(s));
}

static void set_trigger(struct ooi *d, uint32_t mode, int64_t now_ns)
{
    if (mode >= TRIGGER_MODES)
        return;
    d->trigger = (uint8_t)mode;
    if (mode != 0) // nothing is wired to the trigger input: no cycle ever starts
        d->integrating = false;
    else if (d->kind->free_running && !d->integrating && !d->loaded && d->powered)
        start_cycle(d, now_ns);
    start_if_idle(d, now_ns);
}

static size_t payload_of(uint8_t command)
{
    switch (command) {
    case SET_INTEGRATION:
        return 4;
    case SET_STROBE:
    case SET_POWER:
    case SET_TRIGGER:
    case READ_IRRADIANCE:
    case ENABLE_COOLER:
    case SET_COOLER:
        return 2;
    case READ_SLOT:
    case WRITE_SLOT:
    case READ_REGISTER:
        return 1;
    case WRITE_REGISTER:
        return 3;
    default:
        return 0;
    }
}

// The detector is where it was told to be at once.
static void use_cooler(struct ooi *d, const uint8_t *bytes)
{
    int now = d->cooling ? d->cooler_tenths : ROOM_TENTHS;
    if (bytes[0] == ENABLE_COOLER)
        d->cooling = little(bytes + 1, 2) != 0;
    else if (bytes[0] == SET_COOLER)
        d->cooler_tenths = (int16_t)little(bytes + 1, 2);
    else
        reply(d, (uint8_t[]){(uint8_t)now, (uint8_t)(now >> 8)}, 2);
}

// Commands that are answered, and those few know.
static int answer(struct ooi *d, const uint8_t *bytes, int64_t now_ns)
{
    uint8_t blank[60];
    switch (bytes[0]) {
    case READ_SLOT:
        read_slot(d, bytes[1]);
        return 0;
    case REQUEST_SPECTRUM:
        if (d->powered && d->requests < 2)
            d->requests++;
        start_if_idle(d, now_ns);
        return 0;
    case READ_REGISTER:
        read_register(d, bytes[1]);
        return 0;
    case READ_TEMPERATURE:
        read_temperature(d, now_ns);
        return 0;
    case READ_IRRADIANCE:
        memset(blank, 0xFF, sizeof(blank));
        reply(d, blank, sizeof(blank));
        return 0;
    case STATUS:
        read_status(d);
        return 0;
    case ENABLE_COOLER:
    case READ_COOLER:
    case SET_COOLER:
        if (d->kind->cooled) {
            use_cooler(d, bytes);
            return 0;
        }
        break;
    default:
        break;
    }
    d->halted = true;
    return -EPIPE;
}

static int execute(struct ooi *d, const uint8_t *bytes, size_t size, int64_t now_ns)
{
    switch (bytes[0]) {
    case INITIALISE:
        set_trigger(d, 0, now_ns);
        return 0;
    case SET_INTEGRATION:
        set_integration(d, little(bytes + 1, 4));
        return 0;
    case SET_STROBE:
        d->strobe = little(bytes + 1, 2) != 0;
        return 0;
    case SET_POWER:
        d->powered = little(bytes + 1, 2) != 0;
        if (!d->powered)
            stop(d);
        else
            set_trigger(d, d->trigger, now_ns);
        return 0;
    case WRITE_SLOT:
        write_slot(d, bytes, size);
        return 0;
    case SET_TRIGGER:
        set_trigger(d, little(bytes + 1, 2), now_ns);
        return 0;
    case WRITE_REGISTER:
        if (bytes[1] != REGISTER_VERSION && bytes[1] != REGISTER_PROGRAMMED)
            d->registers[bytes[1]] = (uint16_t)little(bytes + 2, 2);
        return 0;
    default:
        return answer(d, bytes, now_ns);
    }
}

// ---- the face to the bus ---------------------------------------------------------

static int on_out(void *context, uint8_t endpoint, int64_t now_ns, const uint8_t *bytes,
                  size_t size)
{
    struct ooi *d = context;
    if (endpoint != COMMAND_OUT || d->halted)
        return -EPIPE;
    advance(d, now_ns);
    if (size == 0 || size < 1 + payload_of(bytes[0]))
        return 0;
    return execute(d, bytes, size, now_ns);
}

static int next_reply(struct ooi *d, uint8_t *packet, int64_t *again_ns)
{
    *again_ns = INT64_MAX;
    if (d->reply_count == 0)
        return -EAGAIN;
    struct reply first = d->replies[0];
    memmove(d->replies, d->replies + 1, sizeof(d->replies) - sizeof(d->replies[0]));
    d->reply_count--;
    memcpy(packet, first.bytes, first.size);
    return (int)first.size;
}

static int next_packet(struct ooi *d, uint8_t endpoint, int64_t now_ns, uint8_t *packet,
                       int64_t *again_ns)
{
    *again_ns = d->integrating && d->requests > 0 ? d->ready_ns : INT64_MAX;
    size_t *from = endpoint == APART_IN ? &d->apart.from : &d->rest.from;
    size_t to = endpoint == APART_IN ? d->apart.to : d->rest.to;
    if (!d->loaded || *from == to)
        return -EAGAIN;
    if (d->stale) {
        d->stale = false;
        packet[0] = SYNC;
        return 1;
    }
    size_t most = d->options.full_speed ? 64 : 512;
    size_t size = to - *from < most ? to - *from : most;
    memcpy(packet, d->spectrum + *from, size);
    *from += size;
    if (d->apart.from == d->apart.to && d->rest.from == d->rest.to)
        read_out(d, now_ns);
    return (int)size;
}

static int on_in(void *context, uint8_t endpoint, int64_t now_ns, uint8_t packet[USB_PACKET_MOST],
                 int64_t *again_ns)
{
    struct ooi *d = context;
    advance(d, now_ns);
    if (endpoint == REPLY_IN)
        return next_reply(d, packet, again_ns);
    if (endpoint == SPECTRUM_IN || endpoint == APART_IN)
        return next_packet(d, endpoint, now_ns, packet, again_ns);
    *again_ns = INT64_MAX;
    return -EAGAIN;
}

static void on_clear_halt(void *context, uint8_t endpoint)
{
    struct ooi *d = context;
    if (endpoint == COMMAND_OUT)
        d->halted = false;
}

struct usb_model ooi_model(struct ooi *device)
{
    return (struct usb_model){
        .context = device,
        .descriptors = device->descriptors,
        .descriptors_size = sizeof(device->descriptors),
        .strings = {NULL, "Ocean Optics Inc.", device->kind->product_text, device->serial},
        .megabits = device->options.full_speed ? 12 : 480,
        .out = on_out,
        .in = on_in,
        .clear_halt = on_clear_halt,
        .unplugged = power_on,
    };
}
