// SPDX-License-Identifier: Apache-2.0
// A serial line that ends in an emulated instrument: a pseudo terminal behind
// a symlink in the run folder, and the instrument's thread.
#ifndef SIMULATOR_WIRE_LINE_H
#define SIMULATOR_WIRE_LINE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"
#include "simulator/wire.h"

struct line;

// What hangs on a line. All calls come from the line's thread.
struct line_end {
    void *context;
    // A line was plugged in; fd is the instrument's end of it.
    void (*plugged)(void *context, int fd);
    // Bytes may have arrived (wait for them no longer), or it is again_ns.
    // Returns when to be called again, INT64_MAX = when bytes arrive.
    int64_t (*serve)(void *context, int fd, bool readable, enum wire_fault fault);
};

// An unplugged line that will show as the symlink `path`. NULL with err.
struct line *line_create(const char *path, const struct line_end *end, struct error *err);

// Opens a new terminal, points the symlink to it. One thread at a time.
bool line_plug(struct line *line, struct error *err);

bool line_is_plugged(const struct line *line);

// Removes the symlink and hangs up. Accepts an unplugged line.
void line_unplug(struct line *line);

// What serve is told from now on, and whether the line may be opened. Not while
// it is plugged or unplugged.
void line_set_fault(struct line *line, enum wire_fault fault);

// Unplugs and ends the thread. Accepts NULL.
void line_destroy(struct line *line);

#endif
