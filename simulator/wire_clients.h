// SPDX-License-Identifier: Apache-2.0
// Who has a device open since it was plugged in. A program that had it open
// before stays connected to the emulator and must find its device gone.
#ifndef SIMULATOR_WIRE_CLIENTS_H
#define SIMULATOR_WIRE_CLIENTS_H

#include <stdbool.h>

enum { CLIENTS_MOST = 64 };

// Zero it to begin, and when the plug is pulled.
struct clients {
    const void *items[CLIENTS_MOST];
    int count;
};

// One more than CLIENTS_MOST finds no device.
void clients_add(struct clients *clients, const void *client);
void clients_remove(struct clients *clients, const void *client);
bool clients_have(const struct clients *clients, const void *client);

#endif
