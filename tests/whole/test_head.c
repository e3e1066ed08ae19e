// SPDX-License-Identifier: Apache-2.0
// The emulated camera in each of its formats, and a fourth marker, all the way
// to where boothd believes the eye to be.
#include "tests/fakes/support.h"

#include "tests/fakes/folder.h"
#include "tests/whole/running.h"

enum { CALL_MS = 60000, LOOKS = 40 };

static const double EYE_M = 0.02; // the camera's pixels in depth, smoothed; at arm's length
static const double PLACES_M[][3] = {{0.10, 0.50, 0.70}, {-0.15, 0.60, 0.60}};

struct wearing {
    bool fourth;              // the head wears a fourth marker
    const char *format, *set; // of the settings
};

static json_t *call(struct control_client *client, json_t *request)
{
    json_t *reply = control_call(client, request, CALL_MS, NULL);
    assert_non_null(reply);
    return reply;
}

static double off_by(struct control_client *daemon, const double place[3], bool *runs)
{
    double eye[3] = {0};
    const char *state = "";
    json_t *status = call(daemon, json_pack("{ss}", "do", "status"));
    assert_int_equal(json_unpack(status, "{s{s[FFF]}, s{s{s:s}}}", "eye", "eye_m", &eye[0], &eye[1],
                                 &eye[2], "instruments", "tracker", "state", &state),
                     0);
    *runs = !strcmp(state, "running");
    json_decref(status);
    return hypot(hypot(eye[0] - place[0], eye[1] - place[1]), eye[2] - place[2]);
}

// The eye comes to the place and stays there.
static void check_place(struct control_client *daemon, struct control_client *booth,
                        const double place[3])
{
    double off = INFINITY, squares = 0;
    bool runs = false;
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    json_decref(
        call(booth, json_pack("{ss,s[fff]}", "do", "head", "eye_m", place[0], place[1], place[2])));
    while ((off > EYE_M || !runs) && clock_now_ns() < until_ns) {
        off = off_by(daemon, place, &runs);
        clock_sleep_until_ns(clock_now_ns() + 10 * NS_PER_MS);
    }
    assert_true(runs && off <= EYE_M);
    for (int i = 0; i < LOOKS; i++) {
        off = off_by(daemon, place, &runs);
        squares += off * off / LOOKS;
        clock_sleep_until_ns(clock_now_ns() + 10 * NS_PER_MS);
    }
    print_message("%.1f mm rms off\n", 1000 * sqrt(squares));
    assert_true(sqrt(squares) < EYE_M);
}

static void put_files(struct folder *here, bool fourth)
{
    static char text[8192], whole[12288];
    char materials[512];
    assert_non_null(realpath("config/materials", materials));
    read_words("simulator/scenarios/booth.ini", text, sizeof text);
    char *head = strstr(text, "[head]\n");
    assert_non_null(head);
    snprintf(whole, sizeof whole, "%.*s[head]\nfourth = %s\n%s", (int)(head - text), text,
             fourth ? "yes" : "no", head + strlen("[head]\n"));
    folder_put(here, "booth.ini", whole);
    read_words("config/booths/emulated.conf", text, sizeof text);
    snprintf(whole, sizeof whole, "%s\n[materials]\nfolder = %s\n[control]\nsocket = boothd.sock\n",
             text, materials);
    folder_put(here, "run/boothd.conf", whole);
}

static void check(const struct wearing *w)
{
    struct folder here;
    char run[256], scenario[256], config[256], format[64];
    folder_open(&here);
    put_files(&here, w->fourth);
    snprintf(run, sizeof run, "%s", folder_at(&here, "run"));
    snprintf(scenario, sizeof scenario, "%s", folder_at(&here, "booth.ini"));
    snprintf(config, sizeof config, "%s", folder_at(&here, "run/boothd.conf"));
    snprintf(format, sizeof format, "tracker.format=%s", w->format);
    const char *argv[] = {program_path("boothsim"),
                          "--scenario",
                          scenario,
                          "--run",
                          run,
                          "--no-xvfb",
                          "--",
                          program_path("boothd"),
                          "--config",
                          config,
                          "--set",
                          format,
                          "--set",
                          w->set,
                          NULL};
    pid_t pid = start_program(argv, folder_at(&here, "log"));
    struct control_client *daemon = connect_to(folder_at(&here, "run/boothd.sock"), pid);
    struct control_client *booth = connect_to(folder_at(&here, "run/boothsim.sock"), pid);
    assert_true(daemon && booth);
    for (size_t i = 0; i < sizeof PLACES_M / sizeof *PLACES_M; i++)
        check_place(daemon, booth, PLACES_M[i]);
    control_close(daemon);
    control_close(booth);
    kill(pid, SIGTERM);
    assert_int_equal(await_program(pid), 0);
    folder_close(&here);
}

static void the_basic_format_places_the_eye(void **state)
{
    (void)state;
    check(&(struct wearing){false, "basic", "tracker.fourth_m=0 0 0"});
}

static void the_full_format_and_a_fourth_marker_place_the_eye(void **state)
{
    (void)state;
    check(&(struct wearing){true, "full", "tracker.fourth_m=0.06 0.03 -0.02"});
}

static void a_fourth_marker_that_nobody_told_of_does_no_harm(void **state)
{
    (void)state;
    check(&(struct wearing){true, "extended", "tracker.fourth_m=0 0 0"});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_basic_format_places_the_eye),
        cmocka_unit_test(the_full_format_and_a_fourth_marker_place_the_eye),
        cmocka_unit_test(a_fourth_marker_that_nobody_told_of_does_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
