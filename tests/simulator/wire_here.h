// SPDX-License-Identifier: Apache-2.0
// The wire with its four instruments around a world of plain numbers, for the
// test programs that call them through unmodified libraries. Include after
// cmocka.h.
#ifndef TESTS_SIMULATOR_WIRE_HERE_H
#define TESTS_SIMULATOR_WIRE_HERE_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "simulator/wire.h"

// Generous: these bound hangs, nothing is measured with them.
#define REPLY_MS 2000
#define SILENCE_MS 150

struct world {
    double irradiance, radiance; // flat over the wavelengths
};

static void irradiance(void *context, int64_t from_ns, int64_t to_ns, struct spectrum *out)
{
    (void)from_ns, (void)to_ns;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = ((struct world *)context)->irradiance;
}

static struct vec3 gravity(void *context, int64_t at_ns)
{
    (void)context, (void)at_ns;
    return (struct vec3){0, 9.81 * sin(M_PI / 6), 9.81 * cos(M_PI / 6)}; // 30 degrees
}

static void markers(void *context, int64_t at_ns, struct vec3 out[3])
{
    (void)context, (void)at_ns;
    out[0] = (struct vec3){0.1, 0.04, 0.8};
    out[1] = (struct vec3){0.1, 0.0, 0.8};
    out[2] = (struct vec3){0.1, -0.07, 0.8};
}

static void radiance(void *context, int64_t at_ns, struct spectrum *out)
{
    (void)at_ns;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = ((struct world *)context)->radiance;
}

static struct world world = {.irradiance = 0.01, .radiance = 0.001};
static struct wire *wire;
static char folder[] = "/tmp/test_wire.XXXXXX";

static inline struct wire_options usual(void)
{
    return (struct wire_options){
        .around = {&world, irradiance, gravity, markers, radiance, NULL},
        .run_dir = folder,
        .serial = {"EMU2+H00417", "EMUWT901", "EMU:WII:01", "EMU65500123"},
        .seed = 1,
        .radiometer_hurry = 100,
        .radiometer_lapses = {.drift = 0.01, .misread_every = 3},
        .collector_mm2 = 11.95,
    };
}

static inline int start_with(const struct wire_options *options)
{
    struct error err;
    assert_non_null(mkdtemp(strcpy(folder, "/tmp/test_wire.XXXXXX")));
    wire = wire_start(options, &err);
    if (!wire)
        fail_msg("%s", err.text);
    return 0;
}

static inline int start(void **state)
{
    (void)state;
    struct wire_options options = usual();
    return start_with(&options);
}

static inline int stop(void **state)
{
    (void)state;
    static const char *const left[] = {"spectrometer.cal", "spectrometer2.cal",
                                       "inclinometer.port"};
    wire_stop(wire);
    for (int i = 0; i < 3; i++) {
        char path[64];
        snprintf(path, sizeof(path), "%s/%s", folder, left[i]);
        unlink(path);
    }
    return rmdir(folder);
}

static inline void set_fault(enum wire_instrument instrument, enum wire_fault fault)
{
    wire_set_fault(wire, instrument, fault);
}

static inline const char *in_folder(const char *name)
{
    static char path[64];
    snprintf(path, sizeof(path), "%s/%s", folder, name);
    return path;
}

// The program itself again under umockdev-wrapper, unless it runs there
// already. Returns when it does; 1 when it cannot.
static inline int under_umockdev(const char *program)
{
    const char *preload = getenv("LD_PRELOAD");
    if (preload && strstr(preload, "umockdev"))
        return 0;
    setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 0); // the wrapper preloads before it
    execlp("umockdev-wrapper", "umockdev-wrapper", program, (char *)NULL);
    perror("umockdev-wrapper");
    return 1;
}

#endif
