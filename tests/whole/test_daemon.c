// SPDX-License-Identifier: Apache-2.0
// boothd and boothctl as processes, off screen and without instruments.
#include "tests/fakes/support.h"

#include "colorimetry/colour.h"
#include "files/exr.h"
#include "tests/fakes/folder.h"
#include "tests/fakes/manager.h"
#include "tests/whole/picture.h"
#include "tests/whole/proof_files.h"
#include "tests/whole/running.h"

enum { WIDTH = 160, HEIGHT = 100, CALL_MS = 60000 };

// The test's booth: an even ceiling, a lamp of even power, a display of gamma 2.2.
static const double CEILING_CDM2 = 5000, CENTRE_Y = 0.75, CENTRE_Z = 0.05;
static const double CEILING_W = 0.9, CEILING_D = 0.6, SCREEN_Y = 0.2, SCREEN_Z = 0.03;
static const double REFLECTANCE = 0.002, WHITE_CDM2 = 900;
static const double LIGHTS_ERROR = 0.002; // 256 light points instead of an even ceiling
static const double FLOAT_ERROR = 1e-4;   // relative: the GPU computes in float
static const double HALF_A_CODE = 0.5 / 255;

static struct folder here;
static struct manager manager;
static pid_t daemon_pid;
static struct control_client *client;

static void put_lamp(void)
{
    struct spectrum even;
    struct exr map;
    char facts[256];
    mkdir(folder_at(&here, "lamps"), 0755);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        even.v[i] = 0.02;
    write_spectrum(folder_at(&here, "lamps/even.sp"), &even);
    snprintf(facts, sizeof facts,
             "[lamp]\nname = even\nspectrum = even.sp\ntaught_lux = %.9g\nmap = even.exr\n",
             xyz_absolute(&even, OBSERVER_1931_2).Y);
    folder_put(&here, "lamps/even.ini", facts);
    assert_true(exr_init(&map, 90, 60, 1, NULL));
    strcpy(map.names[0], "Y");
    for (int i = 0; i < 90 * 60; i++)
        map.pixels[i] = (float)CEILING_CDM2;
    assert_true(exr_save(folder_at(&here, "lamps/even.exr"), &map, NULL));
    exr_fini(&map);
}

static void put_display(const char *name)
{
    write_display(folder_at(&here, name), WHITE_CDM2);
}

static const char *settings_text(const char *more)
{
    static char text[4096];
    char materials[512];
    assert_non_null(realpath("config/materials", materials));
    snprintf(text, sizeof text,
             "[booth]\nname = test booth\n"
             "[screen]\nwidth_m = 0.52\nheight_m = 0.325\nwidth_px = %d\nheight_px = %d\n"
             "[stand]\ncentre_from_hinge_m = 0 0 0.2\ndefault_tilt_deg = 0\nhinge_m = 0 0 %g\n"
             "[ceiling]\ncentre_m = 0 %g %g\nwidth_m = %g\ndepth_m = %g\n"
             "[spectrometer]\ndriver = none\n[accelerometer]\ndriver = none\n"
             "[tracker]\ndriver = none\n[radiometer]\ndriver = none\n"
             "[display]\nmodel = display.ini\noutput = offscreen\nreflectance = %g\n"
             "[materials]\nfolder = %s\n[quality]\nlights = 256\n"
             "[control]\nsocket = boothd.sock\n%s",
             WIDTH, HEIGHT, SCREEN_Z, CENTRE_Y, CENTRE_Z, CEILING_W, CEILING_D, REFLECTANCE,
             materials, more);
    return text;
}

static void begin(const char *more)
{
    const char *config = folder_put(&here, "b.conf", settings_text(more));
    const char *argv[] = {program_path("boothd"), "--config", config, NULL};
    daemon_pid = start_program(argv, folder_at(&here, "log"));
    client = connect_to(folder_at(&here, "boothd.sock"), daemon_pid);
    if (!client) {
        char log[2048];
        print_error("%s\n", read_words(folder_at(&here, "log"), log, sizeof log));
        _fail(__FILE__, __LINE__);
    }
}

