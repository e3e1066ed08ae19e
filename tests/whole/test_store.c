// SPDX-License-Identifier: Apache-2.0
// boothd and its store of calibrations: what becomes of new ones, bad ones and
// expired ones while a proof is on the screen. Off screen, without instruments.
#include "tests/fakes/support.h"

#include <jansson.h>

#include "base/clock.h"
#include "colorimetry/colour.h"
#include "config/geometry.h"
#include "config/store.h"
#include "files/exr.h"
#include "tests/fakes/folder.h"
#include "tests/whole/proof_files.h"
#include "tests/whole/running.h"

enum { CALL_MS = 60000, CHANGES = 6 };
static const double CEILING_CDM2 = 2000;
static const int64_t DAY = 86400;

static struct folder here;
static struct store_place place;
static pid_t daemon_pid;
static struct control_client *client;

static int open_here(void **state)
{
    (void)state;
    unsetenv("NOTIFY_SOCKET");
    folder_open(&here);
    return !store_place(folder_at(&here, "store"), "test booth", "panel 1", &place, NULL);
}

static int close_here(void **state)
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

// ---- calibrations ----------------------------------------------------------

static void make_lamp(const char *folder)
{
    struct spectrum even;
    struct exr map;
    char path[STORE_PATH + 64];
    snprintf(path, sizeof path, "%s/lamps", folder);
    mkdir(path, 0777);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        even.v[i] = 0.02;
    snprintf(path, sizeof path, "%s/lamps/even.sp", folder);
    write_spectrum(path, &even);
    snprintf(path, sizeof path, "%s/lamps/even.ini", folder);
    FILE *out = fopen(path, "w");
    fprintf(out, "[lamp]\nname = even\nspectrum = even.sp\ntaught_lux = %.9g\nmap = even.exr\n",
            xyz_absolute(&even, OBSERVER_1931_2).Y);
    fclose(out);
    assert_true(exr_init(&map, 90, 60, 1, NULL));
    strcpy(map.names[0], "Y");
    for (int i = 0; i < 90 * 60; i++)
        map.pixels[i] = (float)CEILING_CDM2;
    snprintf(path, sizeof path, "%s/lamps/even.exr", folder);
    assert_true(exr_save(path, &map, NULL));
    exr_fini(&map);
}

// A version of its own: everything made anew.
static int version(double white_cdm2, int64_t valid_until)
{
    struct store_draft d;
    struct store_manifest m = {.software = "test"};
    struct geometry g = {.rows = 1u << STORED_CENTRE | 1u << STORED_HINGE};
    struct error err = {0};
    char path[STORE_PATH + 64];
    int number = 0;
    g.booth.stand.stand = (struct stand){{0, 0, 0.03}, {0, 0, 0.2}};
    snprintf(m.note, sizeof m.note, "white of %g", white_cdm2);
    clock_utc(m.created);
    clock_utc_text(valid_until, m.valid_until);
    assert_true(store_begin(&place, false, &d, &err));
    make_lamp(d.folder);
    snprintf(path, sizeof path, "%s/" STORE_DISPLAY, d.folder);
    write_display(path, white_cdm2);
    snprintf(path, sizeof path, "%s/" STORE_GEOMETRY, d.folder);
    assert_true(geometry_save(path, &g, &err));
    assert_true(store_commit(&d, &m, &number, &err));
    return number;
}

static void spoil(int number)
{
    char line[STORE_PATH + 128];
    snprintf(line, sizeof line, "cd '%s/%04d' && chmod u+w display.ini && echo >>display.ini",
             place.folder, number);
    assert_int_equal(system(line), 0);
}

// ---- the daemon ------------------------------------------------------------

