// SPDX-License-Identifier: Apache-2.0
// Faults of what finds the head: the infrared camera, and opentrack, whose
// datagrams are sent from here.
#include "tests/fakes/support.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "tests/whole/running.h"

#include "tests/whole/faults.h"

static const double TRUE_EYE_M[3] = {0, 0.55, 0.65}, EYE_M = 0.02; // the camera's pixels
static const double POSE_M = 0.001;                                // a pose that rests, smoothed

static struct row camera_rows[] = {
    {"silent", .effect = MUTE, .lasts_s = 20, .name = "silent-for-long"},
    {"unplugged", .effect = GOES},
    {"forbidden", .effect = GOES, .says = "udev rules", .first = "unplugged"},
    {"silent", .effect = MUTE},
    {"garbage", .effect = MUTE},
    {"short", .effect = MUTE},
    {"stall", .effect = RIDES},
    {"flood", .effect = RIDES},
    {"wrong-report", .effect = MUTE},
};

static struct row opentrack_rows[] = {
    {"silent", .effect = MUTE},
    {"nan", .effect = MUTE, .says = "x is"},
    {"infinite", .effect = MUTE, .says = "z is inf"},
    {"too-far", .effect = MUTE, .says = "y is 1e+06"},
    {"short", .effect = MUTE, .says = "47 bytes"},
    {"long", .effect = MUTE, .says = "56 bytes"},
    {"flood", .effect = RIDES},
    {"stale", .effect = MUTE, .alone = true},
};

static void value(const json_t *status, double v[3], double *held_ms)
{
    const json_t *eye = dig(status, "eye.eye_m");
    for (size_t i = 0; i < 3; i++)
        v[i] = json_number_value(json_array_get(eye, i));
    *held_ms = dig_real(status, "eye.age_ms");
}

static double apart(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

static bool is_true(const struct lane *lane, const double v[3])
{
    (void)lane;
    return apart(v, TRUE_EYE_M) < EYE_M;
}

static bool is_where_it_was(const struct lane *lane, const double v[3])
{
    return apart(v, lane->truth) < POSE_M;
}

// ---- opentrack's side ------------------------------------------------------------------

enum { AXES = 6, POSE_BYTES = 48, FLOOD = 50 };
static const int64_t FRAME_NS = NS_PER_S / 60;          // of a webcam
static const int64_t OUTLIVED_NS = 400 * NS_PER_MS;     // what waits longer than 250 ms is stale
static const double POSE[AXES] = {4, -3, 5, 10, -5, 2}; // cm, degrees
static const double ELSEWHERE_CM = 20;

static struct opentrack {
    struct sockaddr_in to;
    int fd;
    pthread_t thread;
    pthread_mutex_t lock; // of what follows
    char fault[16];
    bool stop;
} opentrack = {.lock = PTHREAD_MUTEX_INITIALIZER};

int opentrack_free_port(void)
{
    socklen_t size = sizeof opentrack.to;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    opentrack.to.sin_family = AF_INET;
    opentrack.to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    assert_int_equal(bind(fd, (struct sockaddr *)&opentrack.to, size), 0);
    assert_int_equal(getsockname(fd, (struct sockaddr *)&opentrack.to, &size), 0);
    close(fd);
    return ntohs(opentrack.to.sin_port);
}

static void send_pose(const double pose[AXES], size_t bytes)
{
    char datagram[POSE_BYTES + 8] = {0};
    memcpy(datagram, pose, POSE_BYTES); // little-endian, as opentrack's own machine is
    sendto(opentrack.fd, datagram, bytes, MSG_DONTWAIT, (struct sockaddr *)&opentrack.to,
           sizeof opentrack.to);
}

static void send_frame(const char *fault)
{
    double pose[AXES];
    memcpy(pose, POSE, sizeof pose);
    pose[0] = !strcmp(fault, "nan") ? NAN : pose[0];
    pose[1] = !strcmp(fault, "too-far") ? 1e6 : pose[1];
    pose[2] = !strcmp(fault, "infinite") ? INFINITY : pose[2];
    size_t bytes = !strcmp(fault, "short")  ? POSE_BYTES - 1
                   : !strcmp(fault, "long") ? POSE_BYTES + 8
                                            : POSE_BYTES;
    int times = !strcmp(fault, "flood") ? FLOOD : 1;
    for (int i = 0; i < times; i++)
        send_pose(pose, bytes);
}

static void *send_on(void *argument)
{
    (void)argument;
    for (;;) {
        char fault[sizeof opentrack.fault];
        pthread_mutex_lock(&opentrack.lock);
        memcpy(fault, opentrack.fault, sizeof fault);
        bool stop = opentrack.stop;
        pthread_mutex_unlock(&opentrack.lock);
        if (stop)
            return NULL;
        if (strcmp(fault, "silent") && strcmp(fault, "stale"))
            send_frame(fault);
        clock_sleep_until_ns(clock_now_ns() + FRAME_NS);
    }
}

// Poses of another place wait in the queue of a boothd that does not run until
// they are stale; no more come.
static void leave_stale_poses(pid_t daemon)
{
    double pose[AXES];
    memcpy(pose, POSE, sizeof pose);
    pose[0] += ELSEWHERE_CM;
    kill(daemon, SIGSTOP);
    for (int i = 0; i < FLOOD; i++)
        send_pose(pose, POSE_BYTES);
    clock_sleep_until_ns(clock_now_ns() + OUTLIVED_NS);
    kill(daemon, SIGCONT);
}

static bool send_with(struct lane *lane, const char *fault)
{
    pthread_mutex_lock(&opentrack.lock);
    snprintf(opentrack.fault, sizeof opentrack.fault, "%s", fault);
    pthread_mutex_unlock(&opentrack.lock);
    if (!strcmp(fault, "stale"))
        leave_stale_poses(lane->here->daemon);
    return true;
}

static bool begin_sending(struct lane *lane)
{
    lane->own = &opentrack;
    opentrack.fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    return opentrack.fd >= 0 && !pthread_create(&opentrack.thread, NULL, send_on, NULL);
}

static void end_sending(struct lane *lane)
{
    if (!lane->own)
        return;
    pthread_mutex_lock(&opentrack.lock);
    opentrack.stop = true;
    pthread_mutex_unlock(&opentrack.lock);
    pthread_join(opentrack.thread, NULL);
    close(opentrack.fd);
}

const struct kind camera_kind = {.label = "camera",
                                 .instrument = "camera",
                                 .name = "tracker",
                                 .runs = "running",
                                 .opens_ms = 500,
                                 .rows = camera_rows,
                                 .count = sizeof camera_rows / sizeof *camera_rows,
                                 .value = value,
                                 .is_true = is_true};

const struct kind opentrack_kind = {.label = "opentrack",
                                    .instrument = "opentrack",
                                    .name = "tracker",
                                    .runs = "running",
                                    .opens_ms = 0,
                                    .rows = opentrack_rows,
                                    .count = sizeof opentrack_rows / sizeof *opentrack_rows,
                                    .cause = send_with,
                                    .value = value,
                                    .is_true = is_where_it_was,
                                    .come_up = begin_sending,
                                    .go_down = end_sending};
