// SPDX-License-Identifier: Apache-2.0
// Faults of what finds the head: the infrared camera, and opentrack.
#include "tests/fakes/support.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "tests/whole/running.h"

#include "tests/whole/faults.h"

static const double TRUE_EYE_M[3] = {0, 0.55, 0.65}, EYE_M = 0.02; // noise and the camera's pixels
#define STALE "stale"                                              // no word of boothsim's
enum { OUTLIVED_MS = 400 }; // what waits longer than 250 ms is stale

static struct row camera_rows[] = {
    {"silent", .effect = MUTE, .lasts_s = 12, .name = "silent-for-long",
     .says = "no camera reports"},
    {"unplugged", .effect = GOES, .says = "no Wii remote"},
    {"forbidden", .effect = GOES, .says = "70-boothd.rules", .first = "unplugged"},
    {"silent", .effect = MUTE, .says = "no camera reports"},
    {"garbage", .effect = MUTE, .says = "no camera reports"},
    {"short", .effect = MUTE, .says = "no camera reports"},
    {"stall", .effect = RIDES},
    {"flood", .effect = RIDES},
    {"wrong-report", .effect = MUTE, .says = "no camera reports"},
};

static struct row opentrack_rows[] = {
    {"silent", .effect = MUTE, .lasts_s = 12, .name = "silent-for-long", .says = "no pose"},
    {"silent", .effect = MUTE, .says = "no pose"},
    {"garbage", .effect = MUTE, .says = "not within"},
    {"short", .effect = MUTE, .says = "24 bytes instead of 48"},
    {"wrong-size", .effect = MUTE, .says = "bytes instead of 48"},
    {"not-a-number", .effect = MUTE, .says = "not within"},
    {"out-of-range", .effect = MUTE, .says = "not within"},
    {"flood", .effect = RIDES},
    {"frozen", .effect = RIDES},
    {STALE, .effect = MUTE, .alone = true, .stops_ms = 2 * OUTLIVED_MS},
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

// ---- opentrack ---------------------------------------------------------------------------

static const double ELSEWHERE_M[3] = {0.2, 0.55, 0.65};

int opentrack_free_port(void)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof at;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&at, size), 0);
    assert_int_equal(getsockname(fd, (struct sockaddr *)&at, &size), 0);
    close(fd);
    return ntohs(at.sin_port);
}

static bool put_head(struct lane *lane, const double eye[3])
{
    json_t *request = json_pack("{ss,s[fff]}", "do", "head", "eye_m", eye[0], eye[1], eye[2]);
    json_t *reply = control_call(lane->booth, request, BOOTH_CALL_MS, NULL);
    json_decref(reply);
    return reply;
}

// Poses of another place wait in the queue of a boothd that does not run until
// they are stale; no more come.
static bool leave_stale_poses(struct lane *lane)
{
    kill(lane->here->daemon, SIGSTOP);
    bool good = put_head(lane, ELSEWHERE_M);
    clock_sleep_until_ns(clock_now_ns() + OUTLIVED_MS * NS_PER_MS);
    good = booth_fault(lane->booth, "opentrack", "silent") && good;
    clock_sleep_until_ns(clock_now_ns() + OUTLIVED_MS * NS_PER_MS);
    kill(lane->here->daemon, SIGCONT);
    return good;
}

static bool upset_opentrack(struct lane *lane, const char *fault)
{
    if (!strcmp(fault, STALE))
        return leave_stale_poses(lane);
    return put_head(lane, TRUE_EYE_M) && booth_fault(lane->booth, "opentrack", fault);
}

const struct kind camera_kind = {.label = "camera",
                                 .instrument = "camera",
                                 .name = "tracker",
                                 .runs = "running",
                                 .enumerates_ms = 2000,
                                 .rows = camera_rows,
                                 .count = sizeof camera_rows / sizeof *camera_rows,
                                 .value = value,
                                 .is_true = is_true};

const struct kind opentrack_kind = {.label = "opentrack",
                                    .instrument = "opentrack",
                                    .name = "tracker",
                                    .runs = "running",
                                    .rows = opentrack_rows,
                                    .count = sizeof opentrack_rows / sizeof *opentrack_rows,
                                    .cause = upset_opentrack,
                                    .value = value,
                                    .is_true = is_true};
