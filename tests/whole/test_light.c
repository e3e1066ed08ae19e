// SPDX-License-Identifier: Apache-2.0
// boothcal light in the emulated booth: teaching lamps that come up from cold.
// The tests follow one another in one running booth.
#include "tests/fakes/support.h"

#include "files/exr.h"
#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

// A lamp that is A again under another name.
static const char MORE[] = "[lamp4]\nname = twin\nspectrum = A\nform = spots\ncount = 3\n"
                           "row_m = -0.2 0.2\ndiameter_m = 0.08\n"
                           "warmup_drop = 0.1\nwarmup_s = 4\n";

static const double DRIFT_PERCENT = 10; // a minute; both lamps begin with 100 or more
static const double LUX = 0.01;         // slope of 10 % a minute with 4 s left, and noise
static const double XY = 0.002;         // noise of the emulated spectrometer
static const double CCT_K = 20;
static const double MAP = 0.02; // the reach of a map, and a lamp that still warms up by 0.5 %

static struct booth_here booth;
static struct control_client *booth_client;
static json_t *taught;

static int open_booth(void **state)
{
    (void)state;
    if (!booth_open(&booth, MORE, "--set display.output=offscreen"))
        return -1;
    booth_client = control_connect(folder_at(&booth.folder, "run/boothsim.sock"), NULL);
    return booth_client ? 0 : -1;
}

static int close_booth(void **state)
{
    (void)state;
    json_decref(taught);
    control_close(booth_client);
    return booth_close(&booth);
}

static json_t *truth(void)
{
    return control_call(booth_client, json_pack("{ss}", "do", "truth"), BOOTH_CALL_MS, NULL);
}

// Exit status of boothcal light WORDS, in the booth; what it printed is in the file "said".
static int light(const char *const *words)
{
    char config[256], daemon[256], sim[256];
    const char *argv[32] = {program_path("boothcal"), "light"};
    int n = 2;
    snprintf(config, sizeof config, "%s", folder_at(&booth.folder, "run/boothd.conf"));
    snprintf(daemon, sizeof daemon, "%s", folder_at(&booth.folder, "run/boothd.sock"));
    snprintf(sim, sizeof sim, "%s", folder_at(&booth.folder, "run/boothsim.sock"));
    for (int i = 0; words[i]; i++)
        argv[n++] = words[i];
    const char *rest[] = {"--config", config, "--socket", daemon, "--booth", sim};
    for (int i = 0; i < (strcmp(words[0], "list") ? 6 : 2); i++)
        argv[n++] = rest[i];
    argv[n] = NULL;
    return run_program(argv, folder_at(&booth.folder, "said"));
}

#define LIGHT(...) light((const char *const[]){__VA_ARGS__, NULL})

static const char *said(void)
{
    static char text[65536];
    return read_words(folder_at(&booth.folder, "said"), text, sizeof text);
}

static void a_cold_lamp_is_taught_once_it_stands_still(void **state)
{
    (void)state;
    int status = LIGHT("teach", "twin", "--drift", "10", "--readings", "10", "--json");
    if (status)
        print_error("%s\n", said());
    assert_int_equal(status, 0);
    taught = json_loads(said(), 0, NULL);
    assert_non_null(taught);
    json_t *now = truth();
    // 10 % less light at first, back with 4 s: 150 % a minute.
    assert_true(dig_real(taught, "waited_s") > 3);
    double drift = dig_real(taught, "drift_per_minute"), u = dig_real(taught, "drift_u");
    assert_true(fabs(drift) + 2 * u <= DRIFT_PERCENT / 100);
    assert_near(json_number_value(json_array_get(dig(taught, "xy"), 0)), 0.4476, XY);
    assert_near(dig_real(taught, "cct_k"), 2856, CCT_K);
    assert_string_equal(dig_text(dig(now, ""), "lamp"), "twin");
    json_decref(now);
}

static void it_is_then_recognised_at_the_level_it_was_taught_at(void **state)
{
    (void)state;
    struct control_client *daemon =
        control_connect(folder_at(&booth.folder, "run/boothd.sock"), NULL);
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    json_t *status = booth_status(daemon);
    while (strcmp(dig_text(status, "lamp.name"), "twin") && clock_now_ns() < until_ns) {
        json_decref(status);
        clock_sleep_until_ns(clock_now_ns() + 50 * NS_PER_MS);
        status = booth_status(daemon);
    }
    assert_string_equal(dig_text(status, "lamp.name"), "twin");
    assert_near(dig_real(status, "lamp.level"), 1, LUX);
    json_decref(status);
    control_close(daemon);
}

static void a_lamp_that_could_not_be_told_from_it_is_refused(void **state)
{
    (void)state;
    assert_int_equal(LIGHT("teach", "A", "--drift", "50", "--readings", "5"), 2);
    assert_holds(said(), "could not be told from the taught lamp twin");
    assert_int_equal(access(folder_at(&booth.folder, "run/lamps/A.ini"), F_OK), -1);
    assert_int_equal(access(folder_at(&booth.folder, "run/lamps/A.sp"), F_OK), -1);
}

