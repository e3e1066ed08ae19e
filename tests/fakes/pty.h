// SPDX-License-Identifier: Apache-2.0
// A serial line with a scripted peer at its far end, for drivers of serial
// instruments.
#ifndef TESTS_FAKES_PTY_H
#define TESTS_FAKES_PTY_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

struct pty {
    char path[64]; // what the driver opens
    int master;    // what the peer reads and writes
    atomic_bool stop;
    pthread_t thread;
    bool running;
    void (*peer)(struct pty *pty, void *context);
    void *context;
};

// Opens a raw pty and runs peer on its own thread until it returns; peer
// should look at stop at least every 50 ms. False on failure.
bool pty_start(struct pty *pty, void (*peer)(struct pty *pty, void *context), void *context);

// Stops the peer and closes the far end, as when the cable is pulled.
void pty_unplug(struct pty *pty);

// The same, at the end of a test; may follow pty_unplug.
void pty_stop(struct pty *pty);

// One byte within 20 ms, or -1.
int pty_byte(struct pty *pty);

void pty_write(struct pty *pty, const void *bytes, int count);

#endif
