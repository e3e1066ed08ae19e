// SPDX-License-Identifier: Apache-2.0
#include "drivers/witmotion.h"

#include <arpa/inet.h>
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "drivers/deadline.h"
#include "drivers/udev.h"

enum {
    EXCEPTION = 0x80,
    RESPONSE_MS = 500,
    BYTE_MS = 50, // between bytes of one reply
    SERIAL_WORDS = 6,
    MOST_FAILURES = 5,
    MOST_FAILURES_TCP = 3, // a connection may be dead at its far end alone: only a new one tells
    PADDINGS = 8,          // more than MOST_FAILURES
};

#define G_STEP (16.0 / 32768 * 9.80665) // m/s2

static const struct modbus_map maps[] = {
    {"wt901c485",
     3,
     true,
     {0x34, 3, MODBUS_S16, false, G_STEP, 0, NAN},
     {0x3d, 3, MODBUS_S16, false, 180.0 / 32768, 0, NAN},
     {1, 2, 3},
     0x2e,
     0x7f},
    {"hwt9073",
     3,
     true,
     {0x34, 3, MODBUS_S16, false, G_STEP, 0, NAN},
     {0x3d, 3, MODBUS_S32, true, 0.001, 0, NAN},
     {1, 2, 3},
     0x2e,
     0x7f},
};

const struct device_id witmotion_ids[] = {
    {DEVICE_SERIAL, 0x1a86, 0x7523, "CH340 serial adapter (USB-RS485)"},
    {DEVICE_SERIAL, 0x0403, 0x6001, "FT232R serial adapter (USB-RS485)"},
    {DEVICE_SERIAL, 0x10c4, 0xea60, "CP210x serial adapter"},
    {0},
};

struct accelerometer {
    struct accelerometer_options options;
    struct modbus_map map;
    modbus_t *modbus;
    uint16_t transaction; // of the last request over TCP
    bool connected;
    char version[8];
    char serial[2 * SERIAL_WORDS + 1];
    int failures; // reads without a sample, one after the other
    int padding;  // words asked for beyond the map: another number after each failure
};

const struct modbus_map *witmotion_map(int model)
{
    return model >= 0 && (size_t)model < sizeof maps / sizeof *maps ? &maps[model] : NULL;
}

int witmotion_first(const struct modbus_map *map)
{
    return map->accel.first < map->angle.first ? map->accel.first : map->angle.first;
}

int witmotion_count(const struct modbus_map *map)
{
    int accel_end = map->accel.first + modbus_field_words(&map->accel);
    int angle_end = map->angle.first + modbus_field_words(&map->angle);
    return (accel_end > angle_end ? accel_end : angle_end) - witmotion_first(map);
}

double witmotion_angle(const struct modbus_map *map, const uint16_t *registers, int which)
{
    double deg = NAN;
    int skip = map->angle.first - witmotion_first(map);
    modbus_field_value(&map->angle, registers + skip, which, &deg);
    return deg;
}

void witmotion_decode(const struct modbus_map *map, const uint16_t *registers, double offset_deg,
                      struct tilt_sample *out)
{
    int first = witmotion_first(map);
    modbus_decode(map, registers + (map->accel.first - first),
                  registers + (map->angle.first - first), offset_deg, out);
}

static bool fail_modbus(const struct accelerometer *a, struct error *err)
{
    int code = errno;
    switch (code) {
    case ETIMEDOUT:
        return fail(err, ERROR_RETRY, "%s: no answer from unit %d", a->options.port,
                    a->options.unit);
    case EMBBADCRC:
    case EMBBADDATA:
    case EMBMDATA:
    case EMBBADEXC:
    case EMBBADSLAVE:
        return fail(err, ERROR_RETRY, "%s: %s", a->options.port, modbus_strerror(code));
    }
    return fail(err, ERROR_GONE, "%s: the inclinometer is gone: %s", a->options.port,
                modbus_strerror(code));
}

// Refusals of what the map asks for, as against a sensor that is busy or ill.
static bool asks_for_nothing(int exception)
{
    return exception >= MODBUS_EXCEPTION_ILLEGAL_FUNCTION &&
           exception <= MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE;
}

static bool check_reply(const struct accelerometer *a, const uint8_t *reply, int count, int words,
                        struct error *err)
{
    const char *port = a->options.port;
    if (count < 2) // libmodbus passes over a frame to somebody else
        return fail(err, ERROR_RETRY, "%s: an answer, but not of unit %d", port, a->options.unit);
    if (count < 3)
        return fail(err, ERROR_RETRY, "%s: reply of %d bytes", port, count);
    if (reply[0] != a->options.unit)
        return fail(err, ERROR_RETRY, "%s: unit %d answered for unit %d", port, reply[0],
                    a->options.unit);
    if (reply[1] == (a->map.function | EXCEPTION))
        return fail(err, ERROR_RETRY, "%s: %s%s", port, modbus_strerror(MODBUS_ENOBASE + reply[2]),
                    asks_for_nothing(reply[2]) ? ": is the map right?" : "");
    if (reply[1] != a->map.function || reply[2] != 2 * words || count < 3 + 2 * words)
        return fail(err, ERROR_RETRY, "%s: function %d with %d bytes instead of %d with %d", port,
                    reply[1], reply[2], a->map.function, 2 * words);
    return true;
}

