// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_opentrack.h"

#include <arpa/inet.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/model_opentrack.h"
#include "simulator/wire_fault.h"
#include "simulator/wire_wait.h"

enum { FLOOD_TIMES = 50 };

struct opentrack_end {
    struct waiter waiter; // its lock guards what follows
    struct opentrack *model;
    struct noise noise;
    int socket;
    enum wire_fault fault;
    bool running, stopping;
    pthread_t thread;
};

static enum opentrack_upset upset_of(enum wire_fault fault)
{
    return fault == WIRE_NOT_A_NUMBER   ? OPENTRACK_NOT_A_NUMBER
           : fault == WIRE_FROZEN       ? OPENTRACK_FROZEN
           : fault == WIRE_WRONG_SIZE   ? OPENTRACK_WRONG_SIZE
           : fault == WIRE_OUT_OF_RANGE ? OPENTRACK_OUT_OF_RANGE
                                        : OPENTRACK_WELL;
}

// A datagram that nobody takes is lost, as opentrack's own are.
static void send_on(struct opentrack_end *o, uint8_t *bytes, size_t size)
{
    bool lost = o->fault == WIRE_SILENT || o->fault == WIRE_UNPLUGGED;
    int times = lost ? 0 : o->fault == WIRE_FLOOD ? FLOOD_TIMES : 1;
    size = fault_on(o->fault, &o->noise, bytes, size);
    for (int i = 0; i < times; i++)
        if (send(o->socket, bytes, size, MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
            continue;
}

static void *run(void *argument)
{
    struct opentrack_end *o = argument;
    waiter_lock(&o->waiter);
    while (!o->stopping) {
        uint8_t bytes[OPENTRACK_MOST];
        int64_t again_ns;
        int size = opentrack_out(o->model, clock_now_ns(), bytes, &again_ns);
        if (size >= 0)
            send_on(o, bytes, (size_t)size);
        waiter_wait(&o->waiter, again_ns);
    }
    waiter_unlock(&o->waiter);
    return NULL;
}

static bool aim_at(struct opentrack_end *o, int port, struct error *err)
{
    struct sockaddr_in at = {.sin_family = AF_INET,
                             .sin_port = htons((uint16_t)port),
                             .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    o->socket = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (o->socket < 0 || connect(o->socket, (struct sockaddr *)&at, sizeof(at)) != 0)
        return fail_errno(err, "sending to 127.0.0.1:%d", port);
    return true;
}

struct opentrack_end *opentrack_end_create(const struct wire_options *options, struct error *err)
{
    struct opentrack_end *o = calloc(1, sizeof(*o));
    struct opentrack_options model = {.around = options->around,
                                      .rate_hz = options->opentrack_rate_hz,
                                      .zero = options->opentrack_zero,
                                      .mirrored = options->opentrack_mirrored,
                                      .seed = options->seed};
    if (!o) {
        fail(err, ERROR_SYSTEM, "out of memory");
        return NULL;
    }
    waiter_init(&o->waiter);
    noise_init(&o->noise, options->seed, 'd');
    o->socket = -1;
    o->model = opentrack_create(&model);
    bool good = o->model ? aim_at(o, options->opentrack_port, err)
                         : fail(err, ERROR_SYSTEM, "out of memory");
    o->running = good && pthread_create(&o->thread, NULL, run, o) == 0;
    if (o->running)
        return o;
    if (good)
        fail(err, ERROR_SYSTEM, "starting a thread");
    opentrack_end_destroy(o);
    return NULL;
}

void opentrack_end_set_fault(struct opentrack_end *end, enum wire_fault fault)
{
    waiter_lock(&end->waiter);
    end->fault = fault;
    opentrack_upset(end->model, upset_of(fault));
    waiter_unlock(&end->waiter);
}

void opentrack_end_destroy(struct opentrack_end *end)
{
    if (!end)
        return;
    waiter_lock(&end->waiter);
    end->stopping = true;
    waiter_wake(&end->waiter);
    waiter_unlock(&end->waiter);
    if (end->running)
        pthread_join(end->thread, NULL);
    if (end->socket >= 0)
        close(end->socket);
    opentrack_destroy(end->model);
    waiter_fini(&end->waiter);
    free(end);
}
