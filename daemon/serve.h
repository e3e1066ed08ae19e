// SPDX-License-Identifier: Apache-2.0
// The control thread: answers clients from the latest snapshot and passes on
// what others must do.
#ifndef DAEMON_SERVE_H
#define DAEMON_SERVE_H

#include "base/control.h"
#include "base/mailbox.h"
#include "daemon/commands.h"

// All borrowed until serve_stop.
struct serve_with {
    struct mailbox *snapshots; // of struct snapshot, at least one inside
    struct acquire *instruments;
    struct desk *desk;
    struct jobs *main_jobs;
    const char *since; // UTC
};

struct serve;

// Listens at path and starts the thread. NULL with err.
struct serve *serve_start(const char *path, const struct serve_with *with, struct error *err);

// Whether the thread has given up, because its sockets could not be waited on:
// then nobody can reach the program any more. Any thread.
bool serve_ended(struct serve *serve);

// Ends the thread, answers what was finished, refuses what still waits (GONE),
// removes the socket. Accepts NULL.
void serve_stop(struct serve *serve);

#endif
