// SPDX-License-Identifier: Apache-2.0
// What a device below umockdev needs whatever its bus: a node of the testbed,
// a thread that moves its data when they are due, and the faults of its wire.
#ifndef SIMULATOR_WIRE_DEVICE_H
#define SIMULATOR_WIRE_DEVICE_H

#include <pthread.h>
#include <stdbool.h>
#include <umockdev.h>

#include "base/error.h"
#include "simulator/model_noise.h"
#include "simulator/wire.h"
#include "simulator/wire_clients.h"
#include "simulator/wire_node.h"
#include "simulator/wire_wait.h"

// Moves all that is due and returns when to come back (CLOCK_MONOTONIC,
// INT64_MAX = only when woken). Called with the lock held, while plugged.
typedef int64_t wire_device_pump(void *owner);

struct wire_device {
    UMockdevTestbed *testbed;
    UMockdevIoctlBase *handler; // the owner connects its signals
    struct node node;
    char devnode[32];

    struct waiter waiter; // its lock guards what follows and what the owner's thread touches
    wire_device_pump *pump;
    void *owner;
    pthread_t thread;
    bool running, stopping, plugged;
    bool torn; // pulled by a fault: its thread then has torn_off called, with pulling held
    pthread_mutex_t *pulling;
    void (*torn_off)(void *owner);
    struct clients clients; // since it was plugged
    enum wire_fault fault;
    struct noise noise;
};

// Starts the thread of a zeroed device; `kind` sets its noise apart. After
// false, wire_device_end is still due.
bool wire_device_start(struct wire_device *device, UMockdevTestbed *testbed, uint64_t seed,
                       char kind, wire_device_pump *pump, void *owner, struct error *err);

// Opens the node, then attaches the handler to devnode. Undone by hide.
bool wire_device_attach(struct wire_device *device, struct error *err);

// Adds what umockdev reads in text, which it frees.
bool wire_device_add(struct wire_device *device, GString *text, struct error *err);

// Detaches the handler and hangs up.
void wire_device_hide(struct wire_device *device);

// Ends the thread, the rest stays. Not while pulling is held.
void wire_device_stop(struct wire_device *device);

// Ends everything; the device must be unplugged.
void wire_device_end(struct wire_device *device);

#endif
