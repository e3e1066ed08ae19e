// SPDX-License-Identifier: Apache-2.0
#include "tests/fakes/support.h"

#include <jansson.h>

#include "calibration/commands.h"
#include "calibration/teach.h"
#include "colorimetry/illuminant.h"
#include "config/paths.h"
#include "tests/calibration/command_here.h"
#include "tests/fakes/folder.h"

static const double ROUNDING = 1e-9;   // of slopes in double
static const double THRESHOLD = 0.01;  // preset of [state] lamp_distance
static const double OTHER_MEAN = 1e-5; // a window's mean light is 0.1 % from that of all at most
static const double PER_MINUTE = 0.005;

static const struct teach_plan PLAN = {.drift = 0.005, .patience_s = 1800, .readings = 20};

enum { MOST = 4000 };
static double at_s[MOST], lux[MOST];

// Five readings a second of a lamp that comes up, with saw-tooth noise.
static int warm_up(double until_s, double drop, double tau_s, double noise)
{
    int n = 0;
    for (double t = 0; t <= until_s; t += 0.2) {
        at_s[n] = t;
        lux[n] = 1000 * (1 - drop * exp(-t / tau_s)) * (1 + noise * (n * 7 % 5 - 2) / 2);
        n++;
    }
    return n;
}

static void a_constant_light_is_steady_after_three_seconds_and_six_readings(void **state)
{
    (void)state;
    struct steadiness s;
    assert_false(light_is_steady(at_s, lux, warm_up(2.9, 0, 1, 0), &PLAN, &s));
    assert_true(isnan(s.per_minute));
    assert_true(light_is_steady(at_s, lux, warm_up(3.1, 0, 1, 0), &PLAN, &s));
    assert_near(s.per_minute, 0, ROUNDING);
    for (int i = 0; i < 6; i++) {
        at_s[i] = 2 * i;
        lux[i] = 500;
    }
    assert_false(light_is_steady(at_s, lux, 5, &PLAN, &s));
    assert_true(light_is_steady(at_s, lux, 6, &PLAN, &s));
    assert_near(s.window_s, 10, ROUNDING);
}

static void the_slope_of_a_straight_line_is_found_exactly(void **state)
{
    (void)state;
    struct steadiness s;
    for (int i = 0; i < 20; i++) {
        at_s[i] = 3 * i;
        lux[i] = 1000 * (1 + 0.01 * (at_s[i] - 28.5) / 60); // 1 % a minute about the mean
    }
    assert_false(light_is_steady(at_s, lux, 20, &PLAN, &s));
    assert_near(s.per_minute, 0.01, OTHER_MEAN);
    assert_near(s.per_minute_u, 0, ROUNDING);
    assert_true(s.window_s > 30);
}

// From when on the light of a lamp that loses `drop` at first is steady.
static double steady_at(double drop, double tau_s, double noise)
{
    struct steadiness s;
    for (double until_s = 0; until_s < 600; until_s += 1)
        if (light_is_steady(at_s, lux, warm_up(until_s, drop, tau_s, noise), &PLAN, &s))
            return until_s;
    return INFINITY;
}

static void a_lamp_is_waited_for_until_its_slope_is_small_enough(void **state)
{
    (void)state;
    // drop / tau 60 s exp(-t/tau) = 0.5 % a minute.
    for (double tau_s = 10; tau_s <= 60; tau_s *= 1.5) {
        double wanted = tau_s * log(0.08 / tau_s * 60 / PER_MINUTE);
        double quiet = steady_at(0.08, tau_s, 0), noisy = steady_at(0.08, tau_s, 0.001);
        assert_true(quiet >= wanted - 1 && quiet < wanted + 5);
        assert_true(noisy >= wanted - 1 && noisy < wanted + 60);
    }
}

static void the_more_noise_the_longer_the_window(void **state)
{
    (void)state;
    struct steadiness quiet, noisy;
    int n = warm_up(300, 0, 1, 0.0005);
    assert_true(light_is_steady(at_s, lux, n, &PLAN, &quiet));
    n = warm_up(300, 0, 1, 0.01);
    assert_true(light_is_steady(at_s, lux, n, &PLAN, &noisy));
    assert_true(noisy.window_s > 2 * quiet.window_s);
    assert_true(fabs(noisy.per_minute) + 2 * noisy.per_minute_u <= PER_MINUTE);
}

