// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_radiometer.h"

#include <stdlib.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/model_pr655.h"
#include "simulator/wire_fault.h"

enum { CHUNK = 4096, NOT_CONSTANT = -1, OVERLOADED = -2, TOO_WEAK = -8 };

struct radiometer_end {
    struct pr655 *model;
    struct noise noise;
};

struct radiometer_end *radiometer_create(const struct wire_options *options, struct error *err)
{
    struct radiometer_end *r = calloc(1, sizeof(*r));
    struct pr655_options model = {.around = options->around,
                                  .serial = options->serial[WIRE_RADIOMETER],
                                  .seed = options->seed,
                                  .hurry = options->radiometer_hurry,
                                  .lapses = options->radiometer_lapses};
    if (r) {
        noise_init(&r->noise, options->seed, 'p');
        r->model = pr655_create(&model);
    }
    if (r && r->model)
        return r;
    fail(err, ERROR_SYSTEM, "out of memory");
    radiometer_destroy(r);
    return NULL;
}

void radiometer_destroy(struct radiometer_end *radiometer)
{
    if (!radiometer)
        return;
    pr655_destroy(radiometer->model);
    free(radiometer);
}

static void plugged(void *context, int fd)
{
    (void)context, (void)fd;
}

static void hear(struct radiometer_end *r, int fd)
{
    char bytes[CHUNK];
    ssize_t count = read(fd, bytes, sizeof(bytes));
    for (ssize_t i = 0; i < count; i++)
        pr655_in(r->model, clock_now_ns(), bytes[i]);
}

static int64_t serve(void *context, int fd, bool readable, enum wire_fault fault)
{
    struct radiometer_end *r = context;
    pr655_upset(r->model, fault == WIRE_STALL        ? NOT_CONSTANT
                          : fault == WIRE_OVERLOAD   ? OVERLOADED
                          : fault == WIRE_WEAK_LIGHT ? TOO_WEAK
                                                     : 0);
    pr655_lapse(r->model, lapse_of_fault(fault));
    if (readable)
        hear(r, fd);
    char bytes[CHUNK];
    int64_t again_ns;
    size_t size = pr655_out(r->model, clock_now_ns(), bytes, sizeof(bytes), &again_ns);
    size = fault_on(fault, &r->noise, (uint8_t *)bytes, size);
    if (size && write(fd, bytes, size) < 0)
        return again_ns; // nobody listens: as lost as on a real line
    return again_ns;
}

struct line_end radiometer_end(struct radiometer_end *radiometer)
{
    return (struct line_end){.context = radiometer, .plugged = plugged, .serve = serve};
}
