// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <dlfcn.h>
#include <limits.h>
#include <modbus.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/udev.h"
#include "drivers/witmotion.h"

#include <cmocka.h>

#include "tests/fakes/near.h"
#include "tests/fakes/pty.h"

static const double arithmetic = 1e-9;
static const double angle_step = 0.0055; // one step of a 16 bit angle, deg
static const double accel_step = 16.0 / 32768 * 9.80665;
enum { WT901C485, HWT9073, PATIENCE_S = 60 }; // bounds a hang only

// A busy machine may keep a peer of ours from its turn for longer than the
// driver waits for one of its kind. These waits are endless in effect here, but
// where a test says that no answer comes, or not the rest of one.
static bool no_answer, no_rest;

typedef int set_timeout(modbus_t *bus, uint32_t s, uint32_t us);

int modbus_set_response_timeout(modbus_t *bus, uint32_t s, uint32_t us)
{
    set_timeout *real = dlsym(RTLD_NEXT, "modbus_set_response_timeout");
    return no_answer ? real(bus, s, us) : real(bus, PATIENCE_S, 0);
}

int modbus_set_byte_timeout(modbus_t *bus, uint32_t s, uint32_t us)
{
    set_timeout *real = dlsym(RTLD_NEXT, "modbus_set_byte_timeout");
    return no_rest ? real(bus, s, us) : real(bus, PATIENCE_S, 0);
}

static const struct accelerometer_driver *driver(void)
{
    return accelerometer_drivers[0];
}

static void tilt_is_right_at_all_quadrants(void **state)
{
    (void)state;
    assert_near(tilt_of_gravity((struct vec3){0, 0, 9.81}), 0, arithmetic);
    assert_near(tilt_of_gravity((struct vec3){0, 9.81, 0}), 90, arithmetic);
    assert_near(tilt_of_gravity((struct vec3){0, -9.81, 0}), -90, arithmetic);
    assert_near(fabs(tilt_of_gravity((struct vec3){0, 0, -9.81})), 180, arithmetic);
    for (int deg = -179; deg <= 179; deg++) {
        double a = deg * (M_PI / 180);
        assert_near(tilt_of_gravity((struct vec3){0.3, 9.8 * sin(a), 9.8 * cos(a)}), deg,
                    arithmetic);
    }
}

static void the_published_angles_decode(void **state)
{
    (void)state;
    uint16_t narrow[12] = {[9] = 0x00b6, 0xfe39, 0x4000};
    uint16_t wide[15] = {[9] = 0x03e8, 0x0000, 0xf63c, 0xffff, 0x5f90, 0x0001};
    const double wanted[3] = {1, -2.5, 90};
    for (int i = 0; i < 3; i++) {
        assert_near(witmotion_angle(witmotion_map(WT901C485), narrow, i), wanted[i], angle_step);
        assert_near(witmotion_angle(witmotion_map(HWT9073), wide, i), wanted[i], arithmetic);
    }
}

static void set_pose(uint16_t *r, double deg, double g, double roll_deg)
{
    double a = deg * (M_PI / 180);
    r[0] = 0;
    r[1] = (uint16_t)(int16_t)lrint(g * sin(a) * 2048);
    r[2] = (uint16_t)(int16_t)lrint(g * cos(a) * 2048);
    r[9] = (uint16_t)(int16_t)lrint(roll_deg / 180 * 32768);
}

static void gravity_and_the_angle_register_must_agree(void **state)
{
    (void)state;
    const struct modbus_map *map = witmotion_map(WT901C485);
    uint16_t r[12] = {0};
    struct tilt_sample s;
    set_pose(r, 30, 1, 30);
    witmotion_decode(map, r, 0, &s);
    assert_true(s.plausible);
    assert_near(s.tilt_deg, 30, 0.05);
    assert_near(s.angle_deg, 30, angle_step);
    assert_near(vec3_length(s.gravity), 9.80665, 2 * accel_step);
    set_pose(r, 30, 1, 33);
    witmotion_decode(map, r, 0, &s);
    assert_false(s.plausible);
    set_pose(r, 30, 1.05, 30);
    witmotion_decode(map, r, 0, &s);
    assert_false(s.plausible);
    set_pose(r, 30, 0, 30);
    witmotion_decode(map, r, 0, &s);
    assert_false(s.plausible);
}

