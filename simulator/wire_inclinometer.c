// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_inclinometer.h"

#include <modbus.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/wire_fault.h"

enum { READ_HOLDING = 0x03, WRITE_ONE = 0x06, EXCEPTION = 0x80, BITS_PER_BYTE = 10 };
enum { FRAME_LEAST = 8, FRAME_MOST = MODBUS_TCP_MAX_ADU_LENGTH, COUNT_MOST = 125 };
enum { RTU_HEADER = 1, TCP_HEADER = 7 };

#define LATE_NS (2 * NS_PER_S)

struct inclinometer {
    struct wire_options options;
    struct witmotion model;
    struct noise noise;
    modbus_t *server;
    modbus_mapping_t *registers;
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    int query_size; // > 0 while its answer is on its way
    int64_t answer_ns;
    bool drop_next;
};

static bool make_server(struct inclinometer *i, int fd)
{
    i->server = i->options.inclinometer_tcp
                    ? modbus_new_tcp("127.0.0.1", i->options.inclinometer_port)
                    : modbus_new_rtu("/dev/null", WITMOTION_BAUD, 'N', 8, 1);
    if (!i->server)
        return false;
    modbus_set_slave(i->server, WITMOTION_ADDRESS);
    modbus_set_socket(i->server, fd);
    return true;
}

struct inclinometer *inclinometer_create(const struct wire_options *options, struct error *err)
{
    struct inclinometer *i = calloc(1, sizeof(*i));
    if (i) {
        i->options = *options;
        noise_init(&i->noise, options->seed, 'm');
        i->registers = modbus_mapping_new(0, 0, WITMOTION_REGISTERS, 0);
        witmotion_init(&i->model, options->inclinometer_map, &options->around,
                       options->serial[WIRE_INCLINOMETER], options->seed, clock_now_ns());
    }
    if (i && i->registers)
        return i;
    fail(err, ERROR_SYSTEM, "out of memory");
    inclinometer_destroy(i);
    return NULL;
}

void inclinometer_destroy(struct inclinometer *inclinometer)
{
    if (!inclinometer)
        return;
    if (inclinometer->server)
        modbus_free(inclinometer->server);
    if (inclinometer->registers)
        modbus_mapping_free(inclinometer->registers);
    free(inclinometer);
}

static void plugged(void *context, int fd)
{
    struct inclinometer *i = context;
    if (!i->options.inclinometer_tcp) // on TCP a connection is no plug
        witmotion_init(&i->model, i->options.inclinometer_map, &i->options.around,
                       i->options.serial[WIRE_INCLINOMETER], i->options.seed, clock_now_ns());
    if (i->server)
        modbus_set_socket(i->server, fd);
    i->query_size = 0;
}

static const uint8_t *request(const struct inclinometer *i)
{
    return i->query + (i->options.inclinometer_tcp ? TCP_HEADER : RTU_HEADER);
}

static int function_of(const struct inclinometer *i)
{
    return request(i)[0];
}