static void begin(const char *more)
{
    char text[4096], materials[512];
    assert_non_null(realpath("config/materials", materials));
    snprintf(text, sizeof text,
             "[booth]\nname = test booth\n"
             "[screen]\nwidth_m = 0.52\nheight_m = 0.325\nwidth_px = 160\nheight_px = 100\n"
             "[stand]\ndefault_tilt_deg = 0\n"
             "[ceiling]\ncentre_m = 0 0.75 0.05\nwidth_m = 0.9\ndepth_m = 0.6\n"
             "[spectrometer]\ndriver = none\n[accelerometer]\ndriver = none\n"
             "[tracker]\ndriver = none\n[radiometer]\ndriver = none\n"
             "[display]\nserial = panel 1\noutput = offscreen\n[lamps]\ndeclared = even\n"
             "[materials]\nfolder = %s\nshow = white\n[control]\nsocket = boothd.sock\n"
             "[calibration]\nstore = store\n%s",
             materials, more);
    const char *config = folder_put(&here, "b.conf", text);
    const char *argv[] = {program_path("boothd"), "--config", config, NULL};
    daemon_pid = start_program(argv, folder_at(&here, "log"));
    client = connect_to(folder_at(&here, "boothd.sock"), daemon_pid);
    char log[4096];
    if (!client)
        print_error("%s\n", read_words(folder_at(&here, "log"), log, sizeof log));
    assert_non_null(client);
}

static void end(void)
{
    control_close(client);
    client = NULL;
    kill(daemon_pid, SIGTERM);
    assert_int_equal(await_program(daemon_pid), 0);
    daemon_pid = 0;
}

static json_t *ask(const char *what)
{
    struct error err = {0};
    json_t *reply = control_call(client, json_pack("{ss}", "do", what), CALL_MS, &err);
    if (!reply)
        print_error("%s\n", err.text);
    assert_non_null(reply);
    return reply;
}

static const char *text(const json_t *object, const char *key)
{
    const char *value = json_string_value(json_object_get(object, key));
    return value ? value : "";
}

struct seen {
    int version, dark, looks;
    char refused[512], scene[16], warnings[4096];
    double frames;
};

static void look(struct seen *s)
{
    json_t *status = ask("status");
    const json_t *calibration = json_object_get(status, "calibration");
    char *warnings = json_dumps(json_object_get(status, "warnings"), 0);
    s->version = (int)json_integer_value(json_object_get(calibration, "version"));
    s->dark += strcmp(text(status, "scene"), "surface") != 0;
    s->looks++;
    s->frames = json_number_value(json_object_get(status, "frames"));
    snprintf(s->refused, sizeof s->refused, "%s", text(calibration, "refused"));
    snprintf(s->scene, sizeof s->scene, "%s", text(status, "scene"));
    snprintf(s->warnings, sizeof s->warnings, "%s", warnings);
    free(warnings);
    json_decref(status);
}

static bool until(struct seen *s, bool (*holds)(const struct seen *, int), int wanted)
{
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    do {
        clock_sleep_until_ns(clock_now_ns() + NS_PER_MS);
        look(s);
    } while (!holds(s, wanted) && clock_now_ns() < until_ns);
    return holds(s, wanted);
}

static bool is_version(const struct seen *s, int wanted)
{
    return s->version == wanted;
}

static bool is_refused(const struct seen *s, int wanted)
{
    return (*s->refused != 0) == wanted;
}

static bool is_dark(const struct seen *s, int wanted)
{
    return (strcmp(s->scene, "surface") != 0) == wanted;
}

static double white_emitted(void)
{
    struct error err = {0};
    json_t *reply = control_call(
        client, json_pack("{ss,si,si}", "do", "probe", "x_px", 80, "y_px", 50), CALL_MS, &err);
    assert_non_null(reply);
    double code = json_number_value(json_array_get(json_object_get(reply, "rgb"), 1));
    json_decref(reply);
    return code;
}

// ---- tests -----------------------------------------------------------------

static void a_new_calibration_is_in_force_without_a_dark_frame(void **state)
{
    (void)state;
    struct seen s = {0};
    version(900, clock_utc_s() + DAY);
    begin("");
    look(&s);
    assert_int_equal(s.version, 1);
    assert_int_equal(s.dark, 0);
    double before = white_emitted(), frames = s.frames;
    for (int i = 2; i <= CHANGES; i++) {
        assert_int_equal(version(i == CHANGES ? 2000 : 900 + i, clock_utc_s() + DAY), i);
        assert_true(until(&s, is_version, i));
    }
    print_message("%d looks while %d calibrations came\n", s.looks, CHANGES);
    assert_int_equal(s.dark, 0); // the whole time
    assert_true(s.looks > CHANGES);
    assert_true(s.frames >= frames + CHANGES - 1);
    assert_true(white_emitted() < 0.8 * before); // the brighter panel needs less of its range
    assert_true(store_use(&place, 1, NULL));
    assert_true(until(&s, is_version, 1));
    assert_near(white_emitted(), before, 1e-12);
    end();
}

