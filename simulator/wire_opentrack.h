// SPDX-License-Identifier: Apache-2.0
// opentrack on its wire: datagrams to a UDP port of this machine, from a thread
// of its own, whether anybody listens or not.
#ifndef SIMULATOR_WIRE_OPENTRACK_H
#define SIMULATOR_WIRE_OPENTRACK_H

#include "simulator/wire.h"

struct opentrack_end;

// Begins to send to 127.0.0.1:options->opentrack_port. NULL with err.
struct opentrack_end *opentrack_end_create(const struct wire_options *options, struct error *err);

// Any thread.
void opentrack_end_set_fault(struct opentrack_end *end, enum wire_fault fault);

// Ends the thread. Accepts NULL.
void opentrack_end_destroy(struct opentrack_end *end);

#endif