static void end(void)
{
    control_close(client);
    client = NULL;
    kill(daemon_pid, SIGTERM);
    int status = await_program(daemon_pid);
    daemon_pid = 0;
    if (status) {
        char log[8192];
        print_error("%s\n", read_words(folder_at(&here, "log"), log, sizeof log));
    }
    assert_int_equal(status, 0);
    assert_int_not_equal(access(folder_at(&here, "boothd.sock"), F_OK), 0);
}

static int open_bare(void **state)
{
    (void)state;
    unsetenv("NOTIFY_SOCKET");
    folder_open(&here);
    return 0;
}

static int open_full(void **state)
{
    open_bare(state);
    put_lamp();
    put_display("display.ini");
    return 0;
}

static int close_all(void **state)
{
    (void)state;
    control_close(client);
    client = NULL;
    if (daemon_pid > 0) {
        kill(daemon_pid, SIGKILL);
        await_program(daemon_pid);
        daemon_pid = 0;
    }
    folder_close(&here);
    return 0;
}

static json_t *ask(json_t *request)
{
    struct error err = {0};
    json_t *reply = control_call(client, request, CALL_MS, &err);
    if (!reply)
        print_error("%s\n", err.text);
    assert_non_null(reply);
    return reply;
}

static void refused(json_t *request, enum error_code code, const char *part)
{
    struct error err = {0};
    json_t *reply = control_call(client, request, CALL_MS, &err);
    assert_null(reply);
    assert_int_equal(err.code, code);
    assert_holds(err.text, part);
}

static double real(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    if (!json_is_number(value)) {
        print_error("no number \"%s\"\n", key);
        _fail(__FILE__, __LINE__);
    }
    return json_number_value(value);
}

static const char *text(const json_t *object, const char *key)
{
    const char *value = json_string_value(json_object_get(object, key));
    return value ? value : "";
}

static double element(const json_t *object, const char *key, size_t i)
{
    return json_number_value(json_array_get(json_object_get(object, key), i));
}

static uint8_t *capture_png(void)
{
    int width = 0, height = 0;
    const char *file = folder_at(&here, "shot.png");
    json_decref(ask(json_pack("{ss,ss}", "do", "capture", "file", file)));
    uint8_t *pixels = picture_read(file, &width, &height);
    assert_non_null(pixels);
    assert_int_equal(width, WIDTH);
    assert_int_equal(height, HEIGHT);
    return pixels;
}

// ---- bare: no display model, no lamps --------------------------------------

static void a_bare_daemon_says_what_is_missing_and_shows_patches(void **state)
{
    (void)state;
    begin("");
    json_t *status = ask(json_pack("{ss}", "do", "status"));
    assert_string_equal(text(status, "booth"), "test booth");
    assert_string_equal(text(status, "scene"), "dark");
    assert_true(json_is_false(json_object_get(status, "valid")));
    assert_true(json_is_false(json_object_get(status, "emulated")));
    assert_true(json_is_null(json_object_get(status, "display")));
    char *warnings = json_dumps(json_object_get(status, "warnings"), 0);
    assert_holds(warnings, "display.ini is not there yet");
    assert_holds(warnings, "no lamp was taught yet");
    free(warnings);
    json_decref(status);
    static const double patches[][3] = {{1, 1, 1}, {0, 0, 0}, {1, 0.5, 0.2}, {0.003, 0.9, 0.25}};
    for (size_t i = 0; i < sizeof patches / sizeof *patches; i++) {
        json_decref(ask(json_pack("{ss,s[fff]}", "do", "patch", "rgb", patches[i][0], patches[i][1],
                                  patches[i][2])));
        uint8_t *pixels = capture_png();
        for (int p = 0; p < WIDTH * HEIGHT; p++)
            for (int c = 0; c < 3; c++)
                assert_int_equal(pixels[3 * p + c], (int)floor(255 * patches[i][c] + 0.5));
        free(pixels);
    }
    status = ask(json_pack("{ss}", "do", "status"));
    assert_string_equal(text(status, "scene"), "patch");
    assert_near(element(status, "rgb", 1), 0.9, 1e-12);
    json_decref(status);
    end();
}

