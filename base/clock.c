// SPDX-License-Identifier: Apache-2.0
#include "base/clock.h"

#include <errno.h>
#include <string.h>
#include <time.h>

int64_t clock_now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * NS_PER_S + now.tv_nsec;
}

void clock_sleep_until_ns(int64_t deadline_ns)
{
    struct timespec at = {deadline_ns / NS_PER_S, deadline_ns % NS_PER_S};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL) == EINTR)
        ;
}

int64_t clock_utc_s(void)
{
    return time(NULL);
}

void clock_utc_text(int64_t utc_s, char text[21])
{
    time_t at = utc_s;
    struct tm utc;
    gmtime_r(&at, &utc);
    size_t size = strftime(text, 21, "%Y-%m-%dT%H:%M:%SZ", &utc);
    text[size] = 0;
}

bool clock_utc_parse(const char *text, int64_t *utc_s)
{
    struct tm utc = {0};
    char again[21];
    if (strlen(text) != sizeof again - 1 || !strptime(text, "%Y-%m-%dT%H:%M:%SZ", &utc))
        return false;
    int64_t at = timegm(&utc);
    clock_utc_text(at, again);
    if (strcmp(again, text)) // the 31st of February
        return false;
    *utc_s = at;
    return true;
}

void clock_utc(char text[21])
{
    clock_utc_text(clock_utc_s(), text);
}
