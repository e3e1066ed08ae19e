// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_device.h"

#include <errno.h>
#include <string.h>

static void pull(struct wire_device *d)
{
    waiter_unlock(&d->waiter);
    pthread_mutex_lock(d->pulling);
    waiter_lock(&d->waiter);
    bool torn = d->torn; // unless somebody was faster
    waiter_unlock(&d->waiter);
    if (torn)
        d->bus->torn_off(d->owner);
    pthread_mutex_unlock(d->pulling);
    waiter_lock(&d->waiter);
}

static void *run(void *argument)
{
    struct wire_device *d = argument;
    waiter_lock(&d->waiter);
    while (!d->stopping) {
        if (d->torn)
            pull(d);
        int64_t again_ns = d->plugged ? d->bus->pump(d->owner) : INT64_MAX;
        if (!d->torn)
            waiter_wait(&d->waiter, again_ns);
    }
    waiter_unlock(&d->waiter);
    return NULL;
}

static void on_connected(UMockdevIoctlBase *handler, UMockdevIoctlClient *client, gpointer data)
{
    (void)handler;
    struct wire_device *d = data;
    waiter_lock(&d->waiter);
    if (d->plugged)
        clients_add(&d->clients, client);
    waiter_unlock(&d->waiter);
}

static void on_vanished(UMockdevIoctlBase *handler, UMockdevIoctlClient *client, gpointer data)
{
    (void)handler;
    struct wire_device *d = data;
    waiter_lock(&d->waiter);
    clients_remove(&d->clients, client);
    d->bus->vanished(d->owner, client);
    waiter_unlock(&d->waiter);
}

static gboolean on_ioctl(UMockdevIoctlBase *handler, UMockdevIoctlClient *client, gpointer data)
{
    (void)handler;
    struct wire_device *d = data;
    waiter_lock(&d->waiter);
    int result = d->bus->answer(d->owner, client);
    waiter_unlock(&d->waiter);
    umockdev_ioctl_client_complete(client, result < 0 ? -1 : result, result < 0 ? -result : 0);
    return TRUE;
}

bool wire_device_start(struct wire_device *device, UMockdevTestbed *testbed, uint64_t seed,
                       const struct wire_device_bus *bus, void *owner, struct error *err)
{
    struct wire_device *d = device;
    d->testbed = testbed;
    d->bus = bus;
    d->owner = owner;
    d->node.master = d->node.slave = -1;
    d->handler = umockdev_ioctl_base_new();
    noise_init(&d->noise, seed, (uint64_t)bus->noise);
    waiter_init(&d->waiter);
    g_signal_connect(d->handler, "client-connected", G_CALLBACK(on_connected), d);
    g_signal_connect(d->handler, "client-vanished", G_CALLBACK(on_vanished), d);
    g_signal_connect(d->handler, "handle-ioctl", G_CALLBACK(on_ioctl), d);
    d->running = pthread_create(&d->thread, NULL, run, d) == 0;
    return d->running || fail(err, ERROR_SYSTEM, "starting a thread");
}

static bool refused(const struct wire_device *d, GError *problem, struct error *err)
{
    fail(err, ERROR_SYSTEM, "emulating %s: %s", d->devnode, problem->message);
    g_error_free(problem);
    return false;
}

bool wire_device_attach(struct wire_device *device, struct error *err)
{
    struct wire_device *d = device;
    GError *problem = NULL;
    if (!node_open(&d->node, err))
        return false;
    if (umockdev_testbed_attach_ioctl(d->testbed, d->devnode, d->handler, &problem))
        return true;
    node_close(&d->node);
    return refused(d, problem, err);
}

static void set_plugged(struct wire_device *d, bool plugged)
{
    waiter_lock(&d->waiter);
    d->plugged = plugged;
    waiter_wake(&d->waiter);
    waiter_unlock(&d->waiter);
}

bool wire_device_come_in(struct wire_device *device, struct error *err)
{
    set_plugged(device, true);
    if (device->bus->show(device->owner, err))
        return true;
    set_plugged(device, false);
    wire_device_hide(device);
    return false;
}

int wire_device_put(UMockdevIoctlData *arg, size_t size, const void *bytes, size_t count)
{
    UMockdevIoctlData *out = umockdev_ioctl_data_resolve(arg, 0, size, NULL);
    if (!out)
        return -EFAULT;
    count = count < size ? count : size;
    memcpy(out->data, bytes, count);
    g_object_unref(out);
    return (int)count;
}

void wire_device_set_fault(struct wire_device *device, enum wire_fault fault)
{
    waiter_lock(&device->waiter);
    device->fault = fault;
    node_forbid(&device->node, fault == WIRE_FORBIDDEN);
    waiter_wake(&device->waiter);
    waiter_unlock(&device->waiter);
}

void wire_device_with(struct wire_device *device, void (*act)(void *context), void *context)
{
    waiter_lock(&device->waiter);
    act(context);
    waiter_wake(&device->waiter);
    waiter_unlock(&device->waiter);
}

bool wire_device_add(struct wire_device *device, GString *text, struct error *err)
{
    GError *problem = NULL;
    bool added = umockdev_testbed_add_from_string(device->testbed, text->str, &problem);
    g_string_free(text, TRUE);
    return added || refused(device, problem, err);
}

void wire_device_hide(struct wire_device *device)
{
    struct wire_device *d = device;
    umockdev_testbed_detach_ioctl(d->testbed, d->devnode, NULL);
    waiter_lock(&d->waiter);
    node_close(&d->node);
    waiter_unlock(&d->waiter);
}

void wire_device_stop(struct wire_device *device)
{
    struct wire_device *d = device;
    if (!d->running)
        return;
    waiter_lock(&d->waiter);
    d->stopping = true;
    waiter_wake(&d->waiter);
    waiter_unlock(&d->waiter);
    pthread_join(d->thread, NULL);
    d->running = false;
}

void wire_device_end(struct wire_device *device)
{
    struct wire_device *d = device;
    wire_device_stop(d);
    g_signal_handlers_disconnect_by_data(d->handler, d);
    g_signal_handlers_disconnect_by_data(d->handler, d->owner);
    g_object_unref(d->handler);
    waiter_fini(&d->waiter);
}