static void a_material_without_lamp_or_display_stays_dark_with_a_reason(void **state)
{
    (void)state;
    begin("");
    json_t *reply = ask(json_pack("{ss,ss}", "do", "show", "material", "white"));
    assert_string_equal(text(reply, "scene"), "dark");
    assert_true(json_array_size(json_object_get(reply, "warnings")) >= 3);
    json_decref(reply);
    uint8_t *pixels = capture_png();
    for (int p = 0; p < 3 * WIDTH * HEIGHT; p++)
        assert_int_equal(pixels[p], 0);
    free(pixels);
    end();
}

static void every_bad_request_is_refused_by_name_and_hurts_nobody(void **state)
{
    (void)state;
    begin("");
    refused(json_pack("{ss}", "do", "dance"), ERROR_RANGE, "dance");
    refused(json_pack("{ss}", "do", "show"), ERROR_RANGE, "material");
    refused(json_pack("{ss,ss}", "do", "show", "material", "nothing"), ERROR_CONFIG,
            "colorchecker24");
    refused(json_pack("{ss,ss,ss}", "do", "show", "material", "white", "patch", "x"), ERROR_RANGE,
            "\"x\"");
    refused(json_pack("{ss,ss}", "do", "show", "material", "/nowhere/m.ini"), ERROR_CONFIG,
            "/nowhere/m.ini");
    refused(json_pack("{ss,s[ff]}", "do", "patch", "rgb", 0.5, 0.5), ERROR_RANGE, "rgb");
    refused(json_pack("{ss,s[fff]}", "do", "patch", "rgb", 0.5, 1.5, 0.5), ERROR_RANGE, "1.5");
    refused(json_pack("{ss,s[ffs]}", "do", "patch", "rgb", 0.5, 0.5, "x"), ERROR_RANGE,
            "number 3 must be");
    refused(json_pack("{ss,s[fff],si}", "do", "patch", "rgb", 0.5, 0.5, 0.5, "gamma", 2),
            ERROR_RANGE, "gamma");
    refused(json_pack("{ss,ss}", "do", "capture", "file", "shot.png"), ERROR_RANGE, "whole path");
    refused(json_pack("{ss,ss}", "do", "capture", "file", "/tmp/shot.jpg"), ERROR_RANGE, ".png");
    refused(json_pack("{ss,ss}", "do", "capture", "file", "/nowhere/shot.png"), ERROR_SYSTEM,
            "/nowhere");
    refused(json_pack("{ss,ss}", "do", "capture", "file", folder_at(&here, "a.exr")), ERROR_RANGE,
            "no material");
    refused(json_pack("{ss,si,si}", "do", "probe", "x_px", 0, "y_px", 0), ERROR_RANGE, "");
    refused(json_pack("{ss,si}", "do", "probe", "x_px", 1), ERROR_RANGE, "y_px");
    refused(json_pack("{ss,sf,si}", "do", "probe", "x_px", 1.5, "y_px", 1), ERROR_RANGE, "1.5");
    refused(json_pack("{ss}", "do", "measure"), ERROR_CONFIG, "no radiometer");
    refused(json_pack("{ss,sf}", "do", "measure", "timeout_s", -1.0), ERROR_RANGE, "timeout_s");
    refused(json_pack("{ss,ss}", "do", "teach", "lamp", "A"), ERROR_CONFIG, "no spectrometer");
    refused(json_pack("{ss,ss}", "do", "teach", "lamp", "../A"), ERROR_RANGE, "../A");
    refused(json_pack("{ss}", "do", "raw"), ERROR_CONFIG, "no spectrometer");
    refused(json_pack("{ss,si}", "do", "raw", "readings", 1001), ERROR_RANGE, "readings: 1001");
    refused(json_pack("{ss,ss,si}", "do", "teach", "lamp", "A", "readings", 0), ERROR_RANGE,
            "readings");
    json_decref(ask(json_pack("{ss}", "do", "status")));
    end();
}

