// SPDX-License-Identifier: Apache-2.0
#include "drivers/child.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include "drivers/deadline.h"

extern char **environ; // handed on, not read

enum { END_MS = 500, KILL_MS = 500, LOOK_MS = 10 };

static bool open_terminal(int *master, char *path, size_t size, struct error *err)
{
    struct termios t;
    *master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (*master < 0 || grantpt(*master) != 0 || unlockpt(*master) != 0 ||
        ptsname_r(*master, path, size) != 0 || tcgetattr(*master, &t) != 0)
        return fail_errno(err, "opening a pseudo terminal");
    cfmakeraw(&t);
    return tcsetattr(*master, TCSANOW, &t) == 0 || fail_errno(err, "setting up a pseudo terminal");
}

static char **with_variable(const char *variable)
{
    size_t count = 0;
    while (environ[count])
        count++;
    char **all = calloc(count + 2, sizeof *all);
    if (!all)
        return NULL;
    memcpy(all, environ, count * sizeof *all);
    all[count] = (char *)variable;
    return all;
}

// A session leader without a terminal gets the first one that it opens.
static int spawn(pid_t *pid, const char *terminal, const char *const argv[], char **variables)
{
    posix_spawn_file_actions_t files;
    posix_spawnattr_t how;
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, terminal, O_RDWR, 0);
    posix_spawn_file_actions_adddup2(&files, 0, 1);
    posix_spawn_file_actions_adddup2(&files, 0, 2);
    posix_spawnattr_init(&how);
    posix_spawnattr_setflags(&how,
                             POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setsigmask(&how, &none);
    posix_spawnattr_setsigdefault(&how, &all);
    int code = posix_spawnp(pid, argv[0], &files, &how, (char *const *)argv, variables);
    posix_spawnattr_destroy(&how);
    posix_spawn_file_actions_destroy(&files);
    return code;
}

bool child_start(struct child *c, const char *const argv[], const char *variable, struct error *err)
{
    char terminal[64];
    *c = (struct child){.fd = -1};
    snprintf(c->name, sizeof c->name, "%s", argv[0]);
    char **variables = with_variable(variable);
    if (!variables)
        return fail_errno(err, "%s", c->name);
    bool ok = open_terminal(&c->fd, terminal, sizeof terminal, err);
    int code = ok ? spawn(&c->pid, terminal, argv, variables) : 0;
    free(variables);
    if (ok && !code)
        return true;
    c->pid = 0;
    child_end(c);
    if (!ok)
        return false;
    return fail(err, code == ENOENT || code == EACCES ? ERROR_CONFIG : ERROR_SYSTEM,
                "%s cannot be run: %s", c->name, strerror(code));
}

// True when the child has ended within wait_ms; then it is no more.
static bool has_ended(struct child *c, int wait_ms, int *status)
{
    int64_t until = clock_now_ns() + wait_ms * NS_PER_MS;
    for (;;) {
        pid_t ended = waitpid(c->pid, status, WNOHANG);
        if (ended == c->pid || (ended < 0 && errno == ECHILD)) {
            c->pid = 0;
            return true;
        }
        if (clock_now_ns() >= until)
            return false;
        poll(NULL, 0, LOOK_MS);
    }
}

void child_end(struct child *c)
{
    int status;
    if (c->fd >= 0)
        close(c->fd);
    c->fd = -1;
    if (c->pid > 0)
        kill(c->pid, SIGTERM);
    if (c->pid > 0 && !has_ended(c, END_MS, &status)) {
        kill(c->pid, SIGKILL);
        has_ended(c, KILL_MS, &status);
    }
    c->pid = 0;
}

static bool gone(struct child *c, struct error *err)
{
    int status = 0;
    if (c->pid > 0 && !has_ended(c, END_MS, &status))
        return fail(err, ERROR_GONE, "%s closed its terminal", c->name);
    if (WIFSIGNALED(status))
        return fail(err, ERROR_GONE, "%s was ended by signal %d", c->name, WTERMSIG(status));
    return fail(err, ERROR_GONE, "%s ended with %d", c->name, WEXITSTATUS(status));
}

// *came tells whether bytes were added.
static bool take(struct child *c, int wait_ms, bool *came, struct error *err)
{
    struct pollfd p = {.fd = c->fd, .events = POLLIN};
    *came = false;
    if (c->fd < 0)
        return fail(err, ERROR_GONE, "%s is not running", c->name);
    if (poll(&p, 1, wait_ms) <= 0)
        return true;
    ssize_t count = read(c->fd, c->pending + c->used, sizeof c->pending - c->used);
    if (count > 0)
        c->used += (size_t)count;
    *came = count > 0;
    return count > 0 || (count < 0 && (errno == EAGAIN || errno == EINTR)) || gone(c, err);
}

static void copy(char *text, size_t size, const char *from, size_t count)
{
    size_t n = 0;
    for (; n < count && n + 1 < size; n++)
        text[n] = from[n] >= ' ' && from[n] <= '~' ? from[n] : '?';
    text[n] = 0;
}

static bool next_line(struct child *c, char *text, size_t size)
{
    size_t skip = 0, end;
    while (skip < c->used && strchr("\r\n", c->pending[skip]))
        skip++;
    for (end = skip; end < c->used; end++)
        if (c->pending[end] == '\r' || c->pending[end] == '\n')
            break;
    bool whole = end < c->used;
    if (whole)
        copy(text, size, c->pending + skip, end - skip);
    size_t drop = whole ? end : skip;
    c->used -= drop;
    c->shown = whole || drop > c->shown ? 0 : c->shown - drop;
    memmove(c->pending, c->pending + drop, c->used);
    return whole;
}

bool child_line(struct child *c, char *text, size_t size, int wait_ms, int64_t deadline_ns,
                bool *whole, struct error *err)
{
    int64_t until = clock_now_ns() + wait_ms * NS_PER_MS;
    if (until > deadline_ns)
        until = deadline_ns;
    *whole = true;
    while (!next_line(c, text, size)) {
        bool came, fresh = c->used > c->shown;
        int wait = deadline_ms(until, fresh && wait_ms > LOOK_MS ? LOOK_MS : wait_ms);
        if (c->used == sizeof c->pending)
            return fail(err, ERROR_DATA, "%s: a line without an end", c->name);
        if (!take(c, wait, &came, err))
            return false;
        if (came)
            continue;
        if (fresh) {
            *whole = false;
            copy(text, size, c->pending, c->used);
            c->shown = c->used;
            return true;
        }
        if (deadline_ms(until, 1) <= 0)
            return fail(err, ERROR_RETRY, "%s says nothing", c->name);
    }
    return true;
}

void child_forget(struct child *c)
{
    c->used = c->shown = 0;
}

bool child_write(struct child *c, char byte, int64_t deadline_ns, struct error *err)
{
    while (c->fd >= 0) {
        struct pollfd p = {.fd = c->fd, .events = POLLOUT};
        ssize_t count = write(c->fd, &byte, 1);
        if (count == 1)
            return true;
        if (count < 0 && errno != EAGAIN && errno != EINTR)
            return gone(c, err);
        int wait = deadline_ms(deadline_ns, 1000);
        if (wait <= 0)
            return fail(err, ERROR_RETRY, "%s takes no key", c->name);
        poll(&p, 1, wait);
    }
    return fail(err, ERROR_GONE, "%s is not running", c->name);
}