static uint16_t word_at(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

static size_t reply_size(const struct inclinometer *i)
{
    if (function_of(i) != READ_HOLDING)
        return FRAME_LEAST;
    return 5 + 2 * (size_t)word_at(request(i) + 3);
}

// The time both frames take on the line at 9600 baud.
static int64_t on_the_line_ns(const struct inclinometer *i)
{
    size_t bytes = (size_t)i->query_size + reply_size(i);
    return (int64_t)bytes * BITS_PER_BYTE * NS_PER_S / WITMOTION_BAUD;
}

static bool is_for_us(const struct inclinometer *i)
{
    return !i->options.inclinometer_tcp || i->query[TCP_HEADER - 1] == WITMOTION_ADDRESS;
}

// After a request to somebody else libmodbus would take the next one for that
// device's answer, so it gets a fresh start.
static void receive(struct inclinometer *i, int fd)
{
    if (!i->server && !make_server(i, fd))
        return;
    int size = modbus_receive(i->server, i->query);
    if (size < 0)
        modbus_flush(i->server);
    if (size < FRAME_LEAST || !is_for_us(i)) {
        modbus_free(i->server);
        i->server = NULL;
        return;
    }
    i->query_size = size;
    i->answer_ns = clock_now_ns() + on_the_line_ns(i);
}

static void answer(struct inclinometer *i)
{
    int64_t now_ns = clock_now_ns();
    int function = function_of(i);
    if (function != READ_HOLDING && function != WRITE_ONE) {
        modbus_reply_exception(i->server, i->query, MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
        return;
    }
    witmotion_refresh(&i->model, i->answer_ns); // when it was due, however late it is
    memcpy(i->registers->tab_registers, i->model.registers, sizeof(i->model.registers));
    modbus_reply(i->server, i->query, i->query_size, i->registers);
    if (function == WRITE_ONE)
        witmotion_write(&i->model, word_at(request(i) + 1), word_at(request(i) + 3), now_ns);
}

// ---- answers that libmodbus would never give ----------------------------------------

static size_t put_words(struct inclinometer *i, uint8_t *out)
{
    size_t from = word_at(request(i) + 1), count = word_at(request(i) + 3);
    witmotion_refresh(&i->model, clock_now_ns());
    if (function_of(i) != READ_HOLDING || count > COUNT_MOST ||
        from + count > WITMOTION_REGISTERS) {
        out[0] = (uint8_t)(function_of(i) | EXCEPTION);
        out[1] = MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS;
        return 2;
    }
    out[0] = READ_HOLDING;
    out[1] = (uint8_t)(2 * count);
    for (size_t r = 0; r < count; r++) {
        out[2 + 2 * r] = (uint8_t)(i->model.registers[from + r] >> 8);
        out[3 + 2 * r] = i->model.registers[from + r] & 0xFF;
    }
    return 2 + 2 * count;
}

static uint16_t crc_of(const uint8_t *bytes, size_t size)
{
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = (uint16_t)(crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1);
    }
    return crc;
}

static size_t frame_tcp(struct inclinometer *i, uint8_t unit, uint8_t *out)
{
    size_t size = 1 + put_words(i, out + TCP_HEADER);
    memcpy(out, i->query, 4); // transaction, protocol
    out[4] = (uint8_t)(size >> 8);
    out[5] = size & 0xFF;
    out[6] = unit;
    return TCP_HEADER - 1 + size;
}

static size_t frame_rtu(struct inclinometer *i, uint8_t unit, uint8_t *out)
{
    out[0] = unit;
    size_t size = RTU_HEADER + put_words(i, out + RTU_HEADER);
    uint16_t crc = crc_of(out, size);
    out[size] = crc & 0xFF;
    out[size + 1] = (uint8_t)(crc >> 8);
    return size + 2;
}

static void answer_badly(struct inclinometer *i, int fd, enum wire_fault fault)
{
    uint8_t bytes[FRAME_MOST];
    uint8_t unit = WITMOTION_ADDRESS + (fault == WIRE_WRONG_UNIT);
    size_t size = i->options.inclinometer_tcp ? frame_tcp(i, unit, bytes)
                                              : frame_rtu(i, unit, bytes);
    if (fault == WIRE_BAD_CRC) // TCP has none: the transaction is another one
        bytes[i->options.inclinometer_tcp ? 0 : size - 1] ^= 0x55;
    size = fault_on(fault, &i->noise, bytes, size);
    ssize_t sent = i->options.inclinometer_tcp ? send(fd, bytes, size, MSG_NOSIGNAL)
                                               : write(fd, bytes, size);
    if (sent < 0)
        return; // nobody listens: as lost as on a real line
}

static unsigned exception_of(enum wire_fault fault)
{
    return fault == WIRE_STALL            ? MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY
           : fault == WIRE_BAD_FUNCTION   ? MODBUS_EXCEPTION_ILLEGAL_FUNCTION
           : fault == WIRE_BAD_ADDRESS    ? MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS
           : fault == WIRE_BAD_VALUE      ? MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE
           : fault == WIRE_DEVICE_FAILURE ? MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE
                                          : 0;
}

static void respond(struct inclinometer *i, int fd, enum wire_fault fault)
{
    bool drop = fault == WIRE_HALF_OPEN || (fault == WIRE_DROPPED && i->drop_next);
    i->drop_next = fault == WIRE_DROPPED && !i->drop_next;
    if (drop)
        return;
    if (exception_of(fault))
        modbus_reply_exception(i->server, i->query, exception_of(fault));
    else if (fault == WIRE_FINE || fault == WIRE_LATE || fault == WIRE_DROPPED)
        answer(i);
    else
        answer_badly(i, fd, fault);
}

static int64_t serve(void *context, int fd, bool readable, enum wire_fault fault)
{
    struct inclinometer *i = context;
    if (i->query_size == 0 && readable)
        receive(i, fd);
    if (i->query_size == 0)
        return INT64_MAX;
    int64_t due_ns = i->answer_ns + (fault == WIRE_LATE ? LATE_NS : 0);
    if (clock_now_ns() < due_ns)
        return due_ns;
    respond(i, fd, fault);
    i->query_size = 0;
    return INT64_MAX;
}

struct line_end inclinometer_end(struct inclinometer *inclinometer)
{
    return (struct line_end){.context = inclinometer, .plugged = plugged, .serve = serve};
}
