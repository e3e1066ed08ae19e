// SPDX-License-Identifier: Apache-2.0
// A lock with an alarm clock: an instrument's thread sleeps on it until its
// device is due or somebody asks for something.
#ifndef SIMULATOR_WIRE_WAIT_H
#define SIMULATOR_WIRE_WAIT_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

struct waiter {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    bool woken;
};

void waiter_init(struct waiter *waiter);
void waiter_fini(struct waiter *waiter);

static inline void waiter_lock(struct waiter *waiter)
{
    pthread_mutex_lock(&waiter->lock);
}

static inline void waiter_unlock(struct waiter *waiter)
{
    pthread_mutex_unlock(&waiter->lock);
}

// Both with the lock held. Waits, without it, until woken since the last wait
// or until_ns (CLOCK_MONOTONIC) has come; INT64_MAX = only until woken.
void waiter_wait(struct waiter *waiter, int64_t until_ns);
void waiter_wake(struct waiter *waiter);

#endif
