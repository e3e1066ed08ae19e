// SPDX-License-Identifier: Apache-2.0
// A serial line that speaks lines of text, with every wait bounded. One thread.
#ifndef DRIVERS_SERIAL_LINE_H
#define DRIVERS_SERIAL_LINE_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct serial_line {
    int fd; // -1 = closed
    char path[128];
    char pending[1024]; // bytes read and not yet handed out
    size_t used;
};

// Opens path raw at 9600 8N1 without flow control, for this process alone.
// GONE (not there), SYSTEM (permission: names the udev rule; or in use).
bool serial_line_open(struct serial_line *line, const char *path, struct error *err);

// Accepts a closed line.
void serial_line_close(struct serial_line *line);

// Writes text byte by byte with gap_ms between. RETRY at the deadline, GONE.
bool serial_line_write(struct serial_line *line, const char *text, int gap_ms, int64_t deadline_ns,
                       struct error *err);

// The next line that is not empty, without CR and LF, cut to size; anything but
// printable ASCII becomes '?'. RETRY when none came within wait_ms or by the
// deadline, DATA when it has no end, GONE.
bool serial_line_read(struct serial_line *line, char *text, size_t size, int wait_ms,
                      int64_t deadline_ns, struct error *err);

// Throws away what comes until quiet_ms passed without a byte. RETRY at the
// deadline, GONE.
bool serial_line_quiet(struct serial_line *line, int quiet_ms, int64_t deadline_ns,
                       struct error *err);

#endif