static void quit_is_answered_and_ends_the_daemon(void **state)
{
    (void)state;
    begin("");
    json_decref(ask(json_pack("{ss}", "do", "quit")));
    assert_int_equal(await_program(daemon_pid), 0);
    daemon_pid = 0;
    assert_int_not_equal(access(folder_at(&here, "boothd.sock"), F_OK), 0);
}

static void the_service_manager_hears_ready_signs_of_life_and_stopping(void **state)
{
    (void)state;
    assert_true(manager_open(&manager, here.path));
    setenv("NOTIFY_SOCKET", manager.path, 1);
    setenv("WATCHDOG_USEC", "400000", 1);
    begin("");
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    assert_true(manager_hears(&manager, "READY=1", CALL_MS));
    assert_true(manager_hears(&manager, "WATCHDOG=1", CALL_MS));
    assert_holds(manager.heard, "STATUS=no lamp");
    end();
    assert_true(manager_hears(&manager, "STOPPING=1", CALL_MS));
    assert_int_equal(manager_count(&manager, "READY=1"), 1);
    manager_close(&manager);
}

static void a_second_daemon_does_not_take_the_socket(void **state)
{
    (void)state;
    char words[2048];
    begin("");
    const char *argv[] = {program_path("boothd"), "--config", folder_at(&here, "b.conf"), NULL};
    assert_int_equal(run_program(argv, folder_at(&here, "second")), 2);
    assert_holds(read_words(folder_at(&here, "second"), words, sizeof words), "boothd.sock");
    json_decref(ask(json_pack("{ss}", "do", "status")));
    end();
}

static void bad_settings_end_with_2_and_one_line(void **state)
{
    (void)state;
    static const struct {
        const char *more, *part;
    } bad[] = {
        {"[state]\nlamp_hold_s = long\n", "lamp_hold_s"},
        {"[materials2]\n", "materials2"},
        {"[state]\nhold = 1\n", "hold"},
    };
    char words[2048];
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *config = folder_put(&here, "bad.conf", settings_text(bad[i].more));
        for (int check = 0; check < 2; check++) {
            const char *argv[] = {program_path("boothd"), "--config", config,
                                  check ? "--check" : NULL, NULL};
            assert_int_equal(run_program(argv, folder_at(&here, "words")), 2);
            read_words(folder_at(&here, "words"), words, sizeof words);
            assert_holds(words, bad[i].part);
            assert_holds(words, "bad.conf:");
            assert_ptr_equal(strchr(words, '\n'), words + strlen(words) - 1);
        }
    }
}

static void check_says_what_a_proof_still_needs(void **state)
{
    (void)state;
    char words[2048];
    char config[256];
    snprintf(config, sizeof config, "%s", folder_put(&here, "b.conf", settings_text("")));
    const char *argv[] = {program_path("boothd"), "--config", config, "--check", NULL};
    assert_int_equal(run_program(argv, folder_at(&here, "words")), 3);
    assert_holds(read_words(folder_at(&here, "words"), words, sizeof words), "display.ini");
    put_lamp();
    put_display("display.ini");
    assert_int_equal(run_program(argv, folder_at(&here, "words")), 0);
    folder_put(&here, "display.ini", "[display]\nname = broken\n");
    assert_int_equal(run_program(argv, folder_at(&here, "words")), 2);
    assert_holds(read_words(folder_at(&here, "words"), words, sizeof words), "display.ini");
}

// ---- full: a lamp taken for granted, a display -----------------------------

