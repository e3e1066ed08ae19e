// SPDX-License-Identifier: Apache-2.0
// Another program behind a pseudo terminal: its lines read, its keys pressed,
// every wait bounded. One thread.
#ifndef DRIVERS_CHILD_H
#define DRIVERS_CHILD_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "base/error.h"

enum { CHILD_LINE = 8192 };

struct child {
    pid_t pid; // 0 = none
    int fd;    // the terminal's master side, -1 = none
    char name[64];
    char pending[CHILD_LINE]; // bytes read and not yet handed out
    size_t used, shown;       // of them shown already as the start of a line
};

// Starts argv[0] (looked up in PATH) in a session of its own on a raw
// terminal, with one variable "NAME=value" more than our environment. CONFIG
// when there is no such program, SYSTEM.
bool child_start(struct child *child, const char *const argv[], const char *variable,
                 struct error *err);

// The next line without its end, or, when nothing more came within wait_ms or
// by the deadline, the start of one (*whole false), which will come again when
// there is more of it. Anything but printable ASCII becomes '?'. RETRY when
// nothing new came, GONE with the exit status when the program ended, DATA for
// a line without an end.
bool child_line(struct child *child, char *text, size_t size, int wait_ms, int64_t deadline_ns,
                bool *whole, struct error *err);

// Drops what was read and not yet handed out.
void child_forget(struct child *child);

// One byte. RETRY at the deadline, GONE.
bool child_write(struct child *child, char byte, int64_t deadline_ns, struct error *err);

// Hangs up, asks it to end, and after half a second ends it. Accepts a child
// that was never started.
void child_end(struct child *child);

#endif
