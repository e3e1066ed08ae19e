// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_clients.h"

void clients_add(struct clients *clients, const void *client)
{
    if (clients->count < CLIENTS_MOST)
        clients->items[clients->count++] = client;
}

void clients_remove(struct clients *clients, const void *client)
{
    for (int i = 0; i < clients->count; i++)
        if (clients->items[i] == client)
            clients->items[i--] = clients->items[--clients->count];
}

bool clients_have(const struct clients *clients, const void *client)
{
    for (int i = 0; i < clients->count; i++)
        if (clients->items[i] == client)
            return true;
    return false;
}
