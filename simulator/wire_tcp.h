// SPDX-License-Identifier: Apache-2.0
// A TCP port on this machine that ends in an emulated instrument, and the
// instrument's thread. It serves one connection: a new one takes the place of
// the one before.
#ifndef SIMULATOR_WIRE_TCP_H
#define SIMULATOR_WIRE_TCP_H

#include "simulator/wire_line.h"

struct tcp_end;

// Not listening yet. port 0 = any that is free, the same one from then on;
// written as a number to the file port_path. NULL with err.
struct tcp_end *tcp_create(int port, const char *port_path, const struct line_end *end,
                           struct error *err);

// Listens at 127.0.0.1. One thread at a time.
bool tcp_plug(struct tcp_end *tcp, struct error *err);

bool tcp_is_plugged(const struct tcp_end *tcp);

// Closes the port and the connection. Accepts one that does not listen.
void tcp_unplug(struct tcp_end *tcp);

// What serve is told from now on. HALF_OPEN: connections that are there or come
// before its end are never served nor closed. Any thread.
void tcp_set_fault(struct tcp_end *tcp, enum wire_fault fault);

// Unplugs and ends the thread. Accepts NULL.
void tcp_destroy(struct tcp_end *tcp);

#endif
