// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_tcp.h"

#include <arpa/inet.h>
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "files/write.h"

enum { DEAD_MOST = 16, BACKLOG = 8 };

struct tcp_end {
    int port;
    char port_path[512];
    struct line_end end;
    int listener, connection, alarm;
    int dead[DEAD_MOST], dead_count; // left half open

    pthread_mutex_t lock;
    pthread_t thread;
    bool running, stopping;
    enum wire_fault fault;
};

static void ring(struct tcp_end *t)
{
    uint64_t one = 1;
    while (write(t->alarm, &one, sizeof(one)) < 0)
        continue; // interrupted
}

static void shut(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

static void leave_for_dead(struct tcp_end *t, int fd)
{
    if (t->dead_count == DEAD_MOST) {
        close(t->dead[0]);
        memmove(t->dead, t->dead + 1, sizeof(t->dead) - sizeof(t->dead[0]));
        t->dead_count--;
    }
    t->dead[t->dead_count++] = fd;
}

static void take_connection(struct tcp_end *t, enum wire_fault fault)
{
    int fd = accept4(t->listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd >= 0 && fault == WIRE_HALF_OPEN) {
        leave_for_dead(t, fd);
    } else if (fd >= 0) {
        shut(&t->connection);
        t->connection = fd;
        t->end.plugged(t->end.context, fd);
    }
}

static bool hung_up(int fd)
{
    char byte;
    ssize_t size = recv(fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    return size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR);
}

static int64_t serve(struct tcp_end *t, bool readable, enum wire_fault fault)
{
    if (t->connection >= 0 && fault == WIRE_HALF_OPEN) {
        leave_for_dead(t, t->connection);
        t->connection = -1;
    }
    if (t->connection >= 0 && readable && hung_up(t->connection))
        shut(&t->connection);
    if (t->connection < 0)
        return INT64_MAX;
    return t->end.serve(t->end.context, t->connection, readable, fault);
}

static struct timespec until(int64_t at_ns)
{
    int64_t left_ns = at_ns - clock_now_ns();
    left_ns = left_ns > 0 ? left_ns : 0;
    return (struct timespec){.tv_sec = (time_t)(left_ns / NS_PER_S),
                             .tv_nsec = (long)(left_ns % NS_PER_S)};
}

static void *run(void *argument)
{
    struct tcp_end *t = argument;
    int64_t again_ns = INT64_MAX;
    for (;;) {
        struct pollfd fds[3] = {{.fd = t->alarm, .events = POLLIN},
                                {.fd = t->listener, .events = POLLIN},
                                {.fd = t->connection, .events = POLLIN}};
        if (again_ns != INT64_MAX)
            fds[2].fd = -1; // busy with a request: what comes waits
        struct timespec left = until(again_ns);
        ppoll(fds, 3, again_ns == INT64_MAX ? NULL : &left, NULL);
        uint64_t count;
        if (fds[0].revents && read(t->alarm, &count, sizeof(count)) < 0)
            continue;
        pthread_mutex_lock(&t->lock);
        bool stopping = t->stopping;
        enum wire_fault fault = t->fault;
        pthread_mutex_unlock(&t->lock);
        if (stopping)
            return NULL;
        bool fresh = fds[1].revents & POLLIN;
        if (fresh)
            take_connection(t, fault);
        again_ns = serve(t, !fresh && fds[2].revents, fault);
    }
}

struct tcp_end *tcp_create(int port, const char *port_path, const struct line_end *end,
                           struct error *err)
{
    struct tcp_end *t = calloc(1, sizeof(*t));
    if (!t) {
        fail(err, ERROR_SYSTEM, "out of memory");
        return NULL;
    }
    t->port = port;
    t->end = *end;
    t->listener = t->connection = -1;
    snprintf(t->port_path, sizeof(t->port_path), "%s", port_path);
    pthread_mutex_init(&t->lock, NULL);
    t->alarm = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (t->alarm >= 0)
        return t;
    fail_errno(err, "eventfd");
    tcp_destroy(t);
    return NULL;
}

static bool listen_at_port(struct tcp_end *t, struct error *err)
{
    struct sockaddr_in at = {.sin_family = AF_INET,
                             .sin_port = htons((uint16_t)t->port),
                             .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof(at);
    int yes = 1;
    t->listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (t->listener < 0 ||
        setsockopt(t->listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes)) != 0 ||
        bind(t->listener, (struct sockaddr *)&at, sizeof(at)) != 0 ||
        listen(t->listener, BACKLOG) != 0 ||
        getsockname(t->listener, (struct sockaddr *)&at, &size) != 0)
        return fail_errno(err, "listening at 127.0.0.1:%d", t->port);
    t->port = ntohs(at.sin_port);
    return true;
}

static bool write_port(const struct tcp_end *t, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, t->port_path, err))
        return false;
    fprintf(file.stream, "%d\n", t->port);
    return whole_file_commit(&file, err);
}

bool tcp_plug(struct tcp_end *tcp, struct error *err)
{
    struct tcp_end *t = tcp;
    if (t->running)
        return true;
    if (!listen_at_port(t, err) || !write_port(t, err)) {
        shut(&t->listener);
        return false;
    }
    t->stopping = false;
    t->running = pthread_create(&t->thread, NULL, run, t) == 0;
    if (!t->running)
        shut(&t->listener);
    return t->running || fail(err, ERROR_SYSTEM, "starting a thread");
}

bool tcp_is_plugged(const struct tcp_end *tcp)
{
    return tcp->running;
}

void tcp_unplug(struct tcp_end *tcp)
{
    struct tcp_end *t = tcp;
    if (!t->running)
        return;
    pthread_mutex_lock(&t->lock);
    t->stopping = true;
    pthread_mutex_unlock(&t->lock);
    ring(t);
    pthread_join(t->thread, NULL);
    t->running = false;
    shut(&t->listener);
    shut(&t->connection);
    while (t->dead_count > 0)
        close(t->dead[--t->dead_count]);
}

void tcp_set_fault(struct tcp_end *tcp, enum wire_fault fault)
{
    pthread_mutex_lock(&tcp->lock);
    tcp->fault = fault;
    pthread_mutex_unlock(&tcp->lock);
    ring(tcp);
}

void tcp_destroy(struct tcp_end *tcp)
{
    if (!tcp)
        return;
    tcp_unplug(tcp);
    shut(&tcp->alarm);
    pthread_mutex_destroy(&tcp->lock);
    free(tcp);
}
