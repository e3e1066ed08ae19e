// SPDX-License-Identifier: Apache-2.0
// The newest value of one kind, handed from one instrument thread to the main
// thread. The writer never waits for the reader; only the newest value is kept.
#ifndef BASE_MAILBOX_H
#define BASE_MAILBOX_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mailbox {
    pthread_mutex_t lock;
    size_t size;   // bytes of one value
    uint64_t sent; // values posted so far, 0 = empty
    void *value;
};

// Makes an empty mailbox for values of size bytes (> 0). False when out of memory.
bool mailbox_init(struct mailbox *box, size_t size);

// Frees what mailbox_init took. Accepts a zeroed box.
void mailbox_fini(struct mailbox *box);

// Copies size bytes in, replacing what was there. Any thread.
void mailbox_post(struct mailbox *box, const void *value);

// Copies the newest value out and returns its running number (1, 2, …), or
// returns 0 and leaves value untouched when nothing was ever posted. Any thread.
uint64_t mailbox_read(struct mailbox *box, void *value);

#endif