static void an_offset_turns_both_tilts_around_the_circle(void **state)
{
    (void)state;
    uint16_t r[12] = {0};
    struct tilt_sample s;
    set_pose(r, 179, 1, -179.5);
    witmotion_decode(witmotion_map(WT901C485), r, 5, &s);
    assert_near(s.tilt_deg, -176, 0.05);
    assert_near(s.angle_deg, -174.5, angle_step);
    assert_true(s.plausible);
}

static void the_wrong_map_shows_as_implausible(void **state)
{
    (void)state;
    uint16_t r[15] = {0};
    struct tilt_sample s;
    set_pose(r, 30, 1, 0);
    r[9] = 30000, r[10] = 0; // 30.000 degrees, low word first
    witmotion_decode(witmotion_map(HWT9073), r, 0, &s);
    assert_true(s.plausible);
    witmotion_decode(witmotion_map(WT901C485), r, 0, &s);
    assert_false(s.plausible);
}

// A sensor as libmodbus serves it.
struct sensor {
    modbus_mapping_t *registers;
};

static void serve(struct pty *pty, void *context)
{
    struct sensor *sensor = context;
    modbus_t *bus = modbus_new_rtu("/dev/null", 9600, 'N', 8, 1);
    uint8_t query[MODBUS_MAX_ADU_LENGTH];
    modbus_set_slave(bus, 0x50);
    modbus_set_socket(bus, pty->master);
    modbus_set_indication_timeout(bus, 0, 20000);
    while (!pty->stop) {
        int count = modbus_receive(bus, query);
        if (count > 0)
            modbus_reply(bus, query, count, sensor->registers);
        else if (count < 0)
            usleep(2000);
    }
    modbus_free(bus);
}

static struct accelerometer_options options_for(const char *port)
{
    struct accelerometer_options options;
    memset(&options, 0, sizeof options);
    settings_preset(accelerometer_settings, &options);
    strcpy(options.port, port);
    return options;
}

static int64_t soon(void)
{
    return clock_now_ns() + PATIENCE_S * NS_PER_S;
}

static struct sensor sensor_new(void)
{
    struct sensor s = {modbus_mapping_new(0, 0, 0x100, 0)};
    s.registers->tab_registers[0x2e] = 42;
    for (int i = 0; i < 6; i++)
        s.registers->tab_registers[0x7f + i] =
            (uint16_t)("EMU1CLINOM01"[2 * i + 1] << 8 | "EMU1CLINOM01"[2 * i]);
    set_pose(s.registers->tab_registers + 0x34, 30, 1, 30);
    return s;
}