// Illuminance at the screen's centre, flat below an even ceiling, by brute force.
static double centre_lux(void)
{
    enum { NX = 900, NZ = 600 };
    double sum = 0, height = CENTRE_Y;
    for (int j = 0; j < NZ; j++)
        for (int i = 0; i < NX; i++) {
            double x = CEILING_W * ((i + 0.5) / NX - 0.5);
            double z = CENTRE_Z + CEILING_D * ((j + 0.5) / NZ - 0.5) - SCREEN_Z;
            double y = height - SCREEN_Y, d2 = x * x + y * y + z * z;
            sum += y * y / (d2 * d2);
        }
    return CEILING_CDM2 * sum * CEILING_W * CEILING_D / (NX * NZ);
}

#define FLAT "[lamps]\nfolder = lamps\ndeclared = even\n"

static void white_on_the_screen_has_the_luminance_of_a_white_card(void **state)
{
    (void)state;
    begin(FLAT);
    json_t *reply = ask(json_pack("{ss,ss}", "do", "show", "material", "white"));
    assert_string_equal(text(reply, "scene"), "surface");
    json_decref(reply);
    json_t *probe =
        ask(json_pack("{ss,si,si}", "do", "probe", "x_px", WIDTH / 2, "y_px", HEIGHT / 2));
    double lux = centre_lux(), pi = acos(-1);
    assert_near(real(probe, "lux"), lux, LIGHTS_ERROR * lux);
    assert_near(element(probe, "surface", 1), lux / pi, LIGHTS_ERROR * lux / pi);
    assert_near(element(probe, "emitted", 1), (1 - REFLECTANCE) * lux / pi,
                LIGHTS_ERROR * lux / pi);
    struct exr light;
    const char *file = folder_at(&here, "shot.exr");
    json_decref(ask(json_pack("{ss,ss}", "do", "capture", "file", file)));
    assert_true(exr_load(file, &light, NULL));
    int centre = HEIGHT / 2 * WIDTH + WIDTH / 2;
    for (int c = 0; c < 3; c++) {
        const char name[2] = {"XYZ"[c], 0};
        double value = light.pixels[exr_channel(&light, name) * WIDTH * HEIGHT + centre];
        assert_near(value, element(probe, "emitted", c), FLOAT_ERROR * value);
    }
    exr_fini(&light);
    json_decref(probe);
    end();
}

static void dithered_counts_average_to_what_the_reference_wants(void **state)
{
    (void)state;
    begin(FLAT);
    json_decref(ask(json_pack("{ss,ss}", "do", "show", "material", "grey18")));
    uint8_t *pixels = capture_png();
    double sum[3] = {0}, wanted[3] = {0};
    int count = 0;
    for (int y = HEIGHT / 2 - 16; y < HEIGHT / 2 + 16; y += 1)
        for (int x = WIDTH / 2 - 32; x < WIDTH / 2 + 32; x += 1, count++)
            for (int c = 0; c < 3; c++)
                sum[c] += pixels[3 * (y * WIDTH + x) + c] / 255.0;
    int probes = 0;
    for (int y = HEIGHT / 2 - 12; y < HEIGHT / 2 + 16; y += 8)
        for (int x = WIDTH / 2 - 28; x < WIDTH / 2 + 32; x += 8, probes++) {
            json_t *p = ask(json_pack("{ss,si,si}", "do", "probe", "x_px", x, "y_px", y));
            for (int c = 0; c < 3; c++) {
                double rgb = element(p, "rgb", c);
                wanted[c] += rgb;
                // each pixel is one of the two codes around what is wanted
                assert_near(pixels[3 * (y * WIDTH + x) + c] / 255.0, rgb, 2 * HALF_A_CODE + 1e-4);
            }
            json_decref(p);
        }
    free(pixels);
    for (int c = 0; c < 3; c++)
        assert_near(sum[c] / count, wanted[c] / probes, HALF_A_CODE / 5);
    end();
}

