// SPDX-License-Identifier: Apache-2.0
#include "drivers/opentrack.h"

#include <arpa/inet.h>
#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "drivers/deadline.h"

enum {
    MOST_CM = 500,
    MOST_DEG = 180,
    TRAVEL_MS = 50, // from the camera's exposure to the datagram, one webcam frame and its work
    STALE_MS = 250, // what waited longer than this says nothing about now
    QUEUE_MOST = 4096,
};

struct tracker {
    struct tracker_options options;
    int fd;
    char address[64]; // "127.0.0.1:4242", the port that was bound
};

static double little_endian(const uint8_t bytes[8])
{
    uint64_t bits = 0;
    double value;
    for (int i = 7; i >= 0; i--)
        bits = bits << 8 | bytes[i];
    memcpy(&value, &bits, sizeof value);
    return value;
}

// Rounding leaves more than this or nothing; random bytes are mostly below it.
static const double LEAST = 1e-20;

bool opentrack_decode(const uint8_t *bytes, size_t count, double pose[OPENTRACK_AXES],
                      struct error *err)
{
    static const char *const names[] = {"x", "y", "z", "yaw", "pitch", "roll"};
    double read[OPENTRACK_AXES];
    if (count != OPENTRACK_BYTES)
        return fail(err, ERROR_DATA, "datagram of %zu bytes instead of %d", count, OPENTRACK_BYTES);
    for (int i = 0; i < OPENTRACK_AXES; i++) {
        read[i] = little_endian(bytes + 8 * i);
        int most = i < 3 ? MOST_CM : MOST_DEG;
        if (!(fabs(read[i]) <= most))
            return fail(err, ERROR_DATA, "%s is %g, not within +-%d %s", names[i], read[i], most,
                        i < 3 ? "cm" : "deg");
        if (read[i] != 0 && fabs(read[i]) < LEAST)
            return fail(err, ERROR_DATA, "%s is %g: no pose but random bytes", names[i], read[i]);
    }
    memcpy(pose, read, sizeof read);
    return true;
}

struct vec3 opentrack_eye(const struct tracker_options *o, const double pose[OPENTRACK_AXES])
{
    const double *origin = o->origin_m, *eye = o->eye_from_marker_m;
    double v[OPENTRACK_AXES];
    for (int i = 0; i < OPENTRACK_AXES; i++)
        v[i] = pose[i] * o->signs[i] * (i < 3 ? 0.01 : M_PI / 180);
    struct mat3 pitch_roll = mat3_mul(mat3_rotation(0, v[4]), mat3_rotation(2, v[5]));
    struct rigid head = {mat3_mul(mat3_rotation(1, v[3]), pitch_roll),
                         {origin[0] + v[0], origin[1] + v[1], origin[2] + v[2]}};
    return rigid_apply(head, (struct vec3){eye[0], eye[1], eye[2]});
}

static bool fail_bind(const struct tracker_options *o, struct error *err)
{
    if (errno == EADDRINUSE)
        return fail(err, ERROR_SYSTEM, "UDP port %d is in use by another program", o->port);
    if (errno == EACCES || errno == EPERM)
        return fail(err, ERROR_SYSTEM, "no permission to listen at %s, UDP port %d", o->address,
                    o->port);
    if (errno == EADDRNOTAVAIL)
        return fail(err, ERROR_GONE, "this machine has no address %s", o->address);
    return fail_errno(err, "listening at %s, UDP port %d", o->address, o->port);
}

static bool listen_at(struct tracker *t, struct error *err)
{
    const struct tracker_options *o = &t->options;
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)o->port)};
    socklen_t size = sizeof at;
    const int on = 1;
    char host[INET_ADDRSTRLEN];
    if (inet_pton(AF_INET, o->address, &at.sin_addr) != 1)
        return fail(err, ERROR_CONFIG, "address: \"%s\" is not a numeric IPv4 address", o->address);
    t->fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (t->fd < 0)
        return fail_errno(err, "opening a UDP socket");
    if (bind(t->fd, (struct sockaddr *)&at, size) != 0)
        return fail_bind(o, err);
    if (setsockopt(t->fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0 ||
        getsockname(t->fd, (struct sockaddr *)&at, &size) != 0)
        return fail_errno(err, "setting up a UDP socket");
    inet_ntop(AF_INET, &at.sin_addr, host, sizeof host);
    snprintf(t->address, sizeof t->address, "%s:%d", host, ntohs(at.sin_port));
    return true;
}

