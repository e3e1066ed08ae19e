// SPDX-License-Identifier: Apache-2.0
// A program under test as a process of its own. Include after cmocka.h.
#ifndef TESTS_WHOLE_RUNNING_H
#define TESTS_WHOLE_RUNNING_H

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/control.h"

// Bounds a hang only; nothing is measured against it.
enum { RUNNING_PATIENCE_S = 60 };

extern char **environ;

// "$BUILD/name", the build that the tests belong to.
static inline const char *program_path(const char *name)
{
    static char paths[4][512];
    static int turn;
    char *path = paths[turn++ % 4];
    const char *build = getenv("BUILD");
    snprintf(path, sizeof *paths, "%s/%s", build ? build : "build", name);
    return path;
}

// Starts argv[0] with standard output and error into the file `words`.
static inline pid_t start_program(const char *const argv[], const char *words)
{
    pid_t pid = -1;
    posix_spawn_file_actions_t to;
    posix_spawn_file_actions_init(&to);
    posix_spawn_file_actions_addopen(&to, 1, words, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&to, 1, 2);
    assert_int_equal(posix_spawn(&pid, argv[0], &to, NULL, (char *const *)argv, environ), 0);
    posix_spawn_file_actions_destroy(&to);
    return pid;
}

// Exit status of a started program; -signal when one ended it.
static inline int await_program(pid_t pid)
{
    int status = 0;
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    while (waitpid(pid, &status, WNOHANG) == 0) {
        if (clock_now_ns() > until_ns)
            kill(pid, SIGKILL);
        clock_sleep_until_ns(clock_now_ns() + 5 * NS_PER_MS);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

static inline int run_program(const char *const argv[], const char *words)
{
    return await_program(start_program(argv, words));
}

static inline bool program_lives(pid_t pid)
{
    return kill(pid, 0) == 0 && waitpid(pid, NULL, WNOHANG) == 0;
}

// A text file's content, at most size - 1 bytes.
static inline const char *read_words(const char *path, char *out, size_t size)
{
    FILE *file = fopen(path, "r");
    size_t count = file ? fread(out, 1, size - 1, file) : 0;
    if (file)
        fclose(file);
    out[count] = 0;
    return out;
}

// Connects as soon as somebody listens; NULL when the program ends before.
static inline struct control_client *connect_to(const char *socket, pid_t pid)
{
    struct control_client *client = NULL;
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    while (!(client = control_connect(socket, NULL)) && clock_now_ns() < until_ns &&
           program_lives(pid))
        clock_sleep_until_ns(clock_now_ns() + 10 * NS_PER_MS);
    return client;
}

#endif
