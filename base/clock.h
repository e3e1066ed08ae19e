// SPDX-License-Identifier: Apache-2.0
// The monotonic clock, read by programs and by drivers, who wait until a deadline;
// elsewhere time is an argument. A test may answer for it (tests/whole/day.h).
#ifndef BASE_CLOCK_H
#define BASE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#define NS_PER_S INT64_C(1000000000)
#define NS_PER_MS INT64_C(1000000)
#define NS_PER_US INT64_C(1000)

// Nanoseconds of CLOCK_MONOTONIC. Never goes back. Any thread.
int64_t clock_now_ns(void);

// Sleeps until CLOCK_MONOTONIC reaches deadline_ns; returns at once if it has
// passed. Programs only. Any thread.
void clock_sleep_until_ns(int64_t deadline_ns);

// UTC of now as "2026-01-31T12:34:56Z" into text (21 bytes). Programs only.
void clock_utc(char text[21]);

// The calendar: seconds since 1970-01-01, UTC, without leap seconds. It may
// jump when somebody sets it. Programs only.
int64_t clock_utc_s(void);

// Such seconds, of the years 1..9999, as that text, and back; false, and *utc_s
// untouched, when the text is no such time.
void clock_utc_text(int64_t utc_s, char text[21]);
bool clock_utc_parse(const char *text, int64_t *utc_s);

// A closed interval of monotonic time within which something was true: a
// sample integrates from earliest to latest.
struct interval {
    int64_t earliest_ns;
    int64_t latest_ns; // >= earliest_ns
};

#endif