static void a_served_sensor_is_read_and_named(void **state)
{
    (void)state;
    struct sensor sensor = sensor_new();
    struct pty pty;
    struct error err = {0};
    struct tilt_sample s;
    struct instrument_identity who;
    assert_true(pty_start(&pty, serve, &sensor));
    struct accelerometer_options options = options_for(pty.path);
    struct accelerometer *a = driver()->open(&options, soon(), &err);
    assert_string_equal(err.text, "");
    assert_non_null(a);
    driver()->identify(a, &who);
    assert_string_equal(who.model, "wt901c485");
    assert_string_equal(who.firmware, "42");
    assert_string_equal(who.serial, "EMU1CLINOM01");
    assert_true(who.emulated);
    int64_t before = clock_now_ns();
    assert_true(driver()->read(a, soon(), &s, &err));
    assert_near(s.tilt_deg, 30, 0.05);
    assert_true(s.plausible);
    assert_true(s.taken.earliest_ns >= before && s.taken.latest_ns >= s.taken.earliest_ns);
    pty_unplug(&pty);
    assert_false(driver()->read(a, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    driver()->close(a);
    pty_stop(&pty);
    modbus_mapping_free(sensor.registers);
}

// Answers request after request with prepared frames.
struct script {
    struct {
        uint8_t request[8];
        int reply_bytes;
        uint8_t reply[64];
    } step[8];
    int steps, done, unlike;
};

static void play(struct pty *pty, void *context)
{
    struct script *script = context;
    uint8_t request[8];
    int got = 0;
    while (!pty->stop && script->done < script->steps) {
        int byte = pty_byte(pty);
        if (byte < 0)
            continue;
        request[got++] = (uint8_t)byte;
        if (got < 8)
            continue;
        got = 0;
        script->unlike += memcmp(request, script->step[script->done].request, 8) != 0;
        pty_write(pty, script->step[script->done].reply, script->step[script->done].reply_bytes);
        script->done++;
    }
    while (!pty->stop)
        pty_byte(pty);
}

static uint16_t crc(const uint8_t *bytes, int count)
{
    uint16_t c = 0xffff;
    for (int i = 0; i < count; i++) {
        c ^= bytes[i];
        for (int k = 0; k < 8; k++)
            c = c & 1 ? c >> 1 ^ 0xa001 : c >> 1;
    }
    return c;
}

static void add_step(struct script *s, const uint8_t *request, const uint8_t *reply, int count)
{
    memcpy(s->step[s->steps].request, request, 8);
    memcpy(s->step[s->steps].reply, reply, (size_t)count);
    s->step[s->steps].reply_bytes = count;
    s->steps++;
}

static void sealed(uint8_t *frame, int count)
{
    uint16_t c = crc(frame, count);
    frame[count] = c & 255;
    frame[count + 1] = c >> 8;
}

static uint8_t ask_version[8] = {0x50, 3, 0, 0x2e, 0, 1};
static uint8_t ask_serial[8] = {0x50, 3, 0, 0x7f, 0, 6};
static const uint8_t ask_all[8] = {0x50, 3, 0, 0x34, 0, 12, 0x09, 0x80};
static const uint8_t refused[5] = {0x50, 0x83, 2, 0x91, 0x20};

static void greeting(struct script *s)
{
    uint8_t version[7] = {0x50, 3, 2, 0, 7};
    sealed(version, 5);
    sealed(ask_version, 6);
    sealed(ask_serial, 6);
    add_step(s, ask_version, version, 7);
    add_step(s, ask_serial, refused, 5);
}

// The map and some words after it; returns the frame's size.
static int frame_with(int padding, uint8_t frame[64])
{
    uint16_t r[24] = {0};
    int words = 12 + padding;
    set_pose(r, 45, 1, 45);
    frame[0] = 0x50, frame[1] = 3, frame[2] = (uint8_t)(2 * words);
    for (int i = 0; i < words; i++) {
        frame[3 + 2 * i] = r[i] >> 8;
        frame[4 + 2 * i] = r[i] & 255;
    }
    sealed(frame, 3 + 2 * words);
    return 5 + 2 * words;
}

static void good_frame(uint8_t frame[29])
{
    uint8_t whole[64];
    memcpy(frame, whole, (size_t)frame_with(0, whole));
}

// After so many failures.
static const uint8_t *ask_with(int padding)
{
    static uint8_t request[8];
    memcpy(request, ask_all, 6);
    request[5] = (uint8_t)(12 + padding);
    sealed(request, 6);
    return request;
}

static void the_published_frames_go_over_the_wire(void **state)
{
    (void)state;
    struct script script = {0};
    struct pty pty;
    struct error err = {0};
    struct tilt_sample s;
    struct instrument_identity who;
    uint8_t frame[29];
    greeting(&script);
    good_frame(frame);
    add_step(&script, ask_all, frame, 29);
    assert_true(pty_start(&pty, play, &script));
    struct accelerometer_options options = options_for(pty.path);
    struct accelerometer *a = driver()->open(&options, soon(), &err);
    assert_non_null(a);
    driver()->identify(a, &who);
    assert_string_equal(who.serial, "");
    assert_false(who.emulated);
    assert_true(driver()->read(a, soon(), &s, &err));
    assert_near(s.tilt_deg, 45, 0.05);
    driver()->close(a);
    pty_stop(&pty); // the peer's thread is over: only now is its count
    assert_int_equal(script.unlike, 0);
    assert_int_equal(script.done, 3);
}

static void a_bad_line_costs_readings_and_no_more(void **state)
{
    (void)state;
    struct script script = {0};
    struct pty pty;
    struct error err = {0};
    struct tilt_sample s;
    uint8_t good[29], broken[29], other[29], whole[64];
    greeting(&script);
    good_frame(good);
    memcpy(broken, good, 29), broken[8] ^= 0x10;
    memcpy(other, good, 29), other[0] = 0x51, sealed(other, 27);
    enum { CUT_SHORT = 2 };
    add_step(&script, ask_all, broken, 29);
    add_step(&script, ask_with(1), other, 29);
    add_step(&script, ask_with(2), good, 11);
    add_step(&script, ask_with(3), refused, 5);
    add_step(&script, ask_with(4), whole, frame_with(4, whole));
    assert_true(pty_start(&pty, play, &script));
    struct accelerometer_options options = options_for(pty.path);
    struct accelerometer *a = driver()->open(&options, soon(), &err);
    assert_non_null(a);
    for (int i = 0; i < 4; i++) {
        no_rest = i == CUT_SHORT;
        assert_false(driver()->read(a, soon(), &s, &err));
        assert_int_equal(err.code, ERROR_RETRY);
    }
    assert_non_null(strstr(err.text, "Illegal data address"));
    assert_true(driver()->read(a, soon(), &s, &err));
    assert_near(s.tilt_deg, 45, 0.05);
    assert_int_equal(script.unlike, 0);
    driver()->close(a);
    pty_stop(&pty);
}

static void a_late_answer_does_not_pass_for_the_one_that_is_awaited(void **state)
{
    (void)state;
    struct script script = {0};
    struct pty pty;
    struct error err = {0};
    struct tilt_sample s;
    uint8_t late[29], whole[64];
    greeting(&script);
    good_frame(late);
    add_step(&script, ask_all, late, 0);
    add_step(&script, ask_with(1), late, 29);
    add_step(&script, ask_with(2), whole, frame_with(2, whole));
    assert_true(pty_start(&pty, play, &script));
    struct accelerometer_options options = options_for(pty.path);
    struct accelerometer *a = driver()->open(&options, soon(), &err);
    assert_non_null(a);
    no_answer = true;
    assert_false(driver()->read(a, clock_now_ns() + 30 * NS_PER_MS, &s, &err));
    no_answer = false;
    assert_false(driver()->read(a, soon(), &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_true(driver()->read(a, soon(), &s, &err));
    assert_int_equal(script.unlike, 0);
    driver()->close(a);
    pty_stop(&pty);
}

static void a_silent_sensor_is_given_up_by_the_deadline(void **state)
{
    (void)state;
    struct script script = {0};
    struct pty pty;
    struct error err = {0};
    struct tilt_sample s;
    greeting(&script);
    assert_true(pty_start(&pty, play, &script));
    struct accelerometer_options options = options_for(pty.path);
    struct accelerometer *a = driver()->open(&options, soon(), &err);
    assert_non_null(a);
    no_answer = true;
    for (int i = 0; i < 5; i++) {
        assert_false(driver()->read(a, clock_now_ns() + 30 * NS_PER_MS, &s, &err));
        assert_int_equal(err.code, i < 4 ? ERROR_RETRY : ERROR_GONE);
    }
    no_answer = false;
    driver()->close(a);
    pty_stop(&pty);
}

static void a_port_that_cannot_be_is_told_apart_from_one_that_is_absent(void **state)
{
    (void)state;
    struct error err = {0};
    struct accelerometer_options options = options_for("/dev/no-such-line");
    assert_null(driver()->open(&options, soon(), &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "/dev/no-such-line"));
    options = options_for("some.host.name:502");
    assert_null(driver()->open(&options, soon(), &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    options = options_for("127.0.0.1:1");
    assert_null(driver()->open(&options, soon(), &err));
    assert_int_equal(err.code, ERROR_GONE);
    driver()->close(NULL);
}

struct gateway {
    modbus_t *bus;
    int listening, port;
    uint8_t unit; // what it writes into its answers
    int answers;  // how many it gives before it says no more
    pthread_t thread;
};

// One connection; answers every request with unit, as a confused gateway may.
static void *run_gateway(void *context)
{
    struct gateway *g = context;
    uint8_t query[MODBUS_MAX_ADU_LENGTH];
    struct sensor sensor = sensor_new();
    int connection = modbus_tcp_accept(g->bus, &g->listening);
    for (int count; (count = modbus_receive(g->bus, query)) >= 0;) {
        query[6] = g->unit;
        if (count > 0 && g->answers-- > 0)
            modbus_reply(g->bus, query, count, sensor.registers);
    }
    if (connection >= 0)
        close(connection);
    modbus_mapping_free(sensor.registers);
    return NULL;
}

static void start_gateway(struct gateway *g, uint8_t unit, int answers)
{
    struct sockaddr_in address;
    socklen_t size = sizeof address;
    g->unit = unit;
    g->answers = answers;
    g->bus = modbus_new_tcp("127.0.0.1", 0);
    g->listening = modbus_tcp_listen(g->bus, 1);
    assert_true(g->listening >= 0);
    assert_int_equal(getsockname(g->listening, (struct sockaddr *)&address, &size), 0);
    g->port = ntohs(address.sin_port);
    assert_int_equal(pthread_create(&g->thread, NULL, run_gateway, g), 0);
}

static void stop_gateway(struct gateway *g)
{
    pthread_join(g->thread, NULL);
    close(g->listening);
    modbus_free(g->bus);
}

static void a_gateway_must_answer_for_the_unit_that_was_asked(void **state)
{
    (void)state;
    const uint8_t units[] = {0x50, 0x51};
    for (int i = 0; i < 2; i++) {
        struct gateway g;
        struct error err = {0};
        struct tilt_sample s;
        start_gateway(&g, units[i], INT_MAX);
        struct accelerometer_options options = options_for("");
        snprintf(options.port, sizeof options.port, "localhost:%d", g.port);
        struct accelerometer *a = driver()->open(&options, soon(), &err);
        assert_int_equal(a != NULL, units[i] == 0x50);
        if (a) {
            assert_true(driver()->read(a, soon(), &s, &err));
            assert_near(s.tilt_deg, 30, 0.05);
        } else {
            assert_non_null(strstr(err.text, "unit 81 answered for unit 80"));
        }
        driver()->close(a);
        stop_gateway(&g);
    }
}

// A connection may be dead with nobody left at its far end to say so.
static void a_connection_that_says_nothing_is_given_up_sooner_than_a_line(void **state)
{
    (void)state;
    enum { GREETING = 2, MOST = 3 };
    struct gateway g;
    struct error err = {0};
    struct tilt_sample s;
    start_gateway(&g, 0x50, GREETING);
    struct accelerometer_options options = options_for("");
    snprintf(options.port, sizeof options.port, "127.0.0.1:%d", g.port);
    struct accelerometer *a = driver()->open(&options, soon(), &err);
    assert_non_null(a);
    no_answer = true;
    for (int i = 1; i <= MOST; i++) {
        assert_false(driver()->read(a, clock_now_ns() + 30 * NS_PER_MS, &s, &err));
        assert_int_equal(err.code, i < MOST ? ERROR_RETRY : ERROR_GONE);
    }
    no_answer = false;
    driver()->close(a);
    stop_gateway(&g);
}

// A node that root alone may open, looked at by nobody.
static void what_may_not_be_opened_names_the_udev_rules(void **state)
{
    (void)state;
    char path[] = "/tmp/boothd-test-XXXXXX";
    struct error err = {0};
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    assert_int_equal(chmod(path, 0), 0);
    bool root = geteuid() == 0;
    if (root)
        assert_int_equal(seteuid(65534), 0);
    struct accelerometer_options options = options_for(path);
    void *opened = driver()->open(&options, soon(), &err);
    if (root)
        assert_int_equal(seteuid(0), 0);
    unlink(path);
    assert_null(opened);
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_non_null(strstr(err.text, UDEV_RULES_FILE));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tilt_is_right_at_all_quadrants),
        cmocka_unit_test(the_published_angles_decode),
        cmocka_unit_test(gravity_and_the_angle_register_must_agree),
        cmocka_unit_test(an_offset_turns_both_tilts_around_the_circle),
        cmocka_unit_test(the_wrong_map_shows_as_implausible),
        cmocka_unit_test(a_served_sensor_is_read_and_named),
        cmocka_unit_test(the_published_frames_go_over_the_wire),
        cmocka_unit_test(a_bad_line_costs_readings_and_no_more),
        cmocka_unit_test(a_late_answer_does_not_pass_for_the_one_that_is_awaited),
        cmocka_unit_test(a_silent_sensor_is_given_up_by_the_deadline),
        cmocka_unit_test(a_port_that_cannot_be_is_told_apart_from_one_that_is_absent),
        cmocka_unit_test(what_may_not_be_opened_names_the_udev_rules),
        cmocka_unit_test(a_gateway_must_answer_for_the_unit_that_was_asked),
        cmocka_unit_test(a_connection_that_says_nothing_is_given_up_sooner_than_a_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