static bool set_timeouts(struct accelerometer *a, int64_t deadline_ns, struct error *err)
{
    int response = deadline_ms(deadline_ns, RESPONSE_MS);
    int byte = response < BYTE_MS ? response : BYTE_MS;
    if (response <= 0)
        return fail(err, ERROR_RETRY, "%s: no time left", a->options.port);
    modbus_set_response_timeout(a->modbus, 0, (uint32_t)response * 1000);
    modbus_set_byte_timeout(a->modbus, 0, (uint32_t)byte * 1000);
    return true;
}

// "192.168.0.7:502" or "localhost:502": names are not looked up, since that
// cannot be bounded in time.
static bool is_tcp(const char *port)
{
    return *port != '/' && strchr(port, ':');
}

// libmodbus numbers all raw requests alike over TCP: a late answer would pass
// for the one to the next request.
static bool send_request(struct accelerometer *a, const uint8_t request[6])
{
    if (!is_tcp(a->options.port))
        return modbus_send_raw_request(a->modbus, request, 6) >= 0;
    a->transaction++;
    uint8_t frame[12] = {a->transaction >> 8, a->transaction & 255, 0, 0, 0, 6};
    memcpy(frame + 6, request, 6);
    return send(modbus_get_socket(a->modbus), frame, sizeof frame, MSG_NOSIGNAL) == sizeof frame;
}

static bool check_transaction(const struct accelerometer *a, const uint8_t *reply,
                              struct error *err)
{
    if (!is_tcp(a->options.port) || (reply[0] << 8 | reply[1]) == a->transaction)
        return true;
    return fail(err, ERROR_RETRY, "%s: the answer to another request", a->options.port);
}

// By raw frames, since libmodbus over TCP takes an answer of any unit.
static bool read_registers(struct accelerometer *a, int first, int words, uint16_t *out,
                           int64_t deadline_ns, struct error *err)
{
    uint8_t reply[MODBUS_MAX_ADU_LENGTH];
    const uint8_t request[] = {(uint8_t)a->options.unit,
                               (uint8_t)a->map.function,
                               first >> 8 & 255,
                               first & 255,
                               0,
                               (uint8_t)words};
    if (!set_timeouts(a, deadline_ns, err))
        return false;
    modbus_flush(a->modbus);
    if (!send_request(a, request))
        return fail_modbus(a, err);
    int count = modbus_receive_confirmation(a->modbus, reply);
    if (count < 0)
        return fail_modbus(a, err);
    int header = modbus_get_header_length(a->modbus);
    const uint8_t *body = reply + header - 1;
    if (!check_transaction(a, reply, err) || !check_reply(a, body, count - header + 1, words, err))
        return false;
    for (int i = 0; i < words; i++)
        out[i] = (uint16_t)(body[3 + 2 * i] << 8 | body[4 + 2 * i]);
    return true;
}

static modbus_t *new_tcp(const char *port, struct error *err)
{
    char host[128];
    const char *colon = strrchr(port, ':');
    struct in_addr address;
    snprintf(host, sizeof host, "%.*s", (int)(colon - port), port);
    if (!strcmp(host, "localhost"))
        strcpy(host, "127.0.0.1");
    int number = atoi(colon + 1);
    if (inet_pton(AF_INET, host, &address) == 1 && number > 0 && number < 65536)
        return modbus_new_tcp(host, number);
    fail(err, ERROR_CONFIG, "port: \"%s\" is neither a serial line nor a numeric ADDRESS:PORT",
         port);
    return NULL;
}

static bool fail_connect(const char *port, struct error *err)
{
    if (errno == EACCES || errno == EPERM)
        return fail(err, ERROR_SYSTEM,
                    "%s: no permission; install the udev rules " UDEV_RULES_FILE
                    " (boothcal list --udev) or join the group of the device",
                    port);
    return fail(err, ERROR_GONE, "%s: %s", port, modbus_strerror(errno));
}

static bool connect_bus(struct accelerometer *a, int64_t deadline_ns, struct error *err)
{
    const struct accelerometer_options *o = &a->options;
    bool tcp = is_tcp(o->port);
    a->modbus = tcp ? new_tcp(o->port, err) : modbus_new_rtu(o->port, o->baud, 'N', 8, 1);
    if (!a->modbus)
        return !tcp && fail(err, ERROR_CONFIG, "port: \"%s\" is not a serial line", o->port);
    modbus_set_slave(a->modbus, o->unit);
    modbus_set_error_recovery(a->modbus, MODBUS_ERROR_RECOVERY_NONE);
    if (!set_timeouts(a, deadline_ns, err))
        return false;
    a->connected = modbus_connect(a->modbus) == 0;
    return a->connected || fail_connect(o->port, err);
}

