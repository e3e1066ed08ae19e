// SPDX-License-Identifier: Apache-2.0
// A calibration that changes in the store while the booth is in service: it is
// seen by a look at the store's link now and then, loaded on a thread of its
// own, and put in force between two frames. One that is no good is refused, and
// the old one stays. Main thread.
#ifndef DAEMON_RENEW_H
#define DAEMON_RENEW_H

#include "daemon/requests.h"

struct renewal;

// NULL with err (SYSTEM). booth and source are borrowed until renewal_end.
struct renewal *renewal_begin(struct booth *booth, const struct setup_source *source,
                              struct error *err);

// To be called at every turn of the main loop; never waits. Takes what was loaded,
// looks at the link again after a quarter of a second, and at the age of the
// calibration. Logs what becomes of it.
void renewal_step(struct renewal *renewal, int64_t now_ns, int64_t utc_s);

// Waits for a load under way. Accepts NULL.
void renewal_end(struct renewal *renewal);

#endif
