// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_wait.h"

#include <errno.h>
#include <time.h>

#include "base/clock.h"

void waiter_init(struct waiter *waiter)
{
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&waiter->lock, NULL);
    pthread_cond_init(&waiter->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    waiter->woken = false;
}

void waiter_fini(struct waiter *waiter)
{
    pthread_cond_destroy(&waiter->changed);
    pthread_mutex_destroy(&waiter->lock);
}

void waiter_wait(struct waiter *waiter, int64_t until_ns)
{
    struct timespec until = {.tv_sec = (time_t)(until_ns / NS_PER_S),
                             .tv_nsec = (long)(until_ns % NS_PER_S)};
    int result = 0;
    while (!waiter->woken && result != ETIMEDOUT) {
        if (until_ns == INT64_MAX)
            pthread_cond_wait(&waiter->changed, &waiter->lock);
        else
            result = pthread_cond_timedwait(&waiter->changed, &waiter->lock, &until);
    }
    waiter->woken = false;
}

void waiter_wake(struct waiter *waiter)
{
    waiter->woken = true;
    pthread_cond_signal(&waiter->changed);
}
