// SPDX-License-Identifier: Apache-2.0
#include "tests/fakes/manager.h"

#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

bool manager_open(struct manager *m, const char *folder)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    *m = (struct manager){.fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
    snprintf(m->path, sizeof m->path, "%.90s/notify", folder);
    strcpy(address.sun_path, m->path);
    return m->fd >= 0 && !bind(m->fd, (struct sockaddr *)&address, sizeof address);
}

void manager_close(struct manager *m)
{
    if (m->fd >= 0)
        close(m->fd);
    unlink(m->path);
}

static long long now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000LL + now.tv_nsec / 1000000;
}

int manager_count(const struct manager *m, const char *line)
{
    size_t length = strlen(line);
    int count = 0;
    for (const char *at = m->heard; *at;) {
        const char *end = strchr(at, '\n');
        count += (size_t)(end - at) == length && !strncmp(at, line, length);
        at = end + 1;
    }
    return count;
}

bool manager_hears(struct manager *m, const char *line, int timeout_ms)
{
    long long until_ms = now_ms() + timeout_ms;
    while (!manager_count(m, line)) {
        long long left_ms = until_ms - now_ms();
        struct pollfd waiting = {m->fd, POLLIN, 0};
        if (left_ms < 0 || poll(&waiting, 1, (int)left_ms) <= 0)
            return false;
        size_t used = strlen(m->heard);
        ssize_t size = recv(m->fd, m->heard + used, sizeof m->heard - used - 2, 0);
        if (size > 0)
            strcpy(m->heard + used + size, m->heard[used + size - 1] == '\n' ? "" : "\n");
    }
    return true;
}
