// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/control.h"
#include "base/control_wire.h"

enum {
    CLIENTS_MOST = 16,
    LOCK_TRIES = 8,
    REST_MS = 100,
    LOCK_PATH = sizeof((struct sockaddr_un *)0)->sun_path + sizeof ".lock"
};

static const int64_t IDLE_NS = 10 * NS_PER_S;

// Error texts may quote a peer's bytes; JSON takes UTF-8 only.
static json_t *json_text(const char *text)
{
    json_t *string = json_string(text);
    if (string)
        return string;
    char plain[sizeof((struct error *)0)->text];
    size_t i = 0;
    for (; text[i] && i < sizeof plain - 1; i++)
        plain[i] = text[i] >= ' ' && text[i] <= '~' ? text[i] : '?';
    plain[i] = 0;
    return json_string(plain);
}

// At most one reply waits per client; while it does, the
// client's further lines wait too, so that one who never reads costs nothing.

struct caller {
    int fd; // -1 = free
    bool ended;
    bool answered;    // late: lines that came meanwhile are to be looked at
    uint64_t awaited; // ticket of the answer to come, 0 = none
    int64_t moved_ns; // when it last came, asked or was answered
    struct control_bytes in, out;
};

struct control_server {
    int fd;
    bool resting;    // accept failed: leave the queue alone for one round
    int64_t idle_ns; // after which a place may be taken from its client
    bool crowded;    // the last round ended with every place taken and somebody waiting
    struct sockaddr_un address;
    dev_t device;
    ino_t inode;
    uint64_t tickets;
    struct caller *asking; // whose request is being handled
    struct caller callers[CLIENTS_MOST];
};

static void hang_up(struct caller *caller)
{
    if (caller->fd >= 0)
        close(caller->fd);
    free(caller->in.text);
    free(caller->out.text);
    *caller = (struct caller){.fd = -1};
}

static bool clear_stale(const struct sockaddr_un *address, struct error *err)
{
    const char *path = address->sun_path;
    struct stat there;
    if (lstat(path, &there))
        return errno == ENOENT || fail_errno(err, "%s", path);
    if (!S_ISSOCK(there.st_mode))
        return fail(err, ERROR_CONFIG, "%s: is there and is no socket", path);
    int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    bool stale =
        connect(probe, (const struct sockaddr *)address, sizeof *address) && errno == ECONNREFUSED;
    close(probe);
    if (!stale)
        return fail(err, ERROR_CONFIG, "%s: somebody already listens there", path);
    return !unlink(path) || fail_errno(err, "%s: cannot be replaced", path);
}

