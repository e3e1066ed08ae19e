// SPDX-License-Identifier: Apache-2.0
// A service manager's notification socket, as sd_notify(3) speaks to it.
#ifndef TESTS_FAKES_MANAGER_H
#define TESTS_FAKES_MANAGER_H

#include <stdbool.h>

struct manager {
    int fd;
    char path[108];
    char heard[65536]; // all messages so far, a line each
};

// Listens in a folder. False when it cannot.
bool manager_open(struct manager *m, const char *folder);
void manager_close(struct manager *m);

// Takes what comes within timeout_ms, until `line` was heard. True when it was.
bool manager_hears(struct manager *m, const char *line, int timeout_ms);

// How often a line was heard so far.
int manager_count(const struct manager *m, const char *line);

#endif
