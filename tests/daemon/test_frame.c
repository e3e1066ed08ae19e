// SPDX-License-Identifier: Apache-2.0
// Frames that cannot be drawn, and what is said of them; what waits when the
// control socket closes. Off screen, without instruments.
#include "tests/fakes/support.h"

#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "daemon/requests.h"
#include "daemon/serve.h"
#include "tests/fakes/folder.h"

enum { WIDTH = 64, HEIGHT = 40, FINE = 0, BROKEN = 1 };

static struct folder here;
static struct stage {
    struct booth booth;
    struct setup setup;
    struct lamp lamps[2];
    struct light_points lights[2];
    struct light_point light;
    int64_t now_ns;
} s;

// Linear curves, sRGB's primaries.
static void make_display(struct display_model *m)
{
    static const double primaries[3][4] = {
        {412.4, 357.6, 180.5, 0}, {212.6, 715.2, 72.2, 0}, {19.3, 119.2, 950.5, 0}};
    *m = (struct display_model){.name = "panel"};
    memcpy(m->matrix, primaries, sizeof primaries);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < DISPLAY_NODES; k++)
            m->curve[c][k] = k / (DISPLAY_NODES - 1.0);
    assert_true(display_model_prepare(m, NULL));
}

// Lamp 1 holds no light: no material can be baked under it.
static void make_setup(void)
{
    struct setup *u = &s.setup;
    struct spectrum white;
    booth_preset(&u->settings);
    u->settings.screen = (struct screen){0.52, 0.325, WIDTH, HEIGHT};
    u->settings.spectrometer.driver = u->settings.accelerometer.driver = 0;
    u->settings.tracker.driver = u->settings.radiometer.driver = 0;
    make_display(&u->display);
    u->has_display = true;
    s.light = (struct light_point){{0, 0.75, 0.05}, 800};
    for (int i = 0; i < 2; i++)
        s.lights[i] = (struct light_points){1, &s.light};
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        s.lamps[FINE].irradiance.v[i] = 0.01;
        white.v[i] = 1;
    }
    strcpy(s.lamps[FINE].file.name, "fine");
    strcpy(s.lamps[BROKEN].file.name, "broken");
    u->lamps = (struct lamps){2, s.lamps};
    u->lights = s.lights;
    u->lights_generation = 1;
    u->generations = 9;
    u->baked_lamp = -1;
    assert_true(material_flat("white", &white, &u->material, NULL));
    strcpy(u->material_name, "white");
    u->show = SHOW_MATERIAL;
}

static int open_stage(void **state)
{
    (void)state;
    struct renderer_options options = {.width = WIDTH, .height = HEIGHT, .bits = 8};
    struct acquire_from nothing = {0};
    struct classifier taught = {0};
    s = (struct stage){.now_ns = 1000 * NS_PER_S};
    folder_open(&here);
    make_setup();
    s.booth.setup = &s.setup;
    s.booth.renderer = renderer_create(&options, NULL);
    s.booth.instruments = acquire_start(&nothing, NULL);
    assert_non_null(s.booth.renderer);
    assert_non_null(s.booth.instruments);
    estimator_init(&s.booth.estimator, &s.setup.settings, &taught);
    s.booth.shown = s.booth.state = s.booth.estimator.state;
    return 0;
}

static int close_stage(void **state)
{
    (void)state;
    renderer_destroy(s.booth.renderer);
    assert_true(acquire_stop(s.booth.instruments, INT64_MAX));
    material_fini(&s.setup.material);
    free(s.setup.texels);
    folder_close(&here);
    return 0;
}

static bool under(int lamp, struct error *err)
{
    s.booth.estimator.state.lamp.index = lamp;
    s.booth.estimator.state.lamp.level = 1;
    s.booth.estimator.state.lamp.verdict = LAMP_KNOWN;
    s.now_ns += 20 * NS_PER_MS;
    return frame(&s.booth, s.now_ns, false, err);
}

static int brightest(void)
{
    uint8_t *counts = renderer_counts(s.booth.renderer, NULL);
    int most = 0;
    assert_non_null(counts);
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
        most = counts[i] > most ? counts[i] : most;
    free(counts);
    return most;
}

// Seen as fresh, so that only what is on the screen decides.
static json_t *status_now(enum display_ramp ramp)
{
    static struct snapshot now;
    struct instruments_report none = {0};
    snapshot_take(&s.booth, &now);
    now.state.lamp.belief.standing = STANDING_FRESH;
    now.output.ramp = ramp;
    return status_json(&now, &none, "", s.now_ns);
}

static bool is_valid(enum display_ramp ramp)
{
    json_t *status = status_now(ramp);
    bool valid = json_is_true(json_object_get(status, "valid"));
    json_decref(status);
    return valid;
}

static void what_cannot_be_shown_leaves_a_black_screen_and_its_reason(void **state)
{
    (void)state;
    struct error err = {0};
    assert_true(under(FINE, &err));
    assert_true(brightest() > 50);
    assert_true(is_valid(RAMP_NONE));
    assert_false(under(BROKEN, &err));
    assert_holds(err.text, "dark");
    assert_int_equal(brightest(), 0); // not the proof of the other lamp
    assert_false(is_valid(RAMP_NONE));
    json_t *status = status_now(RAMP_NONE);
    assert_string_equal(json_string_value(json_object_get(status, "scene")), "dark");
    assert_holds(json_string_value(json_object_get(status, "failure")), "broken");
    char *warnings = json_dumps(json_object_get(status, "warnings"), 0);
    assert_holds(warnings, "kept black: showing white under broken");
    free(warnings);
    json_decref(status);
    assert_true(under(FINE, &err)); // another lamp counts at once
    assert_true(brightest() > 50);
    assert_true(is_valid(RAMP_NONE));
}

