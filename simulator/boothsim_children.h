// SPDX-License-Identifier: Apache-2.0
// The processes that boothsim starts: an X server of its own and the command
// to run in the emulated booth. Only these are ever signalled, by their id.
#ifndef SIMULATOR_BOOTHSIM_CHILDREN_H
#define SIMULATOR_BOOTHSIM_CHILDREN_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "base/error.h"
#include "simulator/scenario.h"

// A zeroed child was never started.
struct child {
    pid_t pid;
    bool ended;
    int status; // 0..255 as a shell sees it, once ended
};

// Starts Xvfb on a free display, with a screen of the panel's size and depth,
// no cursor, and its screen in run_dir/Xvfb_screen0; waits until it is ready or
// deadline_ns has passed. Its own words go to run_dir/xvfb.log.
bool child_start_xvfb(const struct scenario *scenario, const char *run_dir, int64_t deadline_ns,
                      struct child *out, int *display, struct error *err);

// Starts a command with DISPLAY=:display, or without DISPLAY when it is < 0.
bool child_start_command(char **argv, int display, struct child *out, struct error *err);

// Whether it has ended by now; never waits.
bool child_has_ended(struct child *child);

// Sends a signal unless it has ended.
void child_signal(struct child *child, int signal);

// Asks it to end, and kills it when it still runs at deadline_ns.
void child_stop(struct child *child, int64_t deadline_ns);

#endif