// Holds PATH.lock while the socket is looked at and made, so that of two
// servers that start at once one sees the other. The file goes with the lock;
// who waited for one that is gone by then begins again. -1 with err.
static int lock_path(const char *path, char lock[LOCK_PATH], struct error *err)
{
    struct stat held, there;
    snprintf(lock, LOCK_PATH, "%s.lock", path);
    for (int i = 0; i < LOCK_TRIES; i++) {
        int fd = open(lock, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (fd < 0) {
            fail(err, errno == ENOENT ? ERROR_CONFIG : ERROR_SYSTEM, "%s: cannot listen: %s", path,
                 strerror(errno));
            return -1;
        }
        if (flock(fd, LOCK_EX | LOCK_NB)) {
            close(fd);
            fail(err, ERROR_CONFIG, "%s: somebody else begins to listen there", path);
            return -1;
        }
        if (!fstat(fd, &held) && !lstat(lock, &there) && held.st_ino == there.st_ino &&
            held.st_dev == there.st_dev)
            return fd;
        close(fd);
    }
    fail(err, ERROR_RETRY, "%s: others begin to listen there again and again", path);
    return -1;
}

static bool make_socket(struct control_server *server, struct error *err)
{
    const char *path = server->address.sun_path;
    if (!clear_stale(&server->address, err))
        return false;
    server->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    // Linux creates the socket file with the mode of the socket itself, so
    // nobody else can connect at any moment.
    if (server->fd < 0 || fchmod(server->fd, 0600) ||
        bind(server->fd, (struct sockaddr *)&server->address, sizeof server->address))
        return fail_errno(err, "%s: cannot listen", path);
    struct stat there;
    if (listen(server->fd, CLIENTS_MOST) || stat(path, &there))
        return fail_errno(err, "%s: cannot listen", path);
    server->device = there.st_dev;
    server->inode = there.st_ino;
    return true;
}

static bool open_server(struct control_server *server, struct error *err)
{
    char lock[LOCK_PATH];
    int held = lock_path(server->address.sun_path, lock, err);
    if (held < 0)
        return false;
    bool fine = make_socket(server, err);
    unlink(lock);
    close(held);
    return fine;
}

struct control_server *control_listen(const char *path, struct error *err)
{
    struct sockaddr_un address;
    if (!control_address(path, &address, err))
        return NULL;
    struct control_server *server = calloc(1, sizeof *server);
    if (!server) {
        fail_errno(err, "%s", path);
        return NULL;
    }
    *server = (struct control_server){.fd = -1, .idle_ns = IDLE_NS, .address = address};
    for (int i = 0; i < CLIENTS_MOST; i++)
        server->callers[i].fd = -1;
    if (open_server(server, err))
        return server;
    control_unlisten(server);
    return NULL;
}

void control_unlisten(struct control_server *server)
{
    if (!server)
        return;
    for (int i = 0; i < CLIENTS_MOST; i++)
        hang_up(&server->callers[i]);
    struct stat there;
    if (server->inode && !lstat(server->address.sun_path, &there) &&
        there.st_dev == server->device && there.st_ino == server->inode)
        unlink(server->address.sun_path);
    if (server->fd >= 0)
        close(server->fd);
    free(server);
}

static json_t *refusal(const struct error *err)
{
    bool filled = err && err->code != ERROR_NONE;
    return json_pack("{s:b, s:s, s:o}", "ok", 0, "code",
                     error_code_name(filled ? err->code : ERROR_SYSTEM), "error",
                     json_text(filled ? err->text : "no answer"));
}

static json_t *answer(const char *line, size_t size, control_handler *handle, void *context)
{
    struct error err = {0};
    json_error_t fault;
    json_t *request = json_loadb(line, size, JSON_REJECT_DUPLICATES, &fault), *reply = NULL;
    const char *what = json_string_value(json_object_get(request, "do"));
    if (!request)
        fail(&err, ERROR_DATA, "not JSON: %s", fault.text);
    else if (!what)
        fail(&err, ERROR_DATA, "a request must be an object with a text \"do\"");
    else
        reply = handle(context, what, request, &err);
    json_decref(request);
    if (reply && !json_object_set_new(reply, "ok", json_true()))
        return reply;
    json_decref(reply);
    return refusal(&err);
}

static bool queue_reply(struct caller *caller, json_t *reply)
{
    char *text = reply ? json_dumps(reply, JSON_COMPACT) : NULL;
    json_decref(reply);
    size_t size = text ? strlen(text) : 0;
    bool ok = text && control_bytes_reserve(&caller->out, size + 1);
    if (ok) {
        memcpy(caller->out.text + caller->out.used, text, size);
        caller->out.text[caller->out.used + size] = '\n';
        caller->out.used += size + 1;
    }
    free(text);
    return ok;
}

// False when the peer is gone.
static bool flush(struct caller *caller)
{
    size_t sent = 0;
    bool ok = true;
    while (ok && sent < caller->out.used) {
        ssize_t n = send(caller->fd, caller->out.text + sent, caller->out.used - sent,
                         MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n > 0)
            sent += n;
        else if (errno == EAGAIN || errno == EWOULDBLOCK)
            break;
        else
            ok = errno == EINTR;
    }
    if (sent) {
        control_bytes_drop(&caller->out, sent);
        caller->moved_ns = clock_now_ns();
    }
    return ok;
}

static bool read_more(struct caller *caller)
{
    if (!control_bytes_reserve(&caller->in, CONTROL_CHUNK))
        return false;
    ssize_t n = recv(caller->fd, caller->in.text + caller->in.used, CONTROL_CHUNK, MSG_DONTWAIT);
    if (n > 0) {
        caller->in.used += n;
        caller->moved_ns = clock_now_ns();
    }
    caller->ended = !n;
    return n >= 0 || errno == EAGAIN || errno == EINTR;
}

// Answers lines until one reply has to wait. False to hang up.
static bool answer_lines(struct control_server *server, struct caller *caller,
                         control_handler *handle, void *context)
{
    size_t done = 0;
    bool ok = flush(caller);
    while (ok && !caller->awaited && !caller->out.used && done < caller->in.used) {
        char *line = caller->in.text + done;
        char *end = memchr(line, '\n', caller->in.used - done);
        size_t size = end ? (size_t)(end - line) : caller->in.used - done;
        if (size > CONTROL_LINE_MOST)
            ok = false;
        if (!end || !ok)
            break;
        server->asking = caller;
        json_t *reply = answer(line, size, handle, context);
        server->asking = NULL;
        done += size + 1;
        if (caller->awaited || caller->answered)
            json_decref(reply);
        else
            ok = queue_reply(caller, reply) && flush(caller);
        caller->answered = false;
    }
    if (done)
        control_bytes_drop(&caller->in, done);
    return ok && !(caller->ended && !caller->out.used && !caller->awaited);
}

uint64_t control_later(struct control_server *server)
{
    if (!server->asking)
        return 0;
    return server->asking->awaited = ++server->tickets;
}

void control_answer(struct control_server *server, uint64_t ticket, json_t *reply,
                    const struct error *err)
{
    struct caller *caller = NULL;
    for (int i = 0; ticket && i < CLIENTS_MOST; i++)
        if (server->callers[i].awaited == ticket)
            caller = &server->callers[i];
    if (!caller) {
        json_decref(reply);
        return;
    }
    caller->awaited = 0;
    caller->answered = true;
    caller->moved_ns = clock_now_ns();
    if (reply && json_object_set_new(reply, "ok", json_true())) {
        json_decref(reply);
        reply = NULL;
    }
    // Nobody is hung up here: this may run inside that client's own handler.
    if (!queue_reply(caller, reply ? reply : refusal(err)) || !flush(caller))
        caller->ended = true;
}

static void turn_away(int fd)
{
    static const char BUSY[] = "{\"ok\":false,\"code\":\"retry\",\"error\":\"too many clients\"}\n";
    send(fd, BUSY, sizeof BUSY - 1, MSG_NOSIGNAL | MSG_DONTWAIT);
    close(fd);
}

void control_idle_after(struct control_server *server, int64_t idle_ns)
{
    server->idle_ns = idle_ns;
}

static struct caller *free_place(struct control_server *server)
{
    for (int i = 0; i < CLIENTS_MOST; i++)
        if (server->callers[i].fd < 0)
            return &server->callers[i];
    return NULL;
}

// The place of who has been idle longest, when that is too long; or NULL.
static struct caller *idle_place(struct control_server *server)
{
    struct caller *idle = NULL;
    for (int i = 0; i < CLIENTS_MOST; i++) {
        struct caller *caller = &server->callers[i];
        if (!caller->awaited && (!idle || caller->moved_ns < idle->moved_ns))
            idle = caller;
    }
    if (!idle || clock_now_ns() - idle->moved_ns < server->idle_ns)
        return NULL;
    hang_up(idle);
    return idle;
}

// Nobody is turned away before a whole round found every place still taken:
// those in them may have gone.
static void accept_callers(struct control_server *server)
{
    for (int tries = 0; tries < CLIENTS_MOST; tries++) {
        struct caller *caller = free_place(server);
        if (!caller && !server->crowded) {
            server->crowded = true;
            return;
        }
        int fd = accept4(server->fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (fd < 0) {
            server->resting = errno != EAGAIN && errno != EINTR && errno != ECONNABORTED;
            return;
        }
        if (!caller)
            caller = idle_place(server);
        server->crowded = !caller;
        if (caller)
            *caller = (struct caller){.fd = fd, .moved_ns = clock_now_ns()};
        else
            turn_away(fd);
    }
}

static void serve_caller(struct control_server *server, struct caller *caller, short events,
                         control_handler *handle, void *context)
{
    bool ok = !(events & (POLLERR | POLLNVAL)) && !(caller->awaited && events & POLLHUP);
    caller->answered = false;
    if (ok && !caller->out.used && !caller->awaited && events & (POLLIN | POLLHUP))
        ok = read_more(caller);
    while (ok && events & POLLHUP && !caller->ended && caller->in.used <= CONTROL_LINE_MOST)
        ok = read_more(caller);
    if (!ok || !answer_lines(server, caller, handle, context))
        hang_up(caller);
}

bool control_serve(struct control_server *server, int timeout_ms, control_handler *handle,
                   void *context, struct error *err)
{
    struct pollfd polled[CLIENTS_MOST + 1];
    for (int i = 0; i < CLIENTS_MOST; i++) {
        const struct caller *caller = &server->callers[i];
        short events = caller->awaited ? 0 : caller->out.used ? POLLOUT : POLLIN;
        polled[i] = (struct pollfd){caller->fd, events, 0};
        if (caller->answered)
            timeout_ms = 0;
    }
    polled[CLIENTS_MOST] = (struct pollfd){server->resting ? -1 : server->fd, POLLIN, 0};
    bool short_wait = server->resting && (timeout_ms < 0 || timeout_ms > REST_MS);
    server->resting = false;
    int ready = poll(polled, CLIENTS_MOST + 1, short_wait ? REST_MS : timeout_ms);
    if (ready < 0)
        return errno == EINTR || fail_errno(err, "%s: cannot wait", server->address.sun_path);
    for (int i = 0; i < CLIENTS_MOST; i++)
        if (polled[i].revents || server->callers[i].answered)
            serve_caller(server, &server->callers[i], polled[i].revents, handle, context);
    if (polled[CLIENTS_MOST].revents)
        accept_callers(server);
    return true;
}