static void opentrack_close(struct tracker *t)
{
    if (!t)
        return;
    if (t->fd >= 0)
        close(t->fd);
    free(t);
}

static struct tracker *opentrack_open(const struct tracker_options *options, int64_t deadline_ns,
                                      struct error *err)
{
    (void)deadline_ns;
    struct tracker *t = calloc(1, sizeof *t);
    if (!t) {
        fail_errno(err, "listening to opentrack");
        return NULL;
    }
    t->options = *options;
    t->fd = -1;
    if (listen_at(t, err))
        return t;
    opentrack_close(t);
    return NULL;
}

// How long ago the kernel got the datagram; 0 where it does not say, or where
// somebody set the wall clock meanwhile.
static int64_t waited_ns(struct msghdr *message)
{
    struct timespec got, now;
    struct cmsghdr *c = CMSG_FIRSTHDR(message);
    if (!c || c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS)
        return 0;
    memcpy(&got, CMSG_DATA(c), sizeof got);
    clock_gettime(CLOCK_REALTIME, &now);
    int64_t waited = (now.tv_sec - got.tv_sec) * NS_PER_S + now.tv_nsec - got.tv_nsec;
    return waited > 0 ? waited : 0;
}

// The whole length of a datagram, also when it is more than a pose has.
static ssize_t receive(struct tracker *t, uint8_t bytes[OPENTRACK_BYTES], int64_t *waited)
{
    union {
        struct cmsghdr header;
        char room[CMSG_SPACE(sizeof(struct timespec))];
    } control;
    struct iovec part = {bytes, OPENTRACK_BYTES};
    struct msghdr message = {.msg_iov = &part,
                             .msg_iovlen = 1,
                             .msg_control = &control,
                             .msg_controllen = sizeof control};
    ssize_t count = recvmsg(t->fd, &message, MSG_TRUNC);
    *waited = count >= 0 ? waited_ns(&message) : 0;
    return count;
}

// Empties the queue and keeps the last good pose. False with err GONE when the
// socket failed, or RETRY (why) when nothing good was there.
static bool drain(struct tracker *t, struct head_sample *out, struct error *why)
{
    uint8_t bytes[OPENTRACK_BYTES];
    double pose[OPENTRACK_AXES];
    bool any = false;
    for (int i = 0; i < QUEUE_MOST; i++) {
        int64_t waited, now = clock_now_ns();
        ssize_t count = receive(t, bytes, &waited);
        if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
            break;
        if (count < 0 && errno != EINTR && errno != ECONNREFUSED)
            return fail(why, ERROR_GONE, "%s: %s", t->address, strerror(errno));
        if (count < 0 || !opentrack_decode(bytes, (size_t)count, pose, why))
            continue;
        if (waited > STALE_MS * NS_PER_MS) {
            fail(why, ERROR_DATA, "the last pose is %.1f s old", (double)waited / NS_PER_S);
            continue;
        }
        *out = (struct head_sample){
            .taken = {now - waited - TRAVEL_MS * NS_PER_MS, now - waited},
            .status = TRACKER_SEEN,
            .eye = opentrack_eye(&t->options, pose),
        };
        any = true;
    }
    return any;
}

static bool opentrack_read(struct tracker *t, int64_t deadline_ns, struct head_sample *out,
                           struct error *err)
{
    struct error why = {0};
    for (int wait; (wait = deadline_ms(deadline_ns, 1000)) > 0;) {
        struct pollfd p = {.fd = t->fd, .events = POLLIN};
        if (poll(&p, 1, wait) <= 0)
            continue;
        struct head_sample sample;
        if (drain(t, &sample, &why)) {
            *out = sample;
            return true;
        }
        if (why.code == ERROR_GONE)
            return fail(err, ERROR_GONE, "%s", why.text);
    }
    return fail(err, ERROR_RETRY, "%s: no pose from opentrack%s%s", t->address,
                why.code ? ": " : "", why.text);
}

static void opentrack_identify(const struct tracker *t, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    snprintf(out->model, sizeof out->model, "opentrack");
    snprintf(out->serial, sizeof out->serial, "%s", t->address);
}

const struct tracker_driver opentrack_driver = {"opentrack", opentrack_open, opentrack_read,
                                                opentrack_identify, opentrack_close};