static void a_patch_of_the_chart_fills_the_screen_and_the_chart_does_not(void **state)
{
    (void)state;
    begin(FLAT);
    json_decref(
        ask(json_pack("{ss,ss,ss}", "do", "show", "material", "colorchecker24", "patch", "blue")));
    json_t *corner = ask(json_pack("{ss,si,si}", "do", "probe", "x_px", 0, "y_px", 0));
    json_t *centre =
        ask(json_pack("{ss,si,si}", "do", "probe", "x_px", WIDTH / 2, "y_px", HEIGHT / 2));
    for (int c = 0; c < 3; c++)
        assert_near(element(corner, "surface", c) / real(corner, "lux"),
                    element(centre, "surface", c) / real(centre, "lux"), 1e-9);
    json_t *status = ask(json_pack("{ss}", "do", "status"));
    assert_string_equal(text(status, "material"), "colorchecker24");
    assert_string_equal(text(status, "patch"), "blue");
    assert_string_equal(text(json_object_get(status, "lamp"), "name"), "even");
    assert_string_equal(text(json_object_get(status, "lamp"), "standing"), "preset");
    assert_true(json_is_false(json_object_get(status, "valid"))); // nobody saw the lamp
    json_decref(status);
    json_decref(corner);
    json_decref(centre);
    json_decref(ask(json_pack("{ss,ss}", "do", "show", "material", "colorchecker24")));
    uint8_t *pixels = capture_png();
    int different = 0;
    for (int p = 1; p < WIDTH * HEIGHT; p++)
        different += abs(pixels[3 * p] - pixels[3 * p - 3]) > 20;
    assert_true(different > 4 * HEIGHT); // six patches in a row
    free(pixels);
    end();
}

static double frames(void)
{
    json_t *status = ask(json_pack("{ss}", "do", "status"));
    double n = real(status, "frames");
    json_decref(status);
    return n;
}

static void an_idle_booth_draws_nothing(void **state)
{
    (void)state;
    begin(FLAT);
    json_decref(ask(json_pack("{ss,ss}", "do", "show", "material", "white")));
    double before = frames();
    clock_sleep_until_ns(clock_now_ns() + NS_PER_S / 2);
    assert_near(frames(), before, 0);
    end();
}

static void reload_takes_a_new_display_and_refuses_a_broken_one(void **state)
{
    (void)state;
    assert_int_equal(rename(folder_at(&here, "display.ini"), folder_at(&here, "later.ini")), 0);
    begin(FLAT);
    json_t *reply = ask(json_pack("{ss,ss}", "do", "show", "material", "white"));
    assert_string_equal(text(reply, "scene"), "dark");
    json_decref(reply);
    assert_int_equal(rename(folder_at(&here, "later.ini"), folder_at(&here, "display.ini")), 0);
    reply = ask(json_pack("{ss}", "do", "reload"));
    assert_string_equal(text(reply, "scene"), "surface"); // what was asked for is on show
    assert_int_equal(json_array_size(json_object_get(reply, "restart")), 0);
    json_decref(reply);
    folder_put(&here, "display.ini", "[display]\nname = broken\n");
    refused(json_pack("{ss}", "do", "reload"), ERROR_CONFIG, "display.ini");
    reply = ask(json_pack("{ss,si,si}", "do", "probe", "x_px", 1, "y_px", 1));
    json_decref(reply); // the old model still serves
    end();
}

static void put_bands_material(void)
{
    struct exr image;
    assert_true(exr_init(&image, 1, 1, 6, NULL));
    for (int i = 0; i < 6; i++) {
        snprintf(image.names[i], sizeof image.names[i], "band%d", i);
        image.pixels[i] = 0.5f;
    }
    assert_true(exr_save(folder_at(&here, "grey.exr"), &image, NULL));
    exr_fini(&image);
    folder_put(&here, "grey.ini", "[material]\nname = grey\nkind = bands\nsource = grey.exr\n");
}

