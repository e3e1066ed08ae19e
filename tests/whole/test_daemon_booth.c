// SPDX-License-Identifier: Apache-2.0
// boothd in the emulated booth: a technician's first hour, faults included.
// The tests follow one another in one running booth.
#include "tests/fakes/support.h"

#include "colorimetry/colour.h"
#include "files/exr.h"
#include "tests/fakes/folder.h"
#include "tests/whole/proof_files.h"
#include "tests/whole/running.h"

enum { CALL_MS = 60000 };

static const double TILT_DEG = 0.1; // the emulated inclinometer's noise and steps
static const double EYE_M = 0.02;   // the camera's pixels, at arm's length
static const double LEVEL = 0.01;   // noise of a reading, smoothed
static const double LIGHT = 0.01;   // three spot readings scale the map, noise and all
static const double CEILING_W = 0.90, CEILING_D = 0.60, CEILING_Z = 0.05; // m
static const double BESIDE_M = 0.006;   // half of what the radiometer sees, and aiming's error
static const double SPOT_MOST = 20000;  // cd/m2: brighter ones may overload the radiometer
static const double PANEL_WHITE = 1500;  // cd/m2, at its centre
static const double WHITE_SHARE = 0.02; // its warm-up, the radiometer's error

static struct folder here;
static pid_t booth_pid;
static struct control_client *daemon_client, *booth_client;

static json_t *call(struct control_client *client, json_t *request)
{
    struct error err = {0};
    json_t *reply = control_call(client, request, CALL_MS, &err);
    if (!reply)
        print_error("%s\n", err.text);
    assert_non_null(reply);
    return reply;
}

static json_t *ask(json_t *request)
{
    return call(daemon_client, request);
}

static void turn(json_t *request)
{
    json_decref(call(booth_client, request));
}

static const json_t *dig(const json_t *object, const char *path)
{
    char key[64];
    for (const char *end; object && *path; path = *end ? end + 1 : end) {
        end = strchr(path, '.');
        end = end ? end : path + strlen(path);
        snprintf(key, sizeof key, "%.*s", (int)(end - path), path);
        object = json_object_get(object, key);
    }
    return object;
}

static double real(const json_t *object, const char *path)
{
    const json_t *value = dig(object, path);
    if (!json_is_number(value)) {
        print_error("no number %s\n", path);
        _fail(__FILE__, __LINE__);
    }
    return json_number_value(value);
}

static const char *text(const json_t *object, const char *path)
{
    const char *value = json_string_value(dig(object, path));
    return value ? value : "";
}

// The status as soon as a text in it is what is wanted.
static json_t *await_text(const char *path, const char *wanted)
{
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    for (;;) {
        json_t *status = ask(json_pack("{ss}", "do", "status"));
        if (!strcmp(text(status, path), wanted))
            return status;
        if (clock_now_ns() > until_ns) {
            print_error("%s stayed \"%s\", not \"%s\"\n", path, text(status, path), wanted);
            _fail(__FILE__, __LINE__);
        }
        json_decref(status);
        clock_sleep_until_ns(clock_now_ns() + 20 * NS_PER_MS);
    }
}

static json_t *await_near(const char *path, double wanted, double tolerance)
{
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    for (;;) {
        json_t *status = ask(json_pack("{ss}", "do", "status"));
        if (fabs(real(status, path) - wanted) <= tolerance)
            return status;
        if (clock_now_ns() > until_ns) {
            print_error("%s stayed %g, not %g\n", path, real(status, path), wanted);
            _fail(__FILE__, __LINE__);
        }
        json_decref(status);
        clock_sleep_until_ns(clock_now_ns() + 20 * NS_PER_MS);
    }
}

static void put_settings(void)
{
    static char shipped[8192], whole[12288];
    char materials[512];
    assert_non_null(realpath("config/materials", materials));
    read_words("config/booths/emulated.conf", shipped, sizeof shipped);
    snprintf(whole, sizeof whole,
             "%s\n[materials]\nfolder = %s\n[control]\nsocket = boothd.sock\n"
             "[state]\nlamp_hold_s = 1\n",
             shipped, materials);
    folder_put(&here, "run/boothd.conf", whole);
}

