// SPDX-License-Identifier: Apache-2.0
// What a device below umockdev needs whatever its bus: a node of the testbed,
// those who have it open, a thread that moves its data when they are due, and
// the faults of its wire.
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

// What sets one bus apart from another. All but show and torn_off are called
// with the device's lock held.
struct wire_device_bus {
    char noise; // sets its noise apart
    // Moves all that is due and returns when to come back (CLOCK_MONOTONIC,
    // INT64_MAX = only when woken). While plugged.
    int64_t (*pump)(void *owner);
    // What a system call on the node returns, a negative errno when it fails.
    int (*answer)(void *owner, UMockdevIoctlClient *client);
    // A client closed the node; it counts no longer.
    void (*vanished)(void *owner, UMockdevIoctlClient *client);
    // Puts the device into the testbed and tells of it.
    bool (*show)(void *owner, struct error *err);
    // A fault of its wire pulled it: takes it out of the testbed, with pulling
    // held. NULL when no fault does.
    void (*torn_off)(void *owner);
};

struct wire_device {
    UMockdevTestbed *testbed;
    UMockdevIoctlBase *handler; // the owner may connect more of its signals
    struct node node;
    char devnode[32];

    struct waiter waiter; // its lock guards what follows and what the owner's thread touches
    const struct wire_device_bus *bus;
    void *owner;
    pthread_t thread;
    bool running, stopping, plugged;
    bool torn; // pulled by a fault: its thread then has torn_off called
    pthread_mutex_t *pulling;
    struct clients clients; // since it was plugged
    enum wire_fault fault;
    struct noise noise;
};

// Starts the thread of a zeroed device (but for pulling). After false,
// wire_device_end is still due.
bool wire_device_start(struct wire_device *device, UMockdevTestbed *testbed, uint64_t seed,
                       const struct wire_device_bus *bus, void *owner, struct error *err);

// Opens the node, then attaches the handler to devnode. Undone by hide.
bool wire_device_attach(struct wire_device *device, struct error *err);

// From attached to plugged and shown; hidden again on failure.
bool wire_device_come_in(struct wire_device *device, struct error *err);

// Adds what umockdev reads in text, which it frees.
bool wire_device_add(struct wire_device *device, GString *text, struct error *err);

// Copies at most size bytes to where the argument of a client's ioctl points
// to. Returns how many, or -EFAULT.
int wire_device_put(UMockdevIoctlData *arg, size_t size, const void *bytes, size_t count);

// What its wire suffers from now on; FORBIDDEN closes the node to newcomers.
// Any thread.
void wire_device_set_fault(struct wire_device *device, enum wire_fault fault);

// Runs act(context) while the device is at rest. Any thread.
void wire_device_with(struct wire_device *device, void (*act)(void *context), void *context);

// Detaches the handler and hangs up.
void wire_device_hide(struct wire_device *device);

// Ends the thread, the rest stays. Not while pulling is held.
void wire_device_stop(struct wire_device *device);

// Ends everything; the device must be unplugged.
void wire_device_end(struct wire_device *device);

#endif
