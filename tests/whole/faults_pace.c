// SPDX-License-Identifier: Apache-2.0
#include "tests/fakes/support.h"

#include "tests/whole/faults_pace.h"

#include <pthread.h>

#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

enum { KEPT = 1 << 15 };
static const int64_t EVERY_NS = 30 * NS_PER_MS;

static struct {
    struct control_client *daemon;
    pthread_t thread;
    pthread_mutex_t lock; // of what follows
    bool stop;
    int64_t begun_ns[KEPT], ended_ns[KEPT]; // of the latest looks; the last may not have ended
    int count;
} pace = {.lock = PTHREAD_MUTEX_INITIALIZER};

static bool begin(void)
{
    pthread_mutex_lock(&pace.lock);
    bool stop = pace.stop;
    pace.begun_ns[pace.count % KEPT] = clock_now_ns();
    pace.ended_ns[pace.count % KEPT] = INT64_MAX;
    pace.count++;
    pthread_mutex_unlock(&pace.lock);
    return !stop;
}

static void end(void)
{
    pthread_mutex_lock(&pace.lock);
    pace.ended_ns[(pace.count - 1) % KEPT] = clock_now_ns();
    pthread_mutex_unlock(&pace.lock);
}

static void *ask_on(void *argument)
{
    (void)argument;
    while (begin()) {
        clock_sleep_until_ns(clock_now_ns() + EVERY_NS);
        json_decref(booth_status(pace.daemon));
        end();
    }
    return NULL;
}

bool pace_start(struct control_client *daemon)
{
    pace.daemon = daemon;
    return pthread_create(&pace.thread, NULL, ask_on, NULL) == 0;
}

void pace_stop(void)
{
    if (!pace.daemon)
        return;
    pthread_mutex_lock(&pace.lock);
    pace.stop = true;
    pthread_mutex_unlock(&pace.lock);
    pthread_join(pace.thread, NULL);
    control_close(pace.daemon);
}

double pace_exchange_ms(int64_t from_ns, int64_t to_ns)
{
    int64_t late_ns = 0, now_ns = clock_now_ns();
    int looks = 0;
    from_ns = from_ns < to_ns - NS_PER_S ? from_ns : to_ns - NS_PER_S;
    pthread_mutex_lock(&pace.lock);
    for (int i = pace.count > KEPT ? pace.count - KEPT : 0; i < pace.count; i++) {
        int64_t begun_ns = pace.begun_ns[i % KEPT], ended_ns = pace.ended_ns[i % KEPT];
        if (begun_ns > to_ns || ended_ns < from_ns)
            continue;
        int64_t took_ns = (ended_ns < now_ns ? ended_ns : now_ns) - begun_ns - EVERY_NS;
        late_ns += took_ns > 0 ? took_ns : 0;
        looks++;
    }
    pthread_mutex_unlock(&pace.lock);
    return looks ? (double)late_ns / looks / NS_PER_MS : 0;
}