static int open_booth(void **state)
{
    (void)state;
    folder_open(&here);
    put_settings();
    char run[256], config[256];
    snprintf(run, sizeof run, "%s", folder_at(&here, "run"));
    snprintf(config, sizeof config, "%s", folder_at(&here, "run/boothd.conf"));
    const char *argv[] = {program_path("boothsim"),
                          "--scenario",
                          "simulator/scenarios/booth.ini",
                          "--run",
                          run,
                          "--",
                          program_path("boothd"),
                          "--config",
                          config,
                          NULL};
    booth_pid = start_program(argv, folder_at(&here, "log"));
    daemon_client = connect_to(folder_at(&here, "run/boothd.sock"), booth_pid);
    booth_client = connect_to(folder_at(&here, "run/boothsim.sock"), booth_pid);
    if (!daemon_client || !booth_client) {
        static char log[8192];
        print_error("%s\n", read_words(folder_at(&here, "log"), log, sizeof log));
        return -1;
    }
    return 0;
}

static int close_booth(void **state)
{
    (void)state;
    control_close(daemon_client);
    control_close(booth_client);
    if (booth_pid > 0) {
        kill(booth_pid, SIGTERM);
        await_program(booth_pid);
    }
    folder_close(&here);
    return 0;
}

static void every_instrument_runs_and_says_that_it_is_emulated(void **state)
{
    (void)state;
    static const char *const polled[] = {"spectrometer", "accelerometer", "tracker"};
    for (int i = 0; i < 3; i++) {
        char path[64];
        snprintf(path, sizeof path, "instruments.%s.state", polled[i]);
        json_decref(await_text(path, "running"));
    }
    json_t *status = ask(json_pack("{ss}", "do", "status"));
    assert_true(json_is_true(dig(status, "emulated")));
    assert_true(json_is_true(dig(status, "instruments.spectrometer.emulated")));
    assert_true(json_is_true(dig(status, "instruments.accelerometer.emulated")));
    assert_holds(text(status, "instruments.spectrometer.serial"), "EMU");
    assert_string_equal(text(status, "instruments.accelerometer.serial"), "EMUWT901");
    assert_string_equal(text(status, "instruments.radiometer.state"), "idle");
    json_decref(status);
    json_decref(await_text("lamp.verdict", "unknown")); // nothing was taught
}

static void tilt_and_eye_follow_the_booth(void **state)
{
    (void)state;
    turn(json_pack("{ss,sf}", "do", "tilt", "deg", 47.5));
    json_decref(await_near("tilt.tilt_deg", 47.5, TILT_DEG));
    turn(json_pack("{ss,sf}", "do", "tilt", "deg", 30.0));
    json_decref(await_near("tilt.tilt_deg", 30, TILT_DEG));
    turn(json_pack("{ss,s[fff]}", "do", "head", "eye_m", 0.1, 0.5, 0.7));
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    double off = INFINITY;
    while (off > EYE_M && clock_now_ns() < until_ns) {
        json_t *status = ask(json_pack("{ss}", "do", "status"));
        const json_t *eye = dig(status, "eye.eye_m");
        double x = json_number_value(json_array_get(eye, 0)) - 0.1;
        double y = json_number_value(json_array_get(eye, 1)) - 0.5;
        double z = json_number_value(json_array_get(eye, 2)) - 0.7;
        off = sqrt(x * x + y * y + z * z);
        json_decref(status);
    }
    assert_true(off <= EYE_M);
}

static double measured_Y(double r, double g, double b)
{
    json_decref(ask(json_pack("{ss,s[fff]}", "do", "patch", "rgb", r, g, b)));
    json_t *reading = ask(json_pack("{ss,sf}", "do", "measure", "timeout_s", 50.0));
    double Y = json_number_value(json_array_get(dig(reading, "XYZ"), 1));
    assert_true(json_is_true(dig(reading, "emulated")));
    assert_holds(text(reading, "serial"), "EMU");
    assert_int_equal(json_array_size(dig(reading, "nm")), json_array_size(dig(reading, "values")));
    assert_true(json_array_size(dig(reading, "nm")) > 50);
    assert_near(json_number_value(json_array_get(dig(reading, "shown.rgb"), 0)), r, 1e-12);
    json_decref(reading);
    return Y;
}

static void the_radiometer_reads_the_patch_that_was_shown(void **state)
{
    (void)state;
    turn(json_pack("{ss,ss}", "do", "lamp", "name", "none"));
    json_decref(await_text("lamp.verdict", "none"));
    double white = measured_Y(1, 1, 1), black = measured_Y(0, 0, 0);
    assert_near(white, PANEL_WHITE, WHITE_SHARE * PANEL_WHITE);
    assert_true(black < 0.01 * white);
    double grey = measured_Y(0.5, 0.5, 0.5);
    assert_true(grey > 0.1 * white && grey < 0.4 * white); // some gamma near 2.2
}

