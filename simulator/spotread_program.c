// SPDX-License-Identifier: Apache-2.0
#include "simulator/spotread_program.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/spotread_link.h"

enum { POLL_MS = 200, NONE = -1, HUNG_UP = -2, KEYS_AT_ONCE = 3, LINE_SIZE = 500 };

struct desk {
    struct spotread *program;
    struct control_client *booth; // NULL = it has gone
    bool interactive;
    double hurry;
};

// Each key is read in a mode of its own, and the terminal put back after it, as spotread does:
// what is typed in between is echoed.
static bool enter_key_mode(const struct desk *d, struct termios *before)
{
    if (!d->interactive)
        return false;
    if (tcgetattr(STDIN_FILENO, before) < 0) {
        fprintf(stderr, "spotread: Warning - tcgetattr failed with '%s' on stdin\n",
                strerror(errno));
        return false;
    }
    struct termios now = *before;
    now.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
    now.c_cc[VTIME] = 0;
    now.c_cc[VMIN] = 1;
    tcsetattr(STDIN_FILENO, TCSANOW, &now);
    return true;
}

// The first of what was typed; the rest of three is lost.
static int key_within(const struct desk *d, int timeout_ms)
{
    struct termios before;
    bool changed = enter_key_mode(d, &before);
    struct pollfd wait = {.fd = STDIN_FILENO, .events = POLLIN | POLLPRI};
    unsigned char keys[KEYS_AT_ONCE];
    int key = NONE;
    if (poll(&wait, 1, timeout_ms) > 0)
        key = read(STDIN_FILENO, keys, sizeof(keys)) > 0 ? keys[0] : HUNG_UP;
    if (changed)
        tcsetattr(STDIN_FILENO, TCSANOW, &before);
    return key;
}

static int awaited_key(const struct desk *d, bool fresh)
{
    int key = NONE;
    if (fresh)
        tcflush(STDIN_FILENO, TCIFLUSH);
    while (key == NONE)
        key = key_within(d, -1);
    return key;
}

// False when there is none yet.
static bool give_key(struct desk *d, enum spotread_want want, int *key)
{
    *key = want == SPOTREAD_KEY ? key_within(d, 0) : awaited_key(d, want == SPOTREAD_FRESH_KEY);
    if (*key >= 0)
        spotread_key(d->program, clock_now_ns(), *key);
    else if (*key == NONE)
        clock_sleep_until_ns(clock_now_ns() + (int64_t)(POLL_MS / d->hurry * NS_PER_MS));
    return *key != HUNG_UP;
}

static bool give_line(struct desk *d)
{
    char line[LINE_SIZE];
    if (!fgets(line, sizeof(line), stdin))
        return false;
    line[strcspn(line, "\r\n")] = '\0';
    spotread_line(d->program, clock_now_ns(), line);
    return true;
}

static void give_sight(struct desk *d)
{
    struct spotread_sight sight = {.trouble = SPOTREAD_GONE};
    if (d->booth && !spotread_look(d->booth, NULL, &sight, NULL)) {
        control_close(d->booth);
        d->booth = NULL;
        sight.trouble = SPOTREAD_GONE;
    }
    spotread_sight(d->program, clock_now_ns(), &sight);
}

static void give_time(struct desk *d, int64_t until_ns)
{
    clock_sleep_until_ns(until_ns);
    spotread_time(d->program, clock_now_ns());
}

// False when it cannot go on.
static bool serve(struct desk *d)
{
    int64_t until_ns;
    int key;
    enum spotread_want want = spotread_wants(d->program, clock_now_ns(), &until_ns);
    switch (want) {
    case SPOTREAD_KEY:
    case SPOTREAD_NEXT_KEY:
    case SPOTREAD_FRESH_KEY:
        return give_key(d, want, &key);
    case SPOTREAD_LINE:
        return give_line(d);
    case SPOTREAD_SIGHT:
        give_sight(d);
        return true;
    case SPOTREAD_TIME:
        give_time(d, until_ns);
        return true;
    case SPOTREAD_END:
        break;
    }
    return false;
}

static void tell(struct spotread *program)
{
    if (spotread_drops_keys(program))
        tcflush(STDIN_FILENO, TCIFLUSH);
    fputs(spotread_err(program), stderr);
    fputs(spotread_out(program), stdout);
    fflush(stdout);
}

int spotread_run(const char *socket, bool interactive, int argc, char **argv)
{
    struct spotread_settings settings = {.hurry = 1, .lapses = {0, 1}};
    struct spotread_sight sight;
    struct desk desk = {.booth = control_connect(socket, NULL), .interactive = interactive};
    if (desk.booth)
        spotread_look(desk.booth, &settings, &sight, NULL);
    desk.hurry = settings.hurry;
    desk.program = spotread_create(&settings, argc, argv);
    if (!desk.program)
        return 1;
    do
        tell(desk.program);
    while (serve(&desk));
    tell(desk.program);
    int status = spotread_status(desk.program);
    spotread_destroy(desk.program);
    control_close(desk.booth);
    return status;
}