// Printable characters of either byte order; units differ.
static void serial_text(const uint16_t words[SERIAL_WORDS], bool low_first,
                        char out[2 * SERIAL_WORDS + 1])
{
    int n = 0;
    for (int i = 0; i < 2 * SERIAL_WORDS; i++) {
        char c = (char)(words[i / 2] >> ((i & 1) == low_first ? 8 : 0) & 255);
        if (c <= ' ' || c > '~')
            break;
        out[n++] = c;
    }
    out[n] = 0;
}

static bool known_prefix(const char *serial)
{
    return !strncmp(serial, "EMU", 3) || !strncmp(serial, "WT", 2);
}

static bool read_field(struct accelerometer *a, const struct modbus_field *field, uint16_t *out,
                       int64_t deadline_ns, struct error *err)
{
    int words = modbus_field_words(field);
    return !words || read_registers(a, field->first, words, out, deadline_ns, err);
}

static bool read_map(struct accelerometer *a, int64_t deadline_ns, struct tilt_sample *out,
                     struct error *err)
{
    uint16_t accel[MODBUS_MAP_WORDS_MOST], angle[MODBUS_MAP_WORDS_MOST];
    const struct modbus_map *map = &a->map;
    if (map->together) {
        int words = witmotion_count(map) + a->padding;
        if (!read_registers(a, witmotion_first(map), words, accel, deadline_ns, err))
            return false;
        witmotion_decode(map, accel, a->options.offset_deg, out);
        return true;
    }
    if (!read_field(a, &map->accel, accel, deadline_ns, err) ||
        !read_field(a, &map->angle, angle, deadline_ns, err))
        return false;
    modbus_decode(map, map->accel.first < 0 ? NULL : accel, map->angle.first < 0 ? NULL : angle,
                  a->options.offset_deg, out);
    return true;
}

static bool greet(struct accelerometer *a, int64_t deadline_ns, struct error *err)
{
    uint16_t words[SERIAL_WORDS];
    struct tilt_sample sample;
    if (a->map.version < 0)
        return read_map(a, deadline_ns, &sample, err) || while_doing(err, "asking for the tilt");
    if (!read_registers(a, a->map.version, 1, words, deadline_ns, err))
        return while_doing(err, "asking for the firmware version");
    snprintf(a->version, sizeof a->version, "%d", words[0]);
    if (!read_registers(a, a->map.serial, SERIAL_WORDS, words, deadline_ns, NULL))
        return true;
    serial_text(words, true, a->serial);
    if (!known_prefix(a->serial)) {
        char other[sizeof a->serial];
        serial_text(words, false, other);
        if (known_prefix(other))
            strcpy(a->serial, other);
    }
    return true;
}

static void witmotion_close(struct accelerometer *a)
{
    if (!a)
        return;
    if (a->connected)
        modbus_close(a->modbus);
    modbus_free(a->modbus);
    free(a);
}

static struct accelerometer *witmotion_open(const struct accelerometer_options *options,
                                            int64_t deadline_ns, struct error *err)
{
    struct accelerometer *a = calloc(1, sizeof *a);
    if (!a) {
        fail_errno(err, "opening the inclinometer");
        return NULL;
    }
    a->options = *options;
    const struct modbus_map *row = witmotion_map(options->model);
    if (row)
        a->map = *row;
    if ((row || modbus_map_generic(options, &a->map, err)) && connect_bus(a, deadline_ns, err)) {
        if (greet(a, deadline_ns, err))
            return a;
        if (err && err->code == ERROR_RETRY)
            err->code = ERROR_GONE;
    }
    witmotion_close(a);
    return NULL;
}

static bool witmotion_read(struct accelerometer *a, int64_t deadline_ns, struct tilt_sample *out,
                           struct error *err)
{
    struct tilt_sample sample = {0};
    int64_t asked = clock_now_ns();
    if (!read_map(a, deadline_ns, &sample, err)) {
        int most = is_tcp(a->options.port) ? MOST_FAILURES_TCP : MOST_FAILURES;
        a->padding = (a->padding + 1) % PADDINGS; // a late answer is to be known by its length
        if (++a->failures >= most && err)
            err->code = ERROR_GONE;
        return false;
    }
    a->failures = 0;
    sample.taken = (struct interval){asked, clock_now_ns()};
    *out = sample;
    return true;
}

static void witmotion_identify(const struct accelerometer *a, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    snprintf(out->model, sizeof out->model, "%s", a->map.model);
    snprintf(out->serial, sizeof out->serial, "%s", a->serial);
    snprintf(out->firmware, sizeof out->firmware, "%s", a->version);
    out->emulated = !strncmp(a->serial, "EMU", 3);
}

const struct accelerometer_driver witmotion_driver = {
    "witmotion", witmotion_open, witmotion_read, witmotion_identify, witmotion_close, false};
