// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_device.h"

static void pull(struct wire_device *d)
{
    waiter_unlock(&d->waiter);
    pthread_mutex_lock(d->pulling);
    waiter_lock(&d->waiter);
    bool torn = d->torn; // unless somebody was faster
    waiter_unlock(&d->waiter);
    if (torn)
        d->torn_off(d->owner);
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
        int64_t again_ns = d->plugged ? d->pump(d->owner) : INT64_MAX;
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

bool wire_device_start(struct wire_device *device, UMockdevTestbed *testbed, uint64_t seed,
                       char kind, wire_device_pump *pump, void *owner, struct error *err)
{
    struct wire_device *d = device;
    d->testbed = testbed;
    d->pump = pump;
    d->owner = owner;
    d->node.master = d->node.slave = -1;
    d->handler = umockdev_ioctl_base_new();
    noise_init(&d->noise, seed, kind);
    waiter_init(&d->waiter);
    g_signal_connect(d->handler, "client-connected", G_CALLBACK(on_connected), d);
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
