// SPDX-License-Identifier: Apache-2.0
#include "simulator/boothsim_children.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"

enum { POLL_MS = 20, EXIT_NO_COMMAND = 127 };

static void become_xvfb(const struct scenario *scenario, const char *run_dir, int ready, int words)
{
    char screen[64], number[16];
    snprintf(screen, sizeof screen, "%dx%dx%d", scenario->screen.width_px,
             scenario->screen.height_px, scenario->panel.bits == 10 ? 30 : 24);
    snprintf(number, sizeof number, "%d", ready);
    setpgid(0, 0); // a terminal's Ctrl-C is for the command
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    unsetenv("LD_PRELOAD");
    unsetenv("UMOCKDEV_DIR");
    dup2(words, STDOUT_FILENO);
    dup2(words, STDERR_FILENO);
    execlp("Xvfb", "Xvfb", "-displayfd", number, "-screen", "0", screen, "-fbdir", run_dir,
           "-nolisten", "tcp", "-nocursor", "-noreset", "-s", "0", (char *)NULL);
    dprintf(words, "Xvfb: %s\n", strerror(errno));
    _exit(EXIT_NO_COMMAND);
}

static bool wait_ready(struct child *xvfb, int ready, int64_t deadline_ns, int *display,
                       struct error *err)
{
    char text[16] = "";
    size_t used = 0;
    while (!strchr(text, '\n') && used < sizeof text - 1) {
        if (clock_now_ns() > deadline_ns)
            return fail(err, ERROR_SYSTEM, "Xvfb is not ready in time");
        struct pollfd wait = {.fd = ready, .events = POLLIN};
        if (poll(&wait, 1, POLL_MS) <= 0)
            continue;
        ssize_t got = read(ready, text + used, sizeof text - 1 - used);
        if (got > 0)
            used += (size_t)got;
        else if (got == 0) {
            child_has_ended(xvfb);
            return fail(err, ERROR_SYSTEM, "Xvfb did not start");
        }
    }
    *display = atoi(text);
    return true;
}

bool child_start_xvfb(const struct scenario *scenario, const char *run_dir, int64_t deadline_ns,
                      struct child *out, int *display, struct error *err)
{
    char log[1024];
    snprintf(log, sizeof log, "%s/Xvfb_screen0", run_dir);
    unlink(log);
    snprintf(log, sizeof log, "%s/xvfb.log", run_dir);
    int words = open(log, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644), ready[2];
    if (words < 0)
        return fail_errno(err, "writing %s", log);
    if (pipe2(ready, O_CLOEXEC) < 0) {
        close(words);
        return fail_errno(err, "making a pipe");
    }
    *out = (struct child){.pid = fork()};
    if (out->pid == 0) {
        fcntl(ready[1], F_SETFD, 0);
        become_xvfb(scenario, run_dir, ready[1], words);
    }
    close(ready[1]);
    close(words);
    bool good = out->pid > 0 ? wait_ready(out, ready[0], deadline_ns, display, err)
                             : fail_errno(err, "starting Xvfb");
    close(ready[0]);
    if (!good) {
        child_stop(out, clock_now_ns() + NS_PER_S);
        return while_doing(err, "see %s", log);
    }
    return true;
}

bool child_start_command(char **argv, int display, struct child *out, struct error *err)
{
    char name[32];
    snprintf(name, sizeof name, ":%d", display);
    *out = (struct child){.pid = fork()};
    if (out->pid < 0)
        return fail_errno(err, "starting %s", argv[0]);
    if (out->pid > 0)
        return true;
    if (display >= 0)
        setenv("DISPLAY", name, 1);
    else
        unsetenv("DISPLAY");
    unsetenv("XAUTHORITY");
    unsetenv("WAYLAND_DISPLAY");
    signal(SIGPIPE, SIG_DFL);
    execvp(argv[0], argv);
    dprintf(STDERR_FILENO, "boothsim: %s: %s\n", argv[0], strerror(errno));
    _exit(errno == ENOENT ? EXIT_NO_COMMAND : EXIT_NO_COMMAND - 1);
}

bool child_has_ended(struct child *child)
{
    int status;
    if (child->pid <= 0)
        return true;
    if (!child->ended && waitpid(child->pid, &status, WNOHANG) == child->pid) {
        child->ended = true;
        child->status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    return child->ended;
}

void child_signal(struct child *child, int signal)
{
    if (!child_has_ended(child))
        kill(child->pid, signal);
}

void child_stop(struct child *child, int64_t deadline_ns)
{
    child_signal(child, SIGTERM);
    while (!child_has_ended(child)) {
        if (clock_now_ns() > deadline_ns)
            child_signal(child, SIGKILL);
        poll(NULL, 0, POLL_MS);
    }
}