static void the_same_failure_is_said_again_but_tried_again_after_a_while(void **state)
{
    (void)state;
    struct error err = {0};
    assert_false(under(BROKEN, &err));
    assert_false(s.booth.blind);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        s.lamps[BROKEN].irradiance.v[i] = 0.01; // repaired
    assert_false(under(BROKEN, &err));
    assert_holds(err.text, "dark");
    s.now_ns += NS_PER_S;
    assert_true(under(BROKEN, &err));
    assert_true(brightest() > 50);
    assert_int_equal(s.booth.failure.code, ERROR_NONE);
}

static void a_bent_gamma_ramp_makes_no_valid_proof(void **state)
{
    (void)state;
    assert_true(under(FINE, NULL));
    assert_true(is_valid(RAMP_NEUTRAL));
    assert_true(is_valid(RAMP_UNKNOWN)); // a warning only
    assert_false(is_valid(RAMP_BENT));
    json_t *status = status_now(RAMP_BENT);
    const json_t *output = json_object_get(status, "output");
    assert_string_equal(json_string_value(json_object_get(output, "ramp")), "not neutral");
    assert_int_equal(json_integer_value(json_object_get(output, "bits")), 8);
    json_decref(status);
}

static void fewer_bits_than_the_settings_say_are_a_warning(void **state)
{
    (void)state;
    s.setup.settings.display.bits_choice = 1;
    assert_true(under(FINE, NULL));
    json_t *status = status_now(RAMP_NONE);
    char *warnings = json_dumps(json_object_get(status, "warnings"), 0);
    assert_holds(warnings, "8 bits a channel, not the 10");
    free(warnings);
    json_decref(status);
}

// ---- the control socket's end ----------------------------------------------

struct talk {
    struct mailbox snapshots;
    struct desk *desk;
    struct jobs *jobs;
    struct serve *serve;
};

static void begin_talk(struct talk *t)
{
    static struct snapshot now;
    snapshot_take(&s.booth, &now);
    assert_true(mailbox_init(&t->snapshots, sizeof now));
    mailbox_post(&t->snapshots, &now);
    t->jobs = jobs_create(NULL);
    t->desk = desk_open(&s.setup.settings, s.booth.instruments, NULL);
    struct serve_with with = {&t->snapshots, s.booth.instruments, t->desk, t->jobs, "now"};
    t->serve = serve_start(folder_at(&here, "s"), &with, NULL);
    assert_non_null(t->serve);
}

static void end_talk(struct talk *t)
{
    assert_true(desk_close(t->desk, INT64_MAX));
    jobs_destroy(t->jobs);
    mailbox_fini(&t->snapshots);
}

static int say(const char *line)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "%s", folder_at(&here, "s"));
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    assert_int_equal(write(fd, line, strlen(line)), strlen(line));
    return fd;
}

static void what_still_waits_is_refused_when_the_socket_closes(void **state)
{
    (void)state;
    struct talk t;
    char reply[512] = "";
    begin_talk(&t);
    int fd = say("{\"do\":\"show\",\"material\":\"white\"}\n"); // nobody takes it
    struct pollfd waiting = {jobs_fd(t.jobs), POLLIN, 0};
    assert_int_equal(poll(&waiting, 1, 20000), 1);
    serve_stop(t.serve);
    assert_true(read(fd, reply, sizeof reply - 1) > 0);
    assert_holds(reply, "\"gone\"");
    assert_holds(reply, "stopping");
    close(fd);
    end_talk(&t);
}

// poll(2) refuses more descriptors than a process may have.
static void a_control_thread_that_cannot_wait_says_that_it_ended(void **state)
{
    (void)state;
    struct talk t;
    struct rlimit before, few;
    begin_talk(&t);
    assert_false(serve_ended(t.serve));
    assert_int_equal(getrlimit(RLIMIT_NOFILE, &before), 0);
    few = (struct rlimit){4, before.rlim_max};
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &few), 0);
    int64_t until_ns = clock_now_ns() + 20 * NS_PER_S;
    while (!serve_ended(t.serve) && clock_now_ns() < until_ns)
        clock_sleep_until_ns(clock_now_ns() + 5 * NS_PER_MS);
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &before), 0);
    assert_true(serve_ended(t.serve));
    serve_stop(t.serve);
    end_talk(&t);
}

#define STAGED(test) cmocka_unit_test_setup_teardown(test, open_stage, close_stage)

int main(void)
{
    const struct CMUnitTest tests[] = {
        STAGED(what_cannot_be_shown_leaves_a_black_screen_and_its_reason),
        STAGED(the_same_failure_is_said_again_but_tried_again_after_a_while),
        STAGED(a_bent_gamma_ramp_makes_no_valid_proof),
        STAGED(fewer_bits_than_the_settings_say_are_a_warning),
        STAGED(what_still_waits_is_refused_when_the_socket_closes),
        STAGED(a_control_thread_that_cannot_wait_says_that_it_ended),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