// The mean of the ceiling's map about a place, and how uneven it is there.
static double map_about(const struct exr *map, double x_m, double z_m, double *uneven)
{
    double sum = 0, least = INFINITY, most = 0, step = CEILING_W / map->width;
    const float *Y = map->pixels + (size_t)exr_channel(map, "Y") * map->width * map->height;
    int column = (int)((x_m / CEILING_W + 0.5) * map->width);
    int row = (int)(((z_m - CEILING_Z) / CEILING_D + 0.5) * map->height), n = 0;
    int reach = (int)ceil(BESIDE_M / step);
    for (int y = row - reach; y <= row + reach; y++)
        for (int x = column - reach; x <= column + reach; x++) {
            if (x < 0 || y < 0 || x >= map->width || y >= map->height)
                continue;
            double v = Y[y * map->width + x];
            sum += v, n++;
            least = fmin(least, v);
            most = fmax(most, v);
        }
    *uneven = (most - least) * n / sum;
    return sum / n;
}

// What a spot of the ceiling reads over what the map says, at the taught level.
static double scale_at(const struct exr *map, double x_m, double z_m, double taught_lux)
{
    double uneven, said = map_about(map, x_m, z_m, &uneven);
    json_t *before = ask(json_pack("{ss}", "do", "status"));
    turn(json_pack("{ss,ss,sf,sf}", "do", "aim", "target", "ceiling", "x_m", x_m, "z_m", z_m));
    json_t *reading = ask(json_pack("{ss,sf}", "do", "measure", "timeout_s", 50.0));
    json_t *after = ask(json_pack("{ss}", "do", "status"));
    double Y = json_number_value(json_array_get(dig(reading, "XYZ"), 1));
    double level = (real(before, "lamp.lux") + real(after, "lamp.lux")) / 2 / taught_lux;
    json_decref(before);
    json_decref(reading);
    json_decref(after);
    return Y / said / level;
}

// Three even and bright places of the map, one in each third of its width.
static double map_scale(const char *lamp, double taught_lux)
{
    struct exr map;
    char name[64];
    double scale[3];
    snprintf(name, sizeof name, "run/ceiling-%s.exr", lamp);
    assert_true(exr_load(folder_at(&here, name), &map, NULL));
    for (int third = 0; third < 3; third++) {
        double best = -INFINITY, x_m = 0, z_m = 0, uneven;
        for (int i = 0; i < 16; i++)
            for (int j = 0; j < 24; j++) {
                double x = CEILING_W * ((third * 16 + i + 0.5) / 48 - 0.5);
                double z = CEILING_Z + CEILING_D * ((j + 0.5) / 24 - 0.5);
                double Y = map_about(&map, x, z, &uneven);
                double worth = Y > 500 && Y < SPOT_MOST ? -uneven : -INFINITY;
                if (worth > best) {
                    best = worth;
                    x_m = x;
                    z_m = z;
                }
            }
        assert_true(isfinite(best));
        scale[third] = scale_at(&map, x_m, z_m, taught_lux);
    }
    exr_fini(&map);
    print_message("%s: the map is scaled by %.4f, %.4f, %.4f\n", lamp, scale[0], scale[1],
                  scale[2]);
    return (scale[0] + scale[1] + scale[2]) / 3;
}