static void a_reload_whose_first_frame_fails_changes_nothing(void **state)
{
    (void)state;
    put_bands_material();
    begin(FLAT);
    json_decref(ask(json_pack("{ss,ss}", "do", "show", "material", folder_at(&here, "grey.ini"))));
    char full[4096];
    const char *plain = settings_text(FLAT "[state]\nlevel_s = 3\n");
    const char *lights = strstr(plain, "lights = ");
    snprintf(full, sizeof full, "%.*sspectral = full\n%s", (int)(lights - plain), plain, lights);
    folder_put(&here, "b.conf", full);
    refused(json_pack("{ss}", "do", "reload"), ERROR_CONFIG, "no spectra");
    for (int i = 0; i < 2; i++) {
        json_t *status = ask(json_pack("{ss}", "do", "status"));
        assert_string_equal(text(status, "scene"), "surface");
        assert_true(json_is_null(json_object_get(status, "failure")));
        const json_t *settings = json_object_get(status, "settings");
        assert_string_equal(text(json_object_get(settings, "quality"), "spectral"), "auto");
        assert_string_equal(text(json_object_get(settings, "state"), "level_s"), "2");
        json_decref(status);
        folder_put(&here, "b.conf", settings_text(FLAT));
        json_decref(ask(json_pack("{ss}", "do", "reload"))); // and the next one works
    }
    end();
}

static void reload_names_what_counts_after_a_restart_only(void **state)
{
    (void)state;
    begin(FLAT);
    char changed[4096];
    snprintf(changed, sizeof changed, "%s", settings_text(FLAT "[tracker2]\n"));
    *strstr(changed, "[tracker2]") = 0;
    char *width = strstr(changed, "width_px = 160");
    memcpy(width, "width_px = 320", 14);
    folder_put(&here, "b.conf", changed);
    json_t *reply = ask(json_pack("{ss}", "do", "reload"));
    const json_t *restart = json_object_get(reply, "restart");
    assert_int_equal(json_array_size(restart), 1);
    assert_string_equal(json_string_value(json_array_get(restart, 0)), "screen.width_px");
    json_decref(reply);
    uint8_t *pixels = capture_png(); // still 160 wide
    free(pixels);
    end();
}

static void hang_up_signal_reloads(void **state)
{
    (void)state;
    begin(FLAT);
    char quieter[4096];
    snprintf(quieter, sizeof quieter, "%s", settings_text(FLAT));
    memcpy(strstr(quieter, "test booth"), "TEST BOOTH", 10);
    folder_put(&here, "b.conf", quieter);
    kill(daemon_pid, SIGHUP);
    json_t *status = NULL;
    for (int i = 0; i < 1000; i++) {
        json_decref(status);
        status = ask(json_pack("{ss}", "do", "status"));
        if (!strcmp(text(status, "booth"), "TEST BOOTH"))
            break;
        clock_sleep_until_ns(clock_now_ns() + 10 * NS_PER_MS);
    }
    assert_string_equal(text(status, "booth"), "TEST BOOTH");
    json_decref(status);
    end();
}

// ---- boothctl --------------------------------------------------------------

static int ctl(const char *command, const char *a, const char *b, const char *c)
{
    const char *argv[] = {program_path("boothctl"),
                          "--socket",
                          folder_at(&here, "boothd.sock"),
                          command,
                          a,
                          b,
                          c,
                          NULL};
    return run_program(argv, folder_at(&here, "words"));
}

static const char *words(void)
{
    static char text_of[16384];
    return read_words(folder_at(&here, "words"), text_of, sizeof text_of);
}

