// SPDX-License-Identifier: Apache-2.0
// What the service manager is told (sd_notify): ready, what is going on, that
// the frame loop is alive, that it stops. Without a manager nothing happens.
#ifndef DAEMON_NOTIFY_H
#define DAEMON_NOTIFY_H

#include <stdbool.h>
#include <stdint.h>

struct notifier {
    int64_t every_ns; // between signs of life; 0 = nobody watches
    int64_t next_ns;
    int64_t drawn_ns; // when a frame could last be drawn
    char line[256];   // last status told
};

// Reads from the environment whether and how often the manager watches.
void notify_init(struct notifier *n);

void notify_ready(void);

// Status line, told only when it changed.
void notify_line(struct notifier *n, const char *line);

// A sign of life when one is due: twice within the manager's patience; none
// once nothing could be drawn for 5 s, so that the manager starts anew.
void notify_alive(struct notifier *n, int64_t now_ns, bool drawing);

void notify_stopping(void);

#endif