static void teach(const char *lamp)
{
    struct spectrum s;
    char facts[512], name[64];
    turn(json_pack("{ss,ss}", "do", "lamp", "name", lamp));
    clock_sleep_until_ns(clock_now_ns() + NS_PER_S); // the exposure is found anew
    json_t *reply = ask(json_pack("{ss,ss,si}", "do", "teach", "lamp", lamp, "readings", 5));
    assert_int_equal(json_array_size(dig(reply, "irradiance")), SPECTRUM_COUNT);
    for (size_t i = 0; i < SPECTRUM_COUNT; i++)
        s.v[i] = json_number_value(json_array_get(dig(reply, "irradiance"), i));
    assert_near(real(reply, "lux"), xyz_absolute(&s, OBSERVER_1931_2).Y, 1e-6 * real(reply, "lux"));
    assert_true(real(reply, "spread") > 0 && real(reply, "spread") < 0.05);
    const json_t *sigma = json_array_get(dig(reply, "sigma"), 555 - SPECTRUM_FIRST_NM);
    assert_true(json_number_value(sigma) > 0);
    assert_true(json_number_value(sigma) < 0.05 * s.v[555 - SPECTRUM_FIRST_NM]);
    snprintf(name, sizeof name, "run/lamps/%s.sp", lamp);
    folder_put(&here, name, "");
    write_spectrum(folder_at(&here, name), &s);
    snprintf(facts, sizeof facts,
             "[lamp]\nname = %s\nspectrum = %s.sp\nspread = %.9g\ntaught_lux = %.9g\n"
             "map = ../ceiling-%s.exr\nmap_scale = %.9g\n",
             lamp, lamp, real(reply, "spread"), real(reply, "lux"), lamp,
             map_scale(lamp, real(reply, "lux")));
    snprintf(name, sizeof name, "run/lamps/%s.ini", lamp);
    folder_put(&here, name, facts);
    json_decref(reply);
}

static void taught_lamps_are_recognised_when_they_are_switched(void **state)
{
    (void)state;
    static const char *const lamps[] = {"A", "D50", "D65"};
    for (int i = 0; i < 3; i++)
        teach(lamps[i]);
    write_display(folder_at(&here, "run/display.ini"), PANEL_WHITE);
    json_decref(ask(json_pack("{ss}", "do", "reload")));
    json_decref(ask(json_pack("{ss,ss}", "do", "show", "material", "white")));
    for (int i = 0; i < 6; i++) {
        turn(json_pack("{ss,ss}", "do", "lamp", "name", lamps[i % 3]));
        json_t *status = await_text("lamp.name", lamps[i % 3]);
        assert_string_equal(text(status, "lamp.verdict"), "known");
        json_decref(status);
        json_decref(await_text("scene", "surface"));
    }
}

static double lux_off(void)
{
    json_t *probe = ask(json_pack("{ss,si,si}", "do", "probe", "x_px", 640, "y_px", 400));
    json_t *truth =
        call(booth_client, json_pack("{ss,si,si}", "do", "truth", "x_px", 640, "y_px", 400));
    double off = real(probe, "lux") / real(truth, "lux") - 1;
    json_decref(probe);
    json_decref(truth);
    return off;
}

static void the_light_on_the_screen_is_the_booths_and_follows_dimmer_and_tilt(void **state)
{
    (void)state;
    double bright = lux_off();
    print_message("the light is off by %+.2f %%\n", 100 * bright);
    assert_near(bright, 0, LIGHT);
    turn(json_pack("{ss,ss,sf}", "do", "lamp", "name", "D65", "level", 0.6));
    json_t *status = await_near("lamp.level", 0.6, LEVEL);
    assert_string_equal(text(status, "lamp.name"), "D65"); // a dimmed lamp stays itself
    json_decref(status);
    assert_near(lux_off(), bright, LIGHT);
    turn(json_pack("{ss,sf}", "do", "tilt", "deg", 10.0));
    json_decref(await_near("tilt.tilt_deg", 10, TILT_DEG));
    assert_near(lux_off(), 0, LIGHT);
    turn(json_pack("{ss,ss,sf}", "do", "lamp", "name", "D65", "level", 1.0));
    json_decref(await_near("lamp.level", 1, LEVEL));
}

static void a_dark_booth_makes_a_dark_screen(void **state)
{
    (void)state;
    turn(json_pack("{ss,ss}", "do", "lamp", "name", "none"));
    json_t *status = await_text("lamp.verdict", "none");
    assert_string_equal(text(status, "scene"), "dark");
    json_decref(status);
    turn(json_pack("{ss,ss}", "do", "lamp", "name", "D65"));
    json_decref(await_text("lamp.name", "D65"));
}

static void fault(const char *instrument, const char *kind)
{
    turn(json_pack("{ss,ss,ss}", "do", "fault", "instrument", instrument, "kind", kind));
}

