// SPDX-License-Identifier: Apache-2.0
// boothcal tilt and tracker on an emulated booth that is not built as its settings
// say: what they find is the truth within what they state, and boothd goes by it.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

// The booth as it is, and nowhere in boothd's settings.
static const struct {
    const char *name;
    double value;
} STAND[] = {{"hinge_m y", 0.012},
             {"hinge_m z", -0.008},
             {"centre_from_hinge_m x", 0.003},
             {"centre_from_hinge_m y", 0.196},
             {"centre_from_hinge_m z", 0.034},
             {"turned_deg 1", 1.5},
             {"turned_deg 2", -2},
             {"turned_deg 3", 3}},
  TRACKER[] = {{"place_m x", 0.02}, {"place_m y", 0.36}, {"place_m z", -0.19},
               {"pitch_deg", 11.5}, {"yaw_deg", -2},     {"roll_deg", 1.5}};
enum { STAND_COUNT = 8, TRACKER_COUNT = 6 };

// Expanded uncertainties (k = 2) of 14 values: twice that is four standard ones, which
// noise exceeds in one run of a thousand; half of them within it once.
static const double BEYOND = 2, WITHIN = 1;
static const double SOLVED = 1e-5;   // from another start
static const double TILT_DEG = 0.15; // without the fit it would be 1.5 off
static const double EYE_M = 0.02;    // … 0.05

static struct booth_here here;
static struct control_client *daemon_client, *booth_client;
static char config[300];
static double found[STAND_COUNT]; // of the stand, live

static void exchange(char *text, size_t size, const char *from, const char *to)
{
    static char rest[16384];
    char *at = strstr(text, from);
    assert_non_null(at);
    snprintf(rest, sizeof rest, "%s", at + strlen(from));
    snprintf(at, size - (size_t)(at - text), "%s%s", to, rest);
}

static void put_scenario(void)
{
    static char text[16384];
    read_words("simulator/scenarios/booth.ini", text, sizeof text - 1000);
    exchange(text, sizeof text, "hinge_m = 0 0 0\ncentre_from_hinge_m = 0 0.20 0.03",
             "hinge_m = 0 0.012 -0.008\ncentre_from_hinge_m = 0.003 0.196 0.034");
    exchange(text, sizeof text, "place_m = 0 0.35 -0.20\npitch_deg = 10",
             "place_m = 0.02 0.36 -0.19\npitch_deg = 11.5\nyaw_deg = -2\nroll_deg = 1.5");
    strcat(text, "\n[inclinometer]\nturned_deg = 1.5 -2 3\n");
    folder_put(&here.folder, "booth.ini", text);
}

static void put_settings(void)
{
    static char text[16384];
    char materials[512], more[1024];
    assert_non_null(realpath("config/materials", materials));
    read_words("config/booths/emulated.conf", text, sizeof text - 2000);
    exchange(text, sizeof text, "hinge_m = 0 0 0\ncentre_from_hinge_m = 0 0.20 0.03\n", "");
    exchange(text, sizeof text, "place_m = 0 0.35 -0.20\npitch_deg = 10\n", "");
    exchange(text, sizeof text, "model = display.ini", "serial = panel 1\noutput = offscreen");
    exchange(text, sizeof text, "folder = lamps", "");
    snprintf(more, sizeof more,
             "\n[materials]\nfolder = %s\n[control]\nsocket = boothd.sock\n"
             "[calibration]\nstore = store\n",
             materials);
    strcat(text, more);
    snprintf(config, sizeof config, "%s", folder_put(&here.folder, "run/boothd.conf", text));
}

static int open_booth(void **state)
{
    (void)state;
    char scenario[256], run[256];
    folder_open(&here.folder);
    put_scenario();
    put_settings();
    snprintf(scenario, sizeof scenario, "%s", folder_at(&here.folder, "booth.ini"));
    snprintf(run, sizeof run, "%s", folder_at(&here.folder, "run"));
    const char *argv[] = {
        program_path("boothsim"), "--no-xvfb", "--scenario", scenario, "--run", run, "--",
        program_path("boothd"),   "--config",  config,       NULL};
    here.booth = start_program(argv, folder_at(&here.folder, "log"));
    daemon_client = connect_to(folder_at(&here.folder, "run/boothd.sock"), here.booth);
    booth_client = control_connect(folder_at(&here.folder, "run/boothsim.sock"), NULL);
    return daemon_client && booth_client ? 0 : -1;
}

static int close_booth(void **state)
{
    (void)state;
    control_close(daemon_client);
    control_close(booth_client);
    return booth_close(&here);
}

// Runs boothcal and gives what it says as JSON.
static json_t *boothcal(const char *command, const char *option, const char *value, int code)
{
    char words[512];
    snprintf(words, sizeof words, "%s", folder_at(&here.folder, "words"));
    const char *argv[] = {program_path("boothcal"),
                          command,
                          "--config",
                          config,
                          "--json",
                          option,
                          value,
                          option && !strcmp(option, "--booth") ? "--store" : NULL,
                          "--keep",
                          folder_at(&here.folder, command),
                          NULL};
    int ended = run_program(argv, words);
    static char text[65536];
    read_words(words, text, sizeof text);
    if (ended != code)
        print_error("%s\n", text);
    assert_int_equal(ended, code);
    json_t *report = json_loads(text, JSON_DISABLE_EOF_CHECK, NULL);
    assert_non_null(report);
    return report;
}

static double number(const json_t *report, int index, const char *name, const char *key)
{
    const json_t *value = json_array_get(json_object_get(report, "values"), (size_t)index);
    assert_string_equal(json_string_value(json_object_get(value, "name")), name);
    return json_number_value(json_object_get(value, key));
}

