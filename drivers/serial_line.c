// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_line.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "drivers/deadline.h"
#include "drivers/udev.h"

static bool gone(const struct serial_line *line, struct error *err)
{
    return fail(err, ERROR_GONE, "%s: the line is gone", line->path);
}

static bool fail_open(const char *path, struct error *err)
{
    if (errno == EACCES || errno == EPERM)
        return fail(err, ERROR_SYSTEM,
                    "%s: no permission; install the udev rules " UDEV_RULES_FILE
                    " (boothcal list --udev) or join the group of the device",
                    path);
    if (errno == EBUSY)
        return fail(err, ERROR_SYSTEM, "%s: another program uses the line", path);
    return fail(err, ERROR_GONE, "%s: %s", path, strerror(errno));
}

static bool set_line(int fd)
{
    struct termios t;
    if (tcgetattr(fd, &t) != 0)
        return false;
    cfmakeraw(&t);
    cfsetspeed(&t, B9600);
    t.c_cflag |= CLOCAL | CREAD;
    t.c_cflag &= ~(tcflag_t)(CSTOPB | CRTSCTS);
    t.c_cc[VMIN] = 0;
    t.c_cc[VTIME] = 0;
    return tcsetattr(fd, TCSANOW, &t) == 0;
}

bool serial_line_open(struct serial_line *line, const char *path, struct error *err)
{
    memset(line, 0, sizeof *line);
    snprintf(line->path, sizeof line->path, "%s", path);
    line->fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (line->fd < 0)
        return fail_open(path, err);
    if (set_line(line->fd) && ioctl(line->fd, TIOCEXCL) == 0)
        return true;
    fail_errno(err, "%s: not a serial line", path);
    serial_line_close(line);
    return false;
}

void serial_line_close(struct serial_line *line)
{
    if (line->fd >= 0)
        close(line->fd);
    line->fd = -1;
}

// Waits for input at most wait_ms; *came tells whether bytes were added. What
// finds no room waits in the kernel.
static bool take(struct serial_line *line, int wait_ms, bool *came, struct error *err)
{
    bool full = line->used == sizeof line->pending;
    struct pollfd p = {.fd = line->fd, .events = full ? 0 : POLLIN};
    *came = false;
    int ready = poll(&p, 1, wait_ms);
    if ((ready < 0 && errno != EINTR) || (full && ready > 0))
        return gone(line, err);
    if (ready <= 0)
        return true;
    ssize_t count = read(line->fd, line->pending + line->used, sizeof line->pending - line->used);
    if (count > 0)
        line->used += (size_t)count;
    *came = count > 0;
    if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR))
        return gone(line, err);
    return !(p.revents & (POLLERR | POLLNVAL)) || gone(line, err);
}

bool serial_line_write(struct serial_line *line, const char *text, int gap_ms, int64_t deadline_ns,
                       struct error *err)
{
    for (; *text; text++) {
        bool came;
        if (clock_now_ns() >= deadline_ns)
            return fail(err, ERROR_RETRY, "%s: no time left to send", line->path);
        ssize_t count = write(line->fd, text, 1);
        if (count != 1 && errno != EAGAIN && errno != EINTR)
            return gone(line, err);
        if (count != 1)
            text--;
        int64_t until = clock_now_ns() + gap_ms * NS_PER_MS;
        for (int wait; (wait = deadline_ms(until, gap_ms)) > 0;)
            if (!take(line, wait, &came, err))
                return false;
    }
    return true;
}

static bool next_line(struct serial_line *line, char *text, size_t size)
{
    size_t skip = 0, end;
    while (skip < line->used && strchr("\r\n", line->pending[skip]))
        skip++;
    for (end = skip; end < line->used; end++)
        if (line->pending[end] == '\r' || line->pending[end] == '\n')
            break;
    bool whole = end < line->used;
    for (size_t i = skip; i < end; i++)
        if (line->pending[i] < ' ' || line->pending[i] > '~')
            line->pending[i] = '?';
    if (whole)
        snprintf(text, size, "%.*s", (int)(end - skip), line->pending + skip);
    size_t drop = whole ? end : skip;
    line->used -= drop;
    memmove(line->pending, line->pending + drop, line->used);
    return whole;
}

bool serial_line_read(struct serial_line *line, char *text, size_t size, int wait_ms,
                      int64_t deadline_ns, struct error *err)
{
    int64_t until = clock_now_ns() + wait_ms * NS_PER_MS;
    if (until > deadline_ns)
        until = deadline_ns;
    while (!next_line(line, text, size)) {
        bool came;
        int wait = deadline_ms(until, wait_ms);
        if (wait <= 0)
            return fail(err, ERROR_RETRY, "%s: no answer in time", line->path);
        if (line->used == sizeof line->pending)
            return fail(err, ERROR_DATA, "%s: a line without an end", line->path);
        if (!take(line, wait, &came, err))
            return false;
    }
    return true;
}

bool serial_line_quiet(struct serial_line *line, int quiet_ms, int64_t deadline_ns,
                       struct error *err)
{
    for (bool came = true; came;) {
        int wait = deadline_ms(deadline_ns, quiet_ms);
        if (wait <= 0)
            return fail(err, ERROR_RETRY, "%s: the line does not fall quiet", line->path);
        line->used = 0;
        if (!take(line, wait, &came, err))
            return false;
    }
    return true;
}