static void a_bad_one_is_refused_aloud_and_the_old_stays(void **state)
{
    (void)state;
    struct seen s = {0};
    char log[8192];
    version(900, clock_utc_s() + DAY);
    begin("");
    double before = white_emitted();
    int bad[] = {0, 0};
    bad[0] = version(2000, clock_utc_s() - 1); // expired when it comes
    assert_true(until(&s, is_refused, true));
    assert_holds(s.refused, "0002: expired");
    assert_holds(s.warnings, "0002: expired");
    assert_int_equal(s.version, 1);
    assert_near(white_emitted(), before, 1e-12);
    assert_true(store_use(&place, 1, NULL));
    assert_true(until(&s, is_refused, false));
    bad[1] = version(2000, clock_utc_s() + DAY);
    assert_true(until(&s, is_version, 3));
    assert_true(store_use(&place, 1, NULL));
    assert_true(until(&s, is_version, 1));
    assert_int_equal(bad[1], 3);
    char line[2 * STORE_PATH];
    spoil(3);
    snprintf(line, sizeof line, "cd '%.900s' && ln -sfn 0003 current", place.folder);
    assert_int_equal(system(line), 0);
    assert_true(until(&s, is_refused, true));
    assert_holds(s.refused, "0003/display.ini: was changed");
    snprintf(line, sizeof line, "cd '%.900s' && rm current", place.folder);
    assert_int_equal(system(line), 0);
    for (int i = 0; i < 1000 && !strstr(s.refused, "holds none any more"); i++) {
        clock_sleep_until_ns(clock_now_ns() + 10 * NS_PER_MS);
        look(&s);
    }
    assert_holds(s.refused, "holds none any more");
    assert_int_equal(s.dark, 0);
    assert_int_equal(s.version, 1);
    end();
    read_words(folder_at(&here, "log"), log, sizeof log);
    assert_holds(log, "calibration refused");
    assert_holds(log, "version 0001 stays in force");
}

static void a_booth_starts_dark_without_a_good_one_and_takes_the_next(void **state)
{
    (void)state;
    struct seen s = {0};
    struct error err = {0};
    version(900, clock_utc_s() + DAY);
    spoil(1);
    begin("");
    look(&s);
    assert_true(is_dark(&s, true));
    assert_holds(s.refused, "was changed");
    assert_null(control_call(client, json_pack("{ss}", "do", "reload"), CALL_MS, &err));
    assert_holds(err.text, "was changed");
    version(900, clock_utc_s() + DAY);
    assert_true(until(&s, is_version, 2));
    look(&s);
    assert_true(is_dark(&s, false));
    assert_string_equal(s.refused, "");
    end();
}

static void a_bare_store_is_filled_while_the_daemon_runs(void **state)
{
    (void)state;
    struct seen s = {0};
    begin("");
    look(&s);
    assert_true(is_dark(&s, true));
    assert_holds(s.refused, "centre_from_hinge_m");
    version(900, clock_utc_s() + DAY);
    assert_true(until(&s, is_version, 1));
    look(&s);
    assert_true(is_dark(&s, false));
    end();
}

static void one_that_expires_in_service_darkens_the_screen_or_is_said(void **state)
{
    (void)state;
    struct seen s = {0};
    version(900, clock_utc_s() + 2);
    begin("");
    assert_true(until(&s, is_dark, true));
    assert_holds(s.warnings, "has expired");
    version(900, clock_utc_s() + DAY);
    assert_true(until(&s, is_dark, false));
    end();
    version(900, clock_utc_s() - 1);
    begin("expired = warn\n");
    look(&s);
    assert_true(is_dark(&s, false));
    assert_holds(s.warnings, "expired");
    end();
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, open_here, close_here)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_new_calibration_is_in_force_without_a_dark_frame),
        TEST(a_bad_one_is_refused_aloud_and_the_old_stays),
        TEST(a_booth_starts_dark_without_a_good_one_and_takes_the_next),
        TEST(a_bare_store_is_filled_while_the_daemon_runs),
        TEST(one_that_expires_in_service_darkens_the_screen_or_is_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
