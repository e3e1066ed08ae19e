// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/control.h"
#include "base/control_wire.h"

struct control_client {
    int fd;
    bool broken;     // half a request went out
    unsigned unread; // replies to calls that timed out, still to come
    struct control_bytes in;
    char path[sizeof((struct sockaddr_un *)0)->sun_path];
};

// connect() waits while the server's queue is full; this bounds it.
static const struct timeval CONNECT_PATIENCE = {.tv_sec = 5};

static bool open_client(struct control_client *client, const struct sockaddr_un *address,
                        struct error *err)
{
    client->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (client->fd < 0)
        return fail_errno(err, "%s: no socket", client->path);
    setsockopt(client->fd, SOL_SOCKET, SO_SNDTIMEO, &CONNECT_PATIENCE, sizeof CONNECT_PATIENCE);
    if (!connect(client->fd, (const struct sockaddr *)address, sizeof *address))
        return true;
    if (errno == ENOENT || errno == ECONNREFUSED)
        return fail(err, ERROR_GONE, "%s: nobody listens there", client->path);
    if (errno == EAGAIN)
        return fail(err, ERROR_RETRY, "%s: too many callers", client->path);
    return fail_errno(err, "%s: cannot connect", client->path);
}

struct control_client *control_connect(const char *path, struct error *err)
{
    struct sockaddr_un address;
    if (!control_address(path, &address, err))
        return NULL;
    struct control_client *client = calloc(1, sizeof *client);
    if (!client) {
        fail_errno(err, "%s", path);
        return NULL;
    }
    strcpy(client->path, path);
    if (open_client(client, &address, err))
        return client;
    control_close(client);
    return NULL;
}

void control_close(struct control_client *client)
{
    if (!client)
        return;
    if (client->fd >= 0)
        close(client->fd);
    free(client->in.text);
    free(client);
}

static bool wait_for(struct control_client *client, short events, int64_t deadline_ns,
                     struct error *err)
{
    for (;;) {
        int64_t left_ns = deadline_ns - clock_now_ns();
        struct pollfd p = {client->fd, events, 0};
        int ready = poll(&p, 1, left_ns > 0 ? (int)(left_ns / NS_PER_MS) + 1 : 0);
        if (ready > 0)
            return true;
        if (!ready)
            return fail(err, ERROR_RETRY, "%s: no answer in time", client->path);
        if (errno != EINTR)
            return fail_errno(err, "%s: cannot wait", client->path);
    }
}

static bool send_line(struct control_client *client, const char *line, size_t size,
                      int64_t deadline_ns, struct error *err)
{
    for (size_t sent = 0; sent < size;) {
        ssize_t n = send(client->fd, line + sent, size - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n > 0) {
            sent += n;
        } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
            if (wait_for(client, POLLOUT, deadline_ns, err))
                continue;
            client->broken = sent;
            return false;
        } else if (errno != EINTR) {
            client->broken = true; // but its last words may be there to read
            return true;
        }
    }
    return true;
}

static bool receive(struct control_client *client, struct error *err)
{
    if (client->in.used > CONTROL_REPLY_MOST ||
        !control_bytes_reserve(&client->in, CONTROL_CHUNK)) {
        client->broken = true;
        return fail(err, ERROR_DATA, "%s: an answer is longer than %d bytes", client->path,
                    CONTROL_REPLY_MOST);
    }
    ssize_t n = recv(client->fd, client->in.text + client->in.used, CONTROL_CHUNK, MSG_DONTWAIT);
    if (n > 0)
        client->in.used += n;
    else if (!n || (errno != EAGAIN && errno != EINTR))
        return fail(err, ERROR_GONE, "%s: the connection was closed", client->path);
    return true;
}

// Waits until a whole line is in; *size without its end.
static bool receive_line(struct control_client *client, size_t *size, int64_t deadline_ns,
                         struct error *err)
{
    size_t looked = 0;
    for (;;) {
        char *end = looked < client->in.used
                        ? memchr(client->in.text + looked, '\n', client->in.used - looked)
                        : NULL;
        if (end) {
            *size = end - client->in.text;
            return true;
        }
        looked = client->in.used;
        if (!wait_for(client, POLLIN, deadline_ns, err) || !receive(client, err))
            return false;
    }
}

static enum error_code code_of(const char *name)
{
#define X(code, text)                                                                              \
    if (name && !strcmp(name, text))                                                               \
        return ERROR_##code;
    ERROR_CODES(X)
#undef X
    return ERROR_DATA;
}

static json_t *take_reply(struct control_client *client, size_t size, struct error *err)
{
    json_t *reply = json_loadb(client->in.text, size, 0, NULL);
    control_bytes_drop(&client->in, size + 1);
    json_t *ok = json_object_get(reply, "ok");
    if (json_is_true(ok))
        return reply;
    const char *text = json_string_value(json_object_get(reply, "error"));
    if (json_is_false(ok) && text)
        fail(err, code_of(json_string_value(json_object_get(reply, "code"))), "%s", text);
    else
        fail(err, ERROR_DATA, "%s: the answer is not a reply", client->path);
    json_decref(reply);
    return NULL;
}

static bool send_request(struct control_client *client, json_t *request, int64_t deadline_ns,
                         struct error *err)
{
    char *text = request ? json_dumps(request, JSON_COMPACT) : NULL;
    json_decref(request);
    if (!text)
        return fail(err, ERROR_RANGE, "%s: the request is not valid JSON", client->path);
    size_t size = strlen(text);
    text[size] = '\n';
    bool ok = send_line(client, text, size + 1, deadline_ns, err);
    free(text);
    return ok;
}

json_t *control_call(struct control_client *client, json_t *request, int timeout_ms,
                     struct error *err)
{
    int64_t deadline_ns = clock_now_ns() + timeout_ms * NS_PER_MS;
    if (client->broken) {
        json_decref(request);
        fail(err, ERROR_GONE, "%s: the connection was lost", client->path);
        return NULL;
    }
    if (!send_request(client, request, deadline_ns, err))
        return NULL;
    client->unread++;
    for (;;) {
        size_t size;
        if (!receive_line(client, &size, deadline_ns, err))
            return NULL;
        if (!--client->unread)
            return take_reply(client, size, err);
        control_bytes_drop(&client->in, size + 1);
    }
}
