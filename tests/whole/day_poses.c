// SPDX-License-Identifier: Apache-2.0
// opentrack as its driver knows it: datagrams on a real socket of the loopback,
// sent when they are due on the lane's clock, with its time as their stamp.
#include <dlfcn.h>
#include <errno.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/model_noise.h"
#include "tests/whole/day.h"

enum { QUEUE = 64, FLOOD_TIMES = 50, AXES = 6, LONG_BYTES = 49, SHORT_BYTES = 24 };
static const int64_t PERIOD_NS = 20 * NS_PER_MS;

static struct {
    struct vec3 (*head)(int64_t at_ns);
    struct lane *lane;
    struct noise noise;
    int fd, first, count; // datagrams that nobody took yet
    int64_t due_ns, arrived_ns[QUEUE];
} sender;

static size_t compose(int64_t at_ns, uint8_t bytes[LONG_BYTES])
{
    const int fault = sender.lane->fault;
    struct vec3 p = sender.head(at_ns);
    // In cm; x grows to the observer's left in a picture that is not mirrored.
    double pose[AXES] = {-100 * p.x, 100 * p.y, 100 * p.z, 0, 0, 0};
    if (fault == DAY_NAN)
        pose[noise_bits(&sender.noise) % AXES] = NAN;
    if (fault == DAY_FAR)
        pose[noise_bits(&sender.noise) % AXES] = 1e6;
    memcpy(bytes, pose, sizeof pose);
    if (fault == WIRE_GARBAGE)
        noise_bytes(&sender.noise, bytes, sizeof pose);
    return fault == WIRE_SHORT ? SHORT_BYTES : fault == DAY_LONG ? LONG_BYTES : sizeof pose;
}

static void send_one(int64_t at_ns, const struct sockaddr_in *to)
{
    uint8_t bytes[LONG_BYTES] = {0};
    size_t size = compose(at_ns, bytes);
    int64_t late_ns = sender.lane->fault == DAY_STALE ? NS_PER_S : 0;
    if (sender.lane->fault == WIRE_SILENT || sender.count == QUEUE)
        return;
    if (sendto(sender.fd, bytes, size, 0, (const struct sockaddr *)to, sizeof *to) < 0)
        return;
    sender.arrived_ns[(sender.first + sender.count++) % QUEUE] = at_ns - late_ns;
}

// What was due since the last time; a full queue takes no more.
static int64_t serve(int fd)
{
    struct sockaddr_in to;
    socklen_t size = sizeof to;
    const int64_t now_ns = clock_now_ns();
    if (recv(fd, &(char){0}, 1, MSG_PEEK | MSG_DONTWAIT) < 0)
        sender.count = 0; // another socket: what waited at the last one is lost
    if (getsockname(fd, (struct sockaddr *)&to, &size) != 0)
        return INT64_MAX;
    for (; sender.due_ns <= now_ns; sender.due_ns += PERIOD_NS) {
        if (sender.count == QUEUE && now_ns - sender.due_ns > PERIOD_NS)
            sender.due_ns += (now_ns - sender.due_ns) / PERIOD_NS * PERIOD_NS;
        for (int i = 0; i < (sender.lane->fault == WIRE_FLOOD ? FLOOD_TIMES : 1); i++)
            send_one(sender.due_ns, &to);
    }
    return sender.due_ns;
}

bool day_poses_open(struct vec3 (*head)(int64_t at_ns), struct lane *lane)
{
    sender.head = head;
    sender.lane = lane;
    sender.due_ns = lane->now_ns;
    sender.fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    noise_init(&sender.noise, 1, 'o');
    lane->serve = serve;
    return sender.fd >= 0;
}

void day_poses_close(void)
{
    close(sender.fd);
}

static void stamp(struct msghdr *message, int64_t at_ns)
{
    struct cmsghdr *c = CMSG_FIRSTHDR(message);
    struct timespec wall, at;
    if (!c || c->cmsg_type != SCM_TIMESTAMPNS)
        return;
    clock_gettime(CLOCK_REALTIME, &wall); // of the present lane
    int64_t ns = wall.tv_sec * NS_PER_S + wall.tv_nsec - (clock_now_ns() - at_ns);
    at = (struct timespec){ns / NS_PER_S, ns % NS_PER_S};
    memcpy(CMSG_DATA(c), &at, sizeof at);
}

ssize_t recvmsg(int fd, struct msghdr *message, int flags)
{
    static ssize_t (*real)(int, struct msghdr *, int);
    real = real ? real : dlsym(RTLD_NEXT, "recvmsg");
    ssize_t count = real(fd, message, flags);
    if (!present || present != sender.lane || count < 0)
        return count;
    stamp(message, sender.arrived_ns[sender.first]);
    sender.first = (sender.first + 1) % QUEUE;
    sender.count--;
    return count;
}
