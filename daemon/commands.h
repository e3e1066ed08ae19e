// SPDX-License-Identifier: Apache-2.0
// What the control socket understands: requests checked and made into jobs,
// finished jobs made into replies. Control thread.
#ifndef DAEMON_COMMANDS_H
#define DAEMON_COMMANDS_H

#include "daemon/jobs.h"
#include "daemon/status.h"

// A request, checked, as a job. Errors (RANGE) name the field, its value and
// what is allowed; an unknown request or field is refused. Not for "status".
bool command_parse(const char *what, const json_t *request, struct job *job, struct error *err);

// True when the desk does such a job, else the main thread.
bool command_is_for_desk(enum job_kind kind);

// The reply of a finished job, which it takes from the job: writes a captured
// picture to its file, puts what is shown beside a reading. NULL with err.
json_t *command_reply(struct job *job, const struct snapshot *now, struct error *err);

#endif
