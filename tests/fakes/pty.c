// SPDX-License-Identifier: Apache-2.0
#include "tests/fakes/pty.h"

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

static void *run(void *context)
{
    struct pty *pty = context;
    pty->peer(pty, pty->context);
    return NULL;
}

bool pty_start(struct pty *pty, void (*peer)(struct pty *pty, void *context), void *context)
{
    struct termios t;
    *pty = (struct pty){
        .master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC), .peer = peer, .context = context};
    if (pty->master < 0 || grantpt(pty->master) != 0 || unlockpt(pty->master) != 0 ||
        ptsname_r(pty->master, pty->path, sizeof pty->path) != 0)
        return false;
    if (tcgetattr(pty->master, &t) == 0) {
        cfmakeraw(&t);
        tcsetattr(pty->master, TCSANOW, &t);
    }
    pty->running = pthread_create(&pty->thread, NULL, run, pty) == 0;
    return pty->running;
}

static void join(struct pty *pty)
{
    pty->stop = true;
    if (pty->running)
        pthread_join(pty->thread, NULL);
    pty->running = false;
}

void pty_unplug(struct pty *pty)
{
    join(pty);
    if (pty->master >= 0)
        close(pty->master);
    pty->master = -1;
}

void pty_stop(struct pty *pty)
{
    pty_unplug(pty);
}

int pty_byte(struct pty *pty)
{
    struct pollfd p = {.fd = pty->master, .events = POLLIN};
    unsigned char byte;
    if (poll(&p, 1, 20) <= 0)
        return -1;
    if (read(pty->master, &byte, 1) == 1)
        return byte;
    usleep(5000); // nobody has the near end open
    return -1;
}

void pty_write(struct pty *pty, const void *bytes, int count)
{
    if (write(pty->master, bytes, (size_t)count) != count)
        pty->stop = true;
}
