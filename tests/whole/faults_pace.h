// SPDX-License-Identifier: Apache-2.0
// How late things happen on this machine now. A thread asks an idle boothd for
// its status again and again; by what a request takes the bounds of other
// things grow, so that a busy machine fails no test.
#ifndef TESTS_WHOLE_FAULTS_PACE_H
#define TESTS_WHOLE_FAULTS_PACE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/control.h"

// Starts asking; the client stays with the thread until pace_stop.
bool pace_start(struct control_client *daemon);
void pace_stop(void);

// What one exchange with another program took on average between these
// instants (CLOCK_MONOTONIC), or in the second before the later one, in ms:
// waking up when it was time, and an answer.
double pace_exchange_ms(int64_t from_ns, int64_t to_ns);

#endif