static void boothctl_speaks_to_people_and_to_programs(void **state)
{
    (void)state;
    begin(FLAT);
    assert_int_equal(ctl("patch", "1", "0", "0.5"), 0);
    assert_int_equal(ctl("show", "white", NULL, NULL), 0);
    assert_int_equal(ctl("show", "colorchecker24", "--patch", "blue"), 0);
    assert_int_equal(ctl("status", NULL, NULL, NULL), 3); // the lamp is taken for granted
    assert_holds(words(), "colorchecker24: blue");
    assert_holds(words(), "warning: ");
    assert_holds(words(), "even, preset");
    assert_int_equal(ctl("status", "--json", NULL, NULL), 3);
    json_t *status = json_loads(words(), 0, NULL);
    assert_true(json_is_object(status));
    assert_string_equal(text(status, "patch"), "blue");
    json_decref(status);
    assert_int_equal(ctl("probe", "80", "50", NULL), 0);
    assert_holds(words(), " lx");
    assert_int_equal(ctl("capture", folder_at(&here, "ctl.png"), NULL, NULL), 0);
    assert_int_equal(access(folder_at(&here, "ctl.png"), R_OK), 0);
    assert_int_equal(ctl("reload", NULL, NULL, NULL), 0);
    assert_int_equal(ctl("quit", NULL, NULL, NULL), 0);
    assert_int_equal(await_program(daemon_pid), 0);
    daemon_pid = 0;
}

static void boothctl_ends_with_2_on_wrong_usage_and_1_when_nobody_listens(void **state)
{
    (void)state;
    static const struct {
        const char *words[4], *part;
    } bad[] = {
        {{"patch", "1", "0", NULL}, "3 arguments"}, {{"patch", "1", "0", "2"}, "0..1"},
        {{"patch", "1", "0", "red"}, "red"},        {{"dance", NULL, NULL, NULL}, "dance"},
        {{"show", NULL, NULL, NULL}, "1 arg"},      {{"quit", "now", NULL, NULL}, "0 arg"},
        {{"status", "--patch", "x", NULL}, "show"}, {{"status", "--loud", NULL, NULL}, "--help"},
        {{"teach", "A", "--readings", "0"}, "0"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *argv[] = {program_path("boothctl"), bad[i].words[0], bad[i].words[1],
                              bad[i].words[2],          bad[i].words[3], NULL};
        assert_int_equal(run_program(argv, folder_at(&here, "words")), 2);
        assert_holds(words(), bad[i].part);
    }
    assert_int_equal(ctl("status", NULL, NULL, NULL), 1);
    assert_holds(words(), "nobody listens");
}

#define BARE(test) cmocka_unit_test_setup_teardown(test, open_bare, close_all)
#define FULL(test) cmocka_unit_test_setup_teardown(test, open_full, close_all)

int main(void)
{
    const struct CMUnitTest tests[] = {
        BARE(a_bare_daemon_says_what_is_missing_and_shows_patches),
        BARE(a_material_without_lamp_or_display_stays_dark_with_a_reason),
        BARE(every_bad_request_is_refused_by_name_and_hurts_nobody),
        BARE(quit_is_answered_and_ends_the_daemon),
        BARE(the_service_manager_hears_ready_signs_of_life_and_stopping),
        BARE(a_second_daemon_does_not_take_the_socket),
        BARE(bad_settings_end_with_2_and_one_line),
        BARE(check_says_what_a_proof_still_needs),
        FULL(white_on_the_screen_has_the_luminance_of_a_white_card),
        FULL(dithered_counts_average_to_what_the_reference_wants),
        FULL(a_patch_of_the_chart_fills_the_screen_and_the_chart_does_not),
        FULL(an_idle_booth_draws_nothing),
        FULL(reload_takes_a_new_display_and_refuses_a_broken_one),
        FULL(a_reload_whose_first_frame_fails_changes_nothing),
        FULL(reload_names_what_counts_after_a_restart_only),
        FULL(hang_up_signal_reloads),
        FULL(boothctl_speaks_to_people_and_to_programs),
        BARE(boothctl_ends_with_2_on_wrong_usage_and_1_when_nobody_listens),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
