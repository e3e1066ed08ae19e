// SPDX-License-Identifier: Apache-2.0
#include "daemon/acquire.h"

#include <pthread.h>
#include <stdlib.h>

#include "base/clock.h"

struct worker {
    struct acquire *all;
    struct polled *polled;
    pthread_t thread;
    bool started;
};

struct acquire {
    struct worker workers[INSTRUMENTS_POLLED];
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool stop; // under lock
};

// True when the rest was cut short because all is to stop.
static bool rest(struct acquire *a, int64_t ns)
{
    int64_t until_ns = clock_now_ns() + ns;
    struct timespec until = {until_ns / NS_PER_S, until_ns % NS_PER_S};
    pthread_mutex_lock(&a->lock);
    while (!a->stop && ns > 0 && clock_now_ns() < until_ns)
        pthread_cond_timedwait(&a->wake, &a->lock, &until);
    bool stop = a->stop;
    pthread_mutex_unlock(&a->lock);
    return stop;
}

static void *work(void *argument)
{
    struct worker *w = argument;
    while (!rest(w->all, polled_turn(w->polled)))
        continue;
    polled_close(w->polled);
    return NULL;
}

static bool start(struct acquire *a, enum instrument instrument, const struct acquire_from *from,
                  struct error *err)
{
    struct worker *w = &a->workers[instrument];
    struct instrument_report report;
    w->all = a;
    w->polled = polled_create(from, instrument, err);
    if (!w->polled)
        return false;
    polled_report(w->polled, clock_now_ns(), &report);
    if (report.state == INSTRUMENT_IS_NONE)
        return true;
    w->started = !pthread_create(&w->thread, NULL, work, w);
    return w->started ||
           fail(err, ERROR_SYSTEM, "no thread for the %s", instrument_name(instrument));
}

struct acquire *acquire_start(const struct acquire_from *from, struct error *err)
{
    struct acquire *a = calloc(1, sizeof *a);
    if (!a) {
        fail(err, ERROR_SYSTEM, "no memory for the instruments");
        return NULL;
    }
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&a->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    pthread_mutex_init(&a->lock, NULL);
    bool all = true;
    for (int i = 0; all && i < INSTRUMENTS_POLLED; i++)
        all = start(a, (enum instrument)i, from, err);
    if (all)
        return a;
    acquire_stop(a, INT64_MAX);
    return NULL;
}

static bool join(struct worker *w, int64_t deadline_ns)
{
    struct timespec until = {deadline_ns / NS_PER_S, deadline_ns % NS_PER_S};
    if (w->started && pthread_clockjoin_np(w->thread, NULL, CLOCK_MONOTONIC, &until))
        return false;
    w->started = false;
    return true;
}

bool acquire_stop(struct acquire *a, int64_t deadline_ns)
{
    if (!a)
        return true;
    pthread_mutex_lock(&a->lock);
    a->stop = true;
    pthread_cond_broadcast(&a->wake);
    pthread_mutex_unlock(&a->lock);
    bool all = true;
    for (int i = 0; i < INSTRUMENTS_POLLED; i++)
        all = join(&a->workers[i], deadline_ns) && all;
    if (!all)
        return false;
    for (int i = 0; i < INSTRUMENTS_POLLED; i++)
        polled_destroy(a->workers[i].polled);
    pthread_mutex_destroy(&a->lock);
    pthread_cond_destroy(&a->wake);
    free(a);
    return true;
}

void acquire_latest(struct acquire *a, struct samples *out)
{
    struct worker *w = a->workers;
    out->spectrum_number = polled_latest(w[INSTRUMENT_SPECTROMETER].polled, &out->spectrum);
    out->tilt_number = polled_latest(w[INSTRUMENT_ACCELEROMETER].polled, &out->tilt);
    out->head_number = polled_latest(w[INSTRUMENT_TRACKER].polled, &out->head);
}

void acquire_report(struct acquire *a, enum instrument instrument, struct instrument_report *out)
{
    *out = (struct instrument_report){0};
    if (instrument < INSTRUMENTS_POLLED)
        polled_report(a->workers[instrument].polled, clock_now_ns(), out);
}

uint64_t acquire_ask_series(struct acquire *a, const struct series_wanted *wanted)
{
    return polled_ask_series(a->workers[INSTRUMENT_SPECTROMETER].polled, wanted);
}

bool acquire_series(struct acquire *a, uint64_t number, struct series *out, struct error *err)
{
    return polled_series(a->workers[INSTRUMENT_SPECTROMETER].polled, number, out, err);
}