// ---- telling lamps apart ---------------------------------------------------

static struct lamp lamp_of(const char *name, const char *spectrum, double spread)
{
    struct lamp lamp = {.file = {.spread = spread, .map_scale = 1, .readings = 20}};
    struct error err;
    assert_true(illuminant(spectrum, &lamp.irradiance, &err));
    double k = 1000 / xyz_absolute(&lamp.irradiance, OBSERVER_1931_2).Y;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        lamp.irradiance.v[i] *= k;
    snprintf(lamp.file.name, sizeof lamp.file.name, "%s", name);
    lamp.file.taught_lux = 1000;
    return lamp;
}

// Some of another lamp in it.
static struct lamp mixed(const struct lamp *a, const struct lamp *b, double share)
{
    struct lamp m = *a;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        m.irradiance.v[i] = (1 - share) * a->irradiance.v[i] + share * b->irradiance.v[i];
    return m;
}

static void a_lamp_is_alike_itself_whatever_its_level(void **state)
{
    (void)state;
    struct lamp a = lamp_of("one", "FL8", 0.003), b = a;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        b.irradiance.v[i] *= 0.4;
    struct lamp_pair p = lamps_compare(&a, &b, THRESHOLD);
    assert_int_equal(p.likeness, LAMPS_ALIKE);
    assert_near(p.distance, 0, ROUNDING);
    assert_near(p.limit, 0.01 + 0.001, ROUNDING);
}

static void the_lamps_of_a_booth_are_apart_in_either_order(void **state)
{
    (void)state;
    static const char *const NAMES[] = {"A", "FL8", "FL3.15", "FL11", "LED-B3"};
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < i; j++) {
            struct lamp a = lamp_of("a", NAMES[i], 0.004), b = lamp_of("b", NAMES[j], 0.002);
            struct lamp_pair one = lamps_compare(&a, &b, THRESHOLD);
            struct lamp_pair other = lamps_compare(&b, &a, THRESHOLD);
            assert_int_equal(one.likeness, LAMPS_APART);
            assert_near(one.distance, other.distance, 0);
            assert_near(one.limit, other.limit, 0);
        }
}

static void between_one_limit_and_both_lamps_are_close(void **state)
{
    (void)state;
    struct lamp a = lamp_of("a", "FL8", 0.003), b = lamp_of("b", "A", 0.003);
    enum likeness before = LAMPS_ALIKE;
    int seen = 0;
    for (double share = 0.01; share < 0.5; share += 0.005) {
        struct lamp m = mixed(&a, &b, share);
        struct lamp_pair p = lamps_compare(&a, &m, THRESHOLD);
        enum likeness wanted = p.distance <= 0.011   ? LAMPS_ALIKE
                               : p.distance <= 0.022 ? LAMPS_CLOSE
                                                     : LAMPS_APART;
        assert_int_equal(p.likeness, wanted);
        seen |= 1 << p.likeness;
        before = p.likeness;
    }
    assert_int_equal(before, LAMPS_APART);
    assert_int_equal(seen, 7);
}

// ---- the list --------------------------------------------------------------

static struct folder folder;
static struct command_here c;

static void save(const char *name, struct lamp lamp, const char *map)
{
    struct error err;
    snprintf(lamp.file.name, sizeof lamp.file.name, "%s", name);
    snprintf(lamp.file.map, sizeof lamp.file.map, "%s", map);
    snprintf(lamp.file.taught_at, sizeof lamp.file.taught_at, "2026-01-31T12:34:56Z");
    snprintf(lamp.file.instrument, sizeof lamp.file.instrument, "USB2000+ EMU1");
    if (!lamp_save(folder.path, &lamp, &err))
        print_error("%s\n", err.text);
    assert_true(path_exists(folder_at(&folder, "A.ini")));
}

static int make(void **state)
{
    (void)state;
    folder_open(&folder);
    save("A", lamp_of("A", "A", 0.002), "");
    save("D50", lamp_of("D50", "FL8", 0.004), "/maps/d50.exr");
    return 0;
}

static int clear(void **state)
{
    (void)state;
    folder_close(&folder);
    return 0;
}

#define LIST(...)                                                                                  \
    command_here(&c, command_light, "light", (const char *const[]){"list", __VA_ARGS__, NULL})

