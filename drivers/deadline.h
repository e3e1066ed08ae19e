// SPDX-License-Identifier: Apache-2.0
// What is left until a deadline, in the milliseconds that libraries want.
#ifndef DRIVERS_DEADLINE_H
#define DRIVERS_DEADLINE_H

#include "base/clock.h"

// Milliseconds until deadline_ns, at most most_ms, never below 0; less than
// one millisecond counts as none, so that a wait never ends after the deadline.
static inline int deadline_ms(int64_t deadline_ns, int most_ms)
{
    int64_t left = (deadline_ns - clock_now_ns()) / NS_PER_MS;
    return left <= 0 ? 0 : left < most_ms ? (int)left : most_ms;
}

#endif