// Checks one value against the truth; whether it lies within its uncertainty.
static bool is_found(const json_t *report, int index, const char *name, double truth)
{
    double off = number(report, index, name, "value") - truth;
    double u = number(report, index, name, "uncertainty");
    print_message("%-24s off by %8.5f, +- %.5f\n", name, off, u);
    assert_true(u > 0);
    assert_true(fabs(off) <= BEYOND * u);
    return fabs(off) <= WITHIN * u;
}

static void the_stand_and_the_inclinometer_are_found_as_they_are(void **state)
{
    (void)state;
    int within = 0;
    char socket[300];
    snprintf(socket, sizeof socket, "%s", folder_at(&here.folder, "run/boothsim.sock"));
    json_t *report = boothcal("tilt", "--booth", socket, 0);
    for (int i = 0; i < STAND_COUNT; i++) {
        within += is_found(report, i, STAND[i].name, STAND[i].value);
        found[i] = number(report, i, STAND[i].name, "value");
    }
    assert_true(within >= STAND_COUNT / 2);
    assert_int_equal(json_integer_value(json_object_get(report, "version")), 1);
    json_decref(report);
}

static void poses_kept_in_a_file_give_the_same_again(void **state)
{
    (void)state;
    char poses[300];
    snprintf(poses, sizeof poses, "%s", folder_at(&here.folder, "poses.csv"));
    assert_int_equal(rename(folder_at(&here.folder, "tilt"), poses), 0);
    json_t *report = boothcal("tilt", "--poses", poses, 0);
    for (int i = 0; i < STAND_COUNT; i++)
        assert_near(number(report, i, STAND[i].name, "value"), found[i], SOLVED);
    json_decref(report);
}

static void the_tracker_is_found_where_it_is(void **state)
{
    (void)state;
    int within = 0;
    char socket[300];
    snprintf(socket, sizeof socket, "%s", folder_at(&here.folder, "run/boothsim.sock"));
    json_t *report = boothcal("tracker", "--booth", socket, 0);
    for (int i = 0; i < TRACKER_COUNT; i++)
        within += is_found(report, i, TRACKER[i].name, TRACKER[i].value);
    assert_true(within >= TRACKER_COUNT / 2);
    assert_int_equal(json_integer_value(json_object_get(report, "version")), 2);
    json_decref(report);
}

static double distance(const json_t *a, const double b[3])
{
    double sum = 0;
    for (size_t i = 0; i < 3; i++) {
        double d = json_number_value(json_array_get(a, i)) - b[i];
        sum += d * d;
    }
    return sqrt(sum);
}

static void the_daemon_goes_by_what_was_found(void **state)
{
    (void)state;
    static const double EYE[] = {0.05, 0.5, 0.6};
    json_decref(control_call(booth_client, json_pack("{ss,sf}", "do", "tilt", "deg", 40.0),
                             BOOTH_CALL_MS, NULL));
    json_decref(control_call(
        booth_client, json_pack("{ss,s[fff]}", "do", "head", "eye_m", EYE[0], EYE[1], EYE[2]),
        BOOTH_CALL_MS, NULL));
    double tilt = 0, eye = 1;
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    do {
        json_t *status = booth_status(daemon_client);
        tilt = dig_real(status, "tilt.tilt_deg");
        eye = distance(dig(status, "eye.eye_m"), EYE);
        bool second = dig_real(status, "calibration.version") == 2;
        json_decref(status);
        if (second && fabs(tilt - 40) <= TILT_DEG && eye <= EYE_M)
            break;
        clock_sleep_until_ns(clock_now_ns() + 50 * NS_PER_MS);
    } while (clock_now_ns() < until_ns);
    assert_near(tilt, 40, TILT_DEG);
    assert_near(eye, 0, EYE_M);
}

static void a_lamp_taught_alone_becomes_a_version_of_the_store_too(void **state)
{
    (void)state;
    char socket[300];
    snprintf(socket, sizeof socket, "%s", folder_at(&here.folder, "run/boothsim.sock"));
    const char *teach[] = {program_path("boothcal"),
                           "light",
                           "teach",
                           "D65",
                           "--config",
                           config,
                           "--booth",
                           socket,
                           "--drift",
                           "20",
                           "--readings",
                           "3",
                           NULL};
    const char *list[] = {program_path("boothcal"), "light", "list", "--config", config, NULL};
    char text[4096];
    assert_int_equal(run_program(teach, folder_at(&here.folder, "words")), 0);
    assert_holds(read_words(folder_at(&here.folder, "words"), text, sizeof text),
                 "0003/lamps/D65.ini: ");
    assert_int_equal(run_program(list, folder_at(&here.folder, "words")), 0);
    assert_holds(read_words(folder_at(&here.folder, "words"), text, sizeof text), "D65");
    json_t *status = booth_status(daemon_client);
    assert_near(dig_real(status, "calibration.version"), 3, 0);
    assert_near(dig_real(status, "lamp.taught"), 1, 0);
    json_decref(status);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_stand_and_the_inclinometer_are_found_as_they_are),
        cmocka_unit_test(poses_kept_in_a_file_give_the_same_again),
        cmocka_unit_test(the_tracker_is_found_where_it_is),
        cmocka_unit_test(the_daemon_goes_by_what_was_found),
        cmocka_unit_test(a_lamp_taught_alone_becomes_a_version_of_the_store_too),
    };
    return cmocka_run_group_tests(tests, open_booth, close_booth);
}
