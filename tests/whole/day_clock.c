// SPDX-License-Identifier: Apache-2.0
// Clock and log of the day: base/clock.h and base/log.h, answered by the
// present lane. Nobody prints: the lines are counted.
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "tests/whole/day.h"

static const int64_t MIDNIGHT_S = 1770000000; // some day's, of the wall clock

struct lane *present;

void lane_pass(int64_t until_ns)
{
    struct lane *l = present;
    const struct happening *next = &l->plan[l->next];
    if (next->at_ns > until_ns) {
        l->now_ns = until_ns > l->now_ns ? until_ns : l->now_ns;
        return;
    }
    l->now_ns = next->at_ns > l->now_ns ? next->at_ns : l->now_ns;
    l->next++;
    l->fault = next->fault;
    l->since_ns = l->now_ns;
    if (l->strike)
        l->strike(l->fault);
}

void lane_wait(int64_t until_ns)
{
    while (present->now_ns < until_ns || present->plan[present->next].at_ns <= until_ns)
        lane_pass(until_ns);
}

// opentrack's driver compares the kernel's time stamps with the wall clock.
int clock_gettime(clockid_t clock, struct timespec *out)
{
    int result = (int)syscall(SYS_clock_gettime, clock, out);
    if (present && clock == CLOCK_REALTIME)
        *out =
            (struct timespec){MIDNIGHT_S + present->now_ns / NS_PER_S, present->now_ns % NS_PER_S};
    return result;
}

int64_t clock_now_ns(void)
{
    struct timespec now;
    if (present)
        return present->now_ns;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * NS_PER_S + now.tv_nsec;
}

void clock_sleep_until_ns(int64_t deadline_ns)
{
    struct timespec at = {deadline_ns / NS_PER_S, deadline_ns % NS_PER_S};
    if (present)
        lane_wait(deadline_ns);
    else
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
}

void clock_utc(char text[21])
{
    struct timespec now;
    struct tm utc;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    strftime(text, 21, "%Y-%m-%dT%H:%M:%SZ", &utc);
}

void log_init(const char *program, enum log_level least)
{
    (void)program, (void)least;
}

// "accelerometer: waiting: ..."
void log_line(enum log_level level, const char *format, ...)
{
    char text[1024], state[sizeof present->said] = "";
    va_list args;
    (void)level;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (!present || sscanf(text, "%*[^:]: %31[^:]", state) != 1)
        return;
    present->lines++;
    present->repeated += !strcmp(state, present->said);
    strcpy(present->said, state);
}
