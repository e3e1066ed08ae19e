// SPDX-License-Identifier: Apache-2.0
// What the main thread does when asked: show, patch, capture, probe, reload.
#ifndef DAEMON_REQUESTS_H
#define DAEMON_REQUESTS_H

#include "daemon/frame.h"
#include "daemon/jobs.h"

// Does one job and fills its answer. SHOW and PATCH have their frame on the
// screen when this returns. QUIT is only answered: the caller ends.
void request_do(struct booth *booth, const struct setup_source *source, struct job *job,
                int64_t now_ns);

// Loads everything again and shows it. *restart (may be NULL) receives an
// array of the settings that changed but count only after a restart; these
// keep their old values. When something cannot be loaded, or not be shown, all
// stays as it was.
bool booth_reload(struct booth *booth, const struct setup_source *source, int64_t now_ns,
                  json_t **restart, struct error *err);

// The second half of it: puts what was loaded (taken over in any case) in the
// place of what is in force.
bool booth_take(struct booth *booth, struct setup *next, int64_t now_ns, json_t **restart,
                struct error *err);

#endif