static void an_unplugged_spectrometer_leaves_the_lamp_and_comes_back(void **state)
{
    (void)state;
    fault("spectrometer", "unplugged");
    json_decref(await_text("instruments.spectrometer.state", "waiting"));
    json_t *status = await_text("lamp.standing", "stale");
    assert_string_equal(text(status, "lamp.name"), "D65");
    assert_string_equal(text(status, "scene"), "surface");
    assert_true(json_is_false(dig(status, "valid")));
    assert_true(*text(status, "instruments.spectrometer.last_error"));
    assert_string_equal(text(status, "instruments.accelerometer.state"), "running");
    json_decref(status);
    fault("spectrometer", "fine");
    json_decref(await_text("instruments.spectrometer.state", "running"));
    status = await_text("lamp.standing", "fresh");
    assert_true(json_is_true(dig(status, "valid")));
    json_decref(status);
}

static void an_unplugged_inclinometer_and_a_camera_come_back_too(void **state)
{
    (void)state;
    fault("inclinometer", "unplugged");
    json_decref(await_text("instruments.accelerometer.state", "waiting"));
    json_decref(await_text("tilt.standing", "stale"));
    json_decref(await_near("tilt.tilt_deg", 10, TILT_DEG)); // the last good one
    fault("inclinometer", "fine");
    json_decref(await_text("instruments.accelerometer.state", "running"));
    fault("camera", "unplugged");
    json_decref(await_text("instruments.tracker.state", "waiting"));
    fault("camera", "fine");
    json_decref(await_text("instruments.tracker.state", "running"));
    json_decref(await_text("eye.standing", "fresh"));
}

static void others_are_served_while_the_radiometer_is_silent(void **state)
{
    (void)state;
    struct error err = {0};
    struct control_client *patient = control_connect(folder_at(&here, "run/boothd.sock"), &err);
    assert_non_null(patient);
    fault("radiometer", "silent");
    // Sent, and given up waiting at once: the reading goes on.
    assert_null(
        control_call(patient, json_pack("{ss,sf}", "do", "measure", "timeout_s", 3.0), 1, &err));
    for (int i = 0; i < 20; i++)
        json_decref(ask(json_pack("{ss}", "do", "status")));
    json_decref(ask(json_pack("{ss,ss}", "do", "show", "material", "grey18")));
    control_close(patient);
    json_t *reply = control_call(
        daemon_client, json_pack("{ss,sf}", "do", "measure", "timeout_s", 3.0), CALL_MS, &err);
    assert_null(reply);
    assert_int_equal(err.code, ERROR_RETRY);
    fault("radiometer", "fine");
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    while (!reply && clock_now_ns() < until_ns)
        reply = control_call(
            daemon_client, json_pack("{ss,sf}", "do", "measure", "timeout_s", 30.0), CALL_MS, &err);
    assert_non_null(reply);
    json_decref(reply);
}

static void quitting_ends_daemon_and_booth_even_while_the_radiometer_is_awaited(void **state)
{
    (void)state;
    struct error err = {0};
    struct control_client *patient = control_connect(folder_at(&here, "run/boothd.sock"), &err);
    assert_non_null(patient);
    fault("radiometer", "silent");
    assert_null(
        control_call(patient, json_pack("{ss,sf}", "do", "measure", "timeout_s", 600.0), 1, &err));
    json_decref(ask(json_pack("{ss}", "do", "status"))); // behind it in the queue of requests
    json_decref(ask(json_pack("{ss}", "do", "quit")));
    control_close(patient);
    int status = await_program(booth_pid);
    booth_pid = 0;
    if (status) {
        static char log[16384];
        print_error("%s\n", read_words(folder_at(&here, "log"), log, sizeof log));
    }
    assert_int_equal(status, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_instrument_runs_and_says_that_it_is_emulated),
        cmocka_unit_test(tilt_and_eye_follow_the_booth),
        cmocka_unit_test(the_radiometer_reads_the_patch_that_was_shown),
        cmocka_unit_test(taught_lamps_are_recognised_when_they_are_switched),
        cmocka_unit_test(the_light_on_the_screen_is_the_booths_and_follows_dimmer_and_tilt),
        cmocka_unit_test(a_dark_booth_makes_a_dark_screen),
        cmocka_unit_test(an_unplugged_spectrometer_leaves_the_lamp_and_comes_back),
        cmocka_unit_test(an_unplugged_inclinometer_and_a_camera_come_back_too),
        cmocka_unit_test(others_are_served_while_the_radiometer_is_silent),
        cmocka_unit_test(quitting_ends_daemon_and_booth_even_while_the_radiometer_is_awaited),
    };
    return cmocka_run_group_tests(tests, open_booth, close_booth);
}