static void another_one_is_taught_beside_it_and_both_are_listed(void **state)
{
    (void)state;
    char map[256];
    snprintf(map, sizeof map, "%s", folder_at(&booth.folder, "run/ceiling-D50.exr"));
    assert_int_equal(LIGHT("teach", "D50", "--drift", "50", "--readings", "5", "--map", map), 0);
    assert_holds(said(), "spot readings");
    assert_int_equal(LIGHT("list", "--json"), 0);
    json_t *all = json_loads(said(), 0, NULL), *lamps = json_object_get(all, "lamps");
    assert_int_equal(json_array_size(lamps), 2);
    const json_t *d50 = json_array_get(lamps, 0), *twin = json_array_get(lamps, 1);
    assert_string_equal(dig_text(d50, "name"), "D50");
    assert_string_equal(dig_text(d50, "map"), map);
    assert_near(dig_real(d50, "map_scale"), 1, 0.05); // the map's own error is 4 % at most
    assert_near(dig_real(twin, "lux"), dig_real(taught, "lux"), 1e-6 * dig_real(twin, "lux"));
    json_decref(all);
}

static void taught_again_a_lamp_keeps_its_map_at_the_same_luminance(void **state)
{
    (void)state;
    assert_int_equal(LIGHT("list", "--json"), 0);
    json_t *before = json_loads(said(), 0, NULL);
    assert_int_equal(LIGHT("teach", "D50", "--drift", "50", "--readings", "5"), 0);
    assert_holds(said(), "its luminance map stays");
    assert_int_equal(LIGHT("list", "--json"), 0);
    json_t *after = json_loads(said(), 0, NULL);
    const json_t *a = json_array_get(dig(before, "lamps"), 0);
    const json_t *b = json_array_get(dig(after, "lamps"), 0);
    assert_near(dig_real(b, "map_scale") / dig_real(a, "map_scale"),
                dig_real(b, "lux") / dig_real(a, "lux"), 1e-6);
    json_decref(before);
    json_decref(after);
}

static void a_lamp_that_does_not_stand_still_in_time_is_refused(void **state)
{
    (void)state;
    assert_int_equal(LIGHT("teach", "D65", "--drift", "0.01", "--wait", "4"), 1);
    assert_holds(said(), "does not stand still within 4 s");
    assert_int_equal(access(folder_at(&booth.folder, "run/lamps/D65.ini"), F_OK), -1);
}

// The lamp that is on is D50.
static void the_ceiling_is_photographed_and_measured_into_a_map(void **state)
{
    (void)state;
    struct error err = {0};
    struct exr truth = {0}, map = {0};
    char list[256], camera[256], out[256];
    const char *pictures = folder_at(&booth.folder, "pictures");
    snprintf(list, sizeof list, "%s/list.csv", pictures);
    snprintf(camera, sizeof camera, "%s/camera.ini", pictures);
    snprintf(out, sizeof out, "%s/map.exr", pictures);
    json_t *reply =
        control_call(booth_client, json_pack("{ss,ss}", "do", "photograph", "folder", pictures),
                     BOOTH_CALL_MS, &err);
    if (!reply)
        print_error("%s\n", err.text);
    assert_non_null(reply);
    json_decref(reply);
    int status = LIGHT("map", list, "-o", out, "--camera", camera, "--measure", "--lamp", "D50",
                       "--pixels", "256,170");
    if (status)
        print_error("%s\n", said());
    assert_int_equal(status, 0);
    assert_holds(said(), "7 spot readings");
    assert_true(exr_load(out, &map, &err) &&
                exr_load(folder_at(&booth.folder, "pictures/truth.exr"), &truth, &err));
    const float *Y = map.pixels + exr_channel(&map, "Y") * 256 * 170;
    double all = 0, wanted = 0;
    for (int i = 0; i < 256 * 170; i++) {
        all += (double)Y[i];
        wanted += (double)truth.pixels[i];
    }
    print_message("mean luminance off by %+.2f %%\n", 100 * (all / wanted - 1));
    assert_near(all / wanted, 1, MAP);
    exr_fini(&map);
    exr_fini(&truth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cold_lamp_is_taught_once_it_stands_still),
        cmocka_unit_test(it_is_then_recognised_at_the_level_it_was_taught_at),
        cmocka_unit_test(a_lamp_that_could_not_be_told_from_it_is_refused),
        cmocka_unit_test(another_one_is_taught_beside_it_and_both_are_listed),
        cmocka_unit_test(taught_again_a_lamp_keeps_its_map_at_the_same_luminance),
        cmocka_unit_test(the_ceiling_is_photographed_and_measured_into_a_map),
        cmocka_unit_test(a_lamp_that_does_not_stand_still_in_time_is_refused),
    };
    return cmocka_run_group_tests(tests, open_booth, close_booth);
}