static void the_list_names_what_was_taught(void **state)
{
    (void)state;
    LIST("--lamps", folder.path);
    assert_int_equal(c.code, COMMAND_FINE);
    assert_string_equal(c.complained, "");
    char *second = strchr(c.said, '\n') + 1, *third = strchr(second, '\n') + 1;
    assert_int_equal(strncmp(second, "A ", 2), 0);
    assert_int_equal(strncmp(third, "D50 ", 4), 0);
    assert_holds(second, "0.4476  0.4074"); // CIE 015:2018, illuminant A
    assert_holds(second, "none");
    assert_holds(third, "0.3458  0.3586"); // CIE 015:2018, FL8
    assert_holds(third, "/maps/d50.exr");
    assert_holds(third, "2026-01-31T12:34:56Z");
    assert_holds(third, "USB2000+ EMU1");
}

static void json_lists_lamps_and_pairs(void **state)
{
    (void)state;
    LIST("--lamps", folder.path, "--json");
    json_t *all = json_loads(c.said, 0, NULL), *lamps = json_object_get(all, "lamps");
    assert_int_equal(json_array_size(lamps), 2);
    assert_int_equal(json_array_size(json_object_get(all, "pairs")), 1);
    json_t *a = json_array_get(lamps, 0), *d50 = json_array_get(lamps, 1);
    assert_string_equal(json_string_value(json_object_get(a, "name")), "A");
    assert_true(json_is_null(json_object_get(a, "map")));
    assert_near(json_number_value(json_object_get(a, "cct_k")), 2856, 2); // CIE, c2 of 1968
    assert_string_equal(json_string_value(json_object_get(d50, "map")), "/maps/d50.exr");
    assert_near(json_number_value(json_object_get(d50, "lux")), 1000, ROUNDING);
    json_decref(all);
}

static void lamps_that_are_alike_are_warned_about(void **state)
{
    (void)state;
    save("warm", lamp_of("warm", "P2850K", 0.002), "");
    LIST("--lamps", folder.path);
    assert_int_equal(c.code, COMMAND_WARNED);
    assert_holds(c.complained, "A and warm cannot be told apart");
    assert_holds(c.said, "warm");
    unlink(folder_at(&folder, "warm.ini"));
    unlink(folder_at(&folder, "warm.sp"));
}

static void a_folder_that_is_not_there_is_refused(void **state)
{
    (void)state;
    LIST("--lamps", "/no/such/folder");
    assert_int_equal(c.code, COMMAND_USAGE);
    assert_holds(c.complained, "/no/such/folder");
    LIST("--json");
    assert_int_equal(c.code, COMMAND_USAGE);
    char shipped[8192], whole[8300];
    FILE *in = fopen("config/booths/emulated.conf", "r");
    assert_non_null(in);
    shipped[fread(shipped, 1, sizeof shipped - 1, in)] = 0;
    fclose(in);
    char *lamps = strstr(shipped, "folder = lamps"); // left to a store that is empty
    assert_non_null(lamps);
    memcpy(lamps, "#             ", 14);
    snprintf(whole, sizeof whole, "%s\n[calibration]\nstore = none\n", shipped);
    LIST("--config", folder_put(&folder, "booth.conf", whole));
    assert_int_equal(c.code, COMMAND_USAGE);
    assert_holds(c.complained, "no lamps yet");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_constant_light_is_steady_after_three_seconds_and_six_readings),
        cmocka_unit_test(the_slope_of_a_straight_line_is_found_exactly),
        cmocka_unit_test(a_lamp_is_waited_for_until_its_slope_is_small_enough),
        cmocka_unit_test(the_more_noise_the_longer_the_window),
        cmocka_unit_test(a_lamp_is_alike_itself_whatever_its_level),
        cmocka_unit_test(the_lamps_of_a_booth_are_apart_in_either_order),
        cmocka_unit_test(between_one_limit_and_both_lamps_are_close),
        cmocka_unit_test(the_list_names_what_was_taught),
        cmocka_unit_test(json_lists_lamps_and_pairs),
        cmocka_unit_test(lamps_that_are_alike_are_warned_about),
        cmocka_unit_test(a_folder_that_is_not_there_is_refused),
    };
    return cmocka_run_group_tests(tests, make, clear);
}
