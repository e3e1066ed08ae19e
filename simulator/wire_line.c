// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_line.h"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/wire_node.h"

struct line {
    char path[512];
    struct line_end end;
    struct node node;
    int alarm; // written to make the thread look up
    bool plugged;

    pthread_mutex_t lock;
    pthread_t thread;
    bool running, stopping;
    enum wire_fault fault;
};

static void ring(struct line *line)
{
    uint64_t one = 1;
    while (write(line->alarm, &one, sizeof(one)) < 0)
        continue; // interrupted
}

static void hush(struct line *line)
{
    uint64_t count;
    while (read(line->alarm, &count, sizeof(count)) > 0)
        continue;
}

static int wait_for(struct line *line, int fd, int64_t until_ns)
{
    struct pollfd fds[2] = {{.fd = line->alarm, .events = POLLIN}, {.fd = fd, .events = POLLIN}};
    int64_t left_ns = until_ns == INT64_MAX ? 0 : until_ns - clock_now_ns();
    left_ns = left_ns > 0 ? left_ns : 0;
    struct timespec left = {.tv_sec = (time_t)(left_ns / NS_PER_S),
                            .tv_nsec = (long)(left_ns % NS_PER_S)};
    ppoll(fds, 2, until_ns == INT64_MAX ? NULL : &left, NULL);
    if (fds[0].revents)
        hush(line);
    return fds[1].revents & POLLIN;
}

static void *run(void *argument)
{
    struct line *line = argument;
    int64_t again_ns = INT64_MAX;
    for (;;) {
        bool readable = wait_for(line, line->node.master, again_ns);
        pthread_mutex_lock(&line->lock);
        bool stopping = line->stopping;
        enum wire_fault fault = line->fault;
        pthread_mutex_unlock(&line->lock);
        if (stopping)
            return NULL;
        again_ns = line->end.serve(line->end.context, line->node.master, readable, fault);
    }
}

struct line *line_create(const char *path, const struct line_end *end, struct error *err)
{
    struct line *line = calloc(1, sizeof(*line));
    if (!line) {
        fail(err, ERROR_SYSTEM, "out of memory");
        return NULL;
    }
    snprintf(line->path, sizeof(line->path), "%s", path);
    line->end = *end;
    line->node.master = line->node.slave = -1;
    pthread_mutex_init(&line->lock, NULL);
    line->alarm = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (line->alarm >= 0)
        return line;
    fail_errno(err, "eventfd");
    line_destroy(line);
    return NULL;
}

bool line_plug(struct line *line, struct error *err)
{
    if (line->plugged)
        return true;
    if (!node_open(&line->node, err))
        return false;
    fcntl(line->node.master, F_SETFL, O_NONBLOCK);
    line->end.plugged(line->end.context, line->node.master);
    line->stopping = false;
    line->running = pthread_create(&line->thread, NULL, run, line) == 0;
    line->plugged = true;
    if (line->running && node_link(&line->node, line->path, err))
        return true;
    if (!line->running)
        fail(err, ERROR_SYSTEM, "starting a thread");
    line_unplug(line);
    return false;
}

bool line_is_plugged(const struct line *line)
{
    return line->plugged;
}

void line_unplug(struct line *line)
{
    if (!line->plugged)
        return;
    unlink(line->path); // before anybody is told of a hang-up
    pthread_mutex_lock(&line->lock);
    line->stopping = true;
    pthread_mutex_unlock(&line->lock);
    ring(line);
    if (line->running)
        pthread_join(line->thread, NULL);
    line->running = line->plugged = false;
    node_close(&line->node);
}

void line_set_fault(struct line *line, enum wire_fault fault)
{
    pthread_mutex_lock(&line->lock);
    line->fault = fault;
    pthread_mutex_unlock(&line->lock);
    node_forbid(&line->node, fault == WIRE_FORBIDDEN);
    ring(line);
}

void line_destroy(struct line *line)
{
    if (!line)
        return;
    line_unplug(line);
    if (line->alarm >= 0)
        close(line->alarm);
    pthread_mutex_destroy(&line->lock);
    free(line);
}
