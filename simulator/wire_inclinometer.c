// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_inclinometer.h"

#include <modbus.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/model_witmotion.h"
#include "simulator/wire_fault.h"

enum { READ_HOLDING = 0x03, WRITE_ONE = 0x06, FRAME_LEAST = 8, BITS_PER_BYTE = 10, REPLY_MOST = 64 };

struct inclinometer {
    struct wire_options options;
    struct witmotion model;
    struct noise noise;
    modbus_t *server;
    modbus_mapping_t *registers;
    uint8_t query[MODBUS_RTU_MAX_ADU_LENGTH];
    int query_size; // > 0 while its answer is on its way
    int64_t answer_ns;
};

static bool make_server(struct inclinometer *i, int fd)
{
    i->server = modbus_new_rtu("/dev/null", WITMOTION_BAUD, 'N', 8, 1);
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
    witmotion_init(&i->model, &i->options.around, i->options.serial[WIRE_INCLINOMETER],
                   i->options.seed, clock_now_ns());
    if (i->server)
        modbus_set_socket(i->server, fd);
    i->query_size = 0;
}

static int function_of(const struct inclinometer *i)
{
    return i->query[1];
}

static uint16_t word_at(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

static size_t reply_size(const struct inclinometer *i)
{
    if (function_of(i) != READ_HOLDING)
        return FRAME_LEAST;
    return 5 + 2 * (size_t)word_at(i->query + 4);
}

// The time both frames take on the line at 9600 baud.
static int64_t on_the_line_ns(const struct inclinometer *i)
{
    size_t bytes = (size_t)i->query_size + reply_size(i);
    return (int64_t)bytes * BITS_PER_BYTE * NS_PER_S / WITMOTION_BAUD;
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
    if (size < FRAME_LEAST) {
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
    witmotion_refresh(&i->model, now_ns);
    memcpy(i->registers->tab_registers, i->model.registers, sizeof(i->model.registers));
    modbus_reply(i->server, i->query, i->query_size, i->registers);
    if (function == WRITE_ONE)
        witmotion_write(&i->model, word_at(i->query + 2), word_at(i->query + 4), now_ns);
}

static void answer_badly(struct inclinometer *i, int fd, enum wire_fault fault)
{
    uint8_t bytes[REPLY_MOST] = {WITMOTION_ADDRESS, (uint8_t)function_of(i)};
    size_t size = reply_size(i) < REPLY_MOST ? reply_size(i) : REPLY_MOST;
    bytes[2] = (uint8_t)(size - 5);
    size = fault_on(fault, &i->noise, bytes, size);
    if (size && write(fd, bytes, size) < 0)
        return; // nobody listens: as lost as on a real line
}

static int64_t serve(void *context, int fd, bool readable, enum wire_fault fault)
{
    struct inclinometer *i = context;
    if (i->query_size == 0 && readable)
        receive(i, fd);
    if (i->query_size == 0)
        return INT64_MAX;
    if (clock_now_ns() < i->answer_ns)
        return i->answer_ns;
    if (fault == WIRE_STALL)
        modbus_reply_exception(i->server, i->query, MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY);
    else if (fault == WIRE_FINE)
        answer(i);
    else
        answer_badly(i, fd, fault);
    i->query_size = 0;
    return INT64_MAX;
}

struct line_end inclinometer_end(struct inclinometer *inclinometer)
{
    return (struct line_end){.context = inclinometer, .plugged = plugged, .serve = serve};
}
