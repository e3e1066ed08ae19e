// SPDX-License-Identifier: Apache-2.0
// boothd follows the head by the datagrams of an emulated opentrack.
#include "tests/fakes/support.h"

#include <arpa/inet.h>
#include <sys/socket.h>

#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

// Noise 0.5 mm and 0.1 degrees, filtered; a wrong sign of yaw or roll is 3 mm off.
static const double EYE_M = 0.002;
static const int64_t LOOK_NS = 20 * NS_PER_MS;

static struct booth_here here;
static struct control_client *daemon_client, *booth_client;

// Free now; somebody else would have to take it within a second.
static int free_port(void)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof at;
    int fd = socket(AF_INET, SOCK_DGRAM, 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&at, sizeof at), 0);
    assert_int_equal(getsockname(fd, (struct sockaddr *)&at, &size), 0);
    close(fd);
    return ntohs(at.sin_port);
}

// signs = more of boothd's arguments; "" leaves them at their preset.
static int open_with(const char *mirrored, const char *signs)
{
    char scenario[64], arguments[256];
    int port = free_port();
    snprintf(scenario, sizeof scenario, "[opentrack]\nport = %d\nmirrored = %s\n", port, mirrored);
    snprintf(arguments, sizeof arguments,
             "--set tracker.driver=opentrack --set tracker.port=%d %s"
             " --set radiometer.driver=none --set display.output=offscreen",
             port, signs);
    if (!booth_open(&here, scenario, arguments))
        return -1;
    daemon_client = connect_to(folder_at(&here.folder, "run/boothd.sock"), here.booth);
    booth_client = connect_to(folder_at(&here.folder, "run/boothsim.sock"), here.booth);
    return daemon_client && booth_client ? 0 : -1;
}

static int open_mirrored(void **state)
{
    (void)state;
    return open_with("yes", "--set tracker.signs='1 1 1 1 1 -1'");
}

static int open_plain(void **state)
{
    (void)state;
    return open_with("no", "");
}

static int leave(void **state)
{
    (void)state;
    control_close(daemon_client);
    control_close(booth_client);
    return booth_close(&here);
}

static void fault(const char *kind)
{
    assert_true(booth_fault(booth_client, "opentrack", kind));
}

static void put_head(double x, double y, double z)
{
    json_t *reply =
        control_call(booth_client, json_pack("{ss,s[fff]}", "do", "head", "eye_m", x, y, z),
                     BOOTH_CALL_MS, NULL);
    assert_non_null(reply);
    json_decref(reply);
}

static double eye_off_by(const json_t *status, const double eye[3])
{
    const json_t *seen = dig(status, "eye.eye_m");
    double sum = 0;
    for (size_t i = 0; i < 3; i++) {
        double off = json_number_value(json_array_get(seen, i)) - eye[i];
        sum += off * off;
    }
    return json_array_size(seen) == 3 ? sqrt(sum) : HUGE_VAL;
}

// Until boothd knows freshly that the eye is here.
static void await_eye(double x, double y, double z)
{
    const double eye[3] = {x, y, z};
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    for (bool here_it_is = false; !here_it_is;) {
        json_t *status = booth_status(daemon_client);
        assert_non_null(status);
        here_it_is =
            !strcmp(dig_text(status, "eye.standing"), "fresh") && eye_off_by(status, eye) < EYE_M;
        if (!here_it_is && clock_now_ns() > until_ns)
            print_error("%s, %g m off: %s\n", dig_text(status, "eye.standing"),
                        eye_off_by(status, eye),
                        dig_text(status, "instruments.tracker.last_error"));
        assert_true(here_it_is || clock_now_ns() <= until_ns);
        json_decref(status);
        clock_sleep_until_ns(clock_now_ns() + LOOK_NS);
    }
}

static void await_stale(void)
{
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    for (bool stale = false; !stale; clock_sleep_until_ns(clock_now_ns() + LOOK_NS)) {
        json_t *status = booth_status(daemon_client);
        stale = !strcmp(dig_text(status, "eye.standing"), "stale");
        json_decref(status);
        assert_true(stale || clock_now_ns() < until_ns);
    }
}

static void the_eye_is_where_the_head_is(void **state)
{
    (void)state;
    await_eye(0, 0.55, 0.65);
    put_head(0.3, 0.5, 0.6);
    await_eye(0.3, 0.5, 0.6);
    put_head(-0.15, 0.6, 0.55);
    await_eye(-0.15, 0.6, 0.55);
}

static void what_cannot_be_a_pose_leaves_the_last_one_until_good_ones_come(void **state)
{
    (void)state;
    static const char *const kinds[] = {"not-a-number", "wrong-size", "out-of-range", "silent"};
    const double eye[3] = {-0.15, 0.6, 0.55};
    await_eye(eye[0], eye[1], eye[2]);
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        fault(kinds[i]);
        await_stale();
        json_t *status = booth_status(daemon_client);
        assert_true(eye_off_by(status, eye) < EYE_M);
        json_decref(status);
        fault("fine");
        await_eye(eye[0], eye[1], eye[2]);
    }
}

static void a_flood_is_ridden_out(void **state)
{
    (void)state;
    fault("flood");
    put_head(0.1, 0.55, 0.65);
    await_eye(0.1, 0.55, 0.65);
    fault("fine");
}

int main(void)
{
    const struct CMUnitTest plain[] = {
        cmocka_unit_test(the_eye_is_where_the_head_is),
    };
    const struct CMUnitTest mirrored[] = {
        cmocka_unit_test(the_eye_is_where_the_head_is),
        cmocka_unit_test(what_cannot_be_a_pose_leaves_the_last_one_until_good_ones_come),
        cmocka_unit_test(a_flood_is_ridden_out),
    };
    return cmocka_run_group_tests(plain, open_plain, leave) +
           cmocka_run_group_tests(mirrored, open_mirrored, leave);
}
