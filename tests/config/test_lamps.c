// SPDX-License-Identifier: Apache-2.0
// The lamp folder, both ways, and every way of getting it wrong.
#include "tests/fakes/support.h"

#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "config/lamps.h"
#include "files/exr.h"
#include "tests/fakes/folder.h"

static const double AS_WRITTEN = 1e-6; // relative; a .sp holds at least seven digits
static const struct ceiling CEILING = {{0, 0.75, 0.05}, 0.9, 0.6};

static struct folder here;

static int open_here(void **state)
{
    (void)state;
    folder_open(&here);
    return 0;
}

static int close_here(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static struct lamp lamp_named(const char *name, const char *spectrum)
{
    struct lamp lamp = {.file = {.spread = 0.004, .map_scale = 1.03, .readings = 20}};
    snprintf(lamp.file.name, sizeof lamp.file.name, "%s", name);
    snprintf(lamp.file.taught_at, sizeof lamp.file.taught_at, "2026-01-31T12:00:00Z");
    assert_true(illuminant(spectrum, &lamp.irradiance, NULL));
    spectrum_scale(&lamp.irradiance, 1500 / xyz_absolute(&lamp.irradiance, OBSERVER_1931_2).Y);
    lamp.file.taught_lux = xyz_absolute(&lamp.irradiance, OBSERVER_1931_2).Y;
    return lamp;
}

static void save(const struct lamp *lamp)
{
    struct error err = {0};
    if (!lamp_save(folder_at(&here, "lamps"), lamp, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
}

static void what_was_saved_is_loaded_in_the_order_of_names(void **state)
{
    (void)state;
    struct lamp b = lamp_named("D65", "FL3.15"), a = lamp_named("A", "A");
    save(&b);
    save(&a);
    struct lamps lamps;
    struct error err = {0};
    if (!lamps_load(folder_at(&here, "lamps"), &lamps, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_int_equal(lamps.count, 2);
    assert_string_equal(lamps.lamps[0].file.name, "A");
    assert_string_equal(lamps.lamps[1].file.name, "D65");
    assert_string_equal(lamps.lamps[1].file.taught_at, "2026-01-31T12:00:00Z");
    assert_int_equal(lamps.lamps[1].file.readings, 20);
    double peak = 0;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        peak = fmax(peak, b.irradiance.v[i]);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        assert_near(lamps.lamps[1].irradiance.v[i], b.irradiance.v[i], AS_WRITTEN * peak);
    struct classifier classifier;
    lamps_teach(&lamps, &classifier);
    assert_int_equal(classifier.count, 2);
    assert_string_equal(classifier.lamps[1].name, "D65");
    assert_int_equal(classifier_update(&classifier, &b.irradiance).verdict, LAMP_NONE);
    assert_int_equal(classifier_update(&classifier, &b.irradiance).index, 1);
    lamps_fini(&lamps);
}

static void an_empty_folder_has_no_lamps_and_a_missing_one_is_an_error(void **state)
{
    (void)state;
    struct lamps lamps;
    struct error err = {0};
    mkdir(folder_at(&here, "empty"), 0755);
    assert_true(lamps_load(folder_at(&here, "empty"), &lamps, &err));
    assert_int_equal(lamps.count, 0);
    lamps_fini(&lamps);
    assert_false(lamps_load(folder_at(&here, "nowhere"), &lamps, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_holds(err.text, "nowhere");
}

static void save_map(const char *path, double luminance)
{
    struct exr map;
    assert_true(exr_init(&map, 90, 60, 1, NULL));
    strcpy(map.names[0], "Y");
    for (int i = 0; i < 90 * 60; i++)
        map.pixels[i] = (float)luminance;
    exr_set_number(&map, "boothd.width_m", 0.9);
    exr_set_number(&map, "boothd.depth_m", 0.6);
    assert_true(exr_save(path, &map, NULL));
    exr_fini(&map);
}

static void a_map_inside_the_folder_is_named_from_there(void **state)
{
    (void)state;
    struct lamp lamp = lamp_named("D50", "FL8"), loaded;
    snprintf(lamp.file.map, sizeof lamp.file.map, "%s", folder_at(&here, "lamps/D50.exr"));
    save(&lamp);
    save_map(lamp.file.map, 1000);
    assert_int_equal(rename(folder_at(&here, "lamps"), folder_at(&here, "moved")), 0);
    assert_true(lamp_load(folder_at(&here, "moved/D50.ini"), &loaded, NULL));
    assert_string_equal(loaded.file.map, folder_at(&here, "moved/D50.exr"));
    assert_int_equal(rename(folder_at(&here, "moved"), folder_at(&here, "lamps")), 0);
}

static void the_lights_are_those_of_the_map_times_its_scale(void **state)
{
    (void)state;
    struct lamp lamp = lamp_named("D50", "FL8");
    struct light_points plain = {0}, scaled = {0};
    struct vec3 at = {0, 0.2, 0.05}, up = {0, 1, 0};
    snprintf(lamp.file.map, sizeof lamp.file.map, "%s", folder_at(&here, "even.exr"));
    save_map(lamp.file.map, 1000);
    lamp.file.map_scale = 1;
    assert_true(lamp_lights(&lamp, &CEILING, CUT_VARIANCE, 32, &plain, NULL));
    lamp.file.map_scale = 1.25;
    assert_true(lamp_lights(&lamp, &CEILING, CUT_VARIANCE, 32, &scaled, NULL));
    double one = light_points_illuminance(&plain, 1, at, up);
    assert_true(one > 100);
    assert_near(light_points_illuminance(&scaled, 1, at, up), 1.25 * one, 1e-9 * one);
    light_points_fini(&plain);
    light_points_fini(&scaled);
}

static void a_lamp_without_a_map_gives_no_lights(void **state)
{
    (void)state;
    struct lamp lamp = lamp_named("D50", "FL8");
    struct light_points lights;
    struct error err = {0};
    assert_false(lamp_lights(&lamp, &CEILING, CUT_VARIANCE, 32, &lights, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_holds(err.text, "D50");
    snprintf(lamp.file.map, sizeof lamp.file.map, "%s", folder_at(&here, "gone.exr"));
    assert_false(lamp_lights(&lamp, &CEILING, CUT_VARIANCE, 32, &lights, &err));
    assert_holds(err.text, "gone.exr");
}

#define FACTS "[lamp]\nname = X\nspectrum = X.sp\n"

static void every_bad_lamp_is_named(void **state)
{
    (void)state;
    struct lamp good = lamp_named("X", "A");
    char lux[64];
    save(&good);
    snprintf(lux, sizeof lux, "taught_lux = %.9g\n", good.file.taught_lux);
    static const struct {
        const char *text, *parts[3];
    } bad[] = {
        {"[lamp]\nspectrum = X.sp\ntaught_lux = 1500\n", {"X.ini", "name", "must be given"}},
        {"[lamp]\nname = X\ntaught_lux = 1500\n", {"X.ini", "spectrum", "must be given"}},
        {FACTS, {"X.ini", "taught_lux", "must be given"}},
        {FACTS "taught_lux = 1400\n", {"X.ini", "taught_lux", "1400"}},
        {FACTS "taught_lux = -1\n", {"X.ini:4", "taught_lux", "0..1000000"}},
        {FACTS "taught_lux = 1500\nmap_scale = 0\n", {"X.ini:5", "map_scale", "0.01..100"}},
        {FACTS "taught_lux = 1500\nspread = inf\n", {"X.ini:5", "spread", "inf"}},
        {FACTS "taught_lux = 1500\ncolour = red\n", {"X.ini:5", "colour", "no such setting"}},
        {"[lamp]\nname = Y\nspectrum = X.sp\ntaught_lux = 1500\n", {"X.ini", "\"Y\"", "\"X\""}},
        {"[lamp]\nname = ../Y\nspectrum = X.sp\ntaught_lux = 1500\n", {"X.ini", "../Y", "letters"}},
        {"[lamp]\nname = X\nspectrum = Z.sp\ntaught_lux = 1500\n", {"Z.sp", "", ""}},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct lamps lamps;
        struct error err = {0};
        folder_put(&here, "lamps/X.ini", bad[i].text);
        assert_false(lamps_load(folder_at(&here, "lamps"), &lamps, &err));
        for (int k = 0; k < 3; k++)
            assert_holds(err.text, bad[i].parts[k]);
    }
    save(&good);
}

static void a_spectrum_without_light_is_refused(void **state)
{
    (void)state;
    struct lamp dark = lamp_named("dark", "A"), loaded;
    struct error err = {0};
    spectrum_scale(&dark.irradiance, 0);
    assert_true(lamp_save(folder_at(&here, "other"), &dark, NULL));
    assert_false(lamp_load(folder_at(&here, "other/dark.ini"), &loaded, &err));
    assert_holds(err.text, "no light");
}

static void a_name_that_is_no_file_name_is_not_saved(void **state)
{
    (void)state;
    static const char *const bad[] = {"", "a/b", "..", ".hidden", "two words", "ä"};
    struct lamp lamp = lamp_named("X", "A");
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct error err = {0};
        snprintf(lamp.file.name, sizeof lamp.file.name, "%s", bad[i]);
        assert_false(lamp_save(folder_at(&here, "odd"), &lamp, &err));
        assert_int_equal(err.code, ERROR_RANGE);
        assert_holds(err.text, bad[i]);
    }
    assert_int_not_equal(access(folder_at(&here, "odd"), F_OK), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_was_saved_is_loaded_in_the_order_of_names),
        cmocka_unit_test(an_empty_folder_has_no_lamps_and_a_missing_one_is_an_error),
        cmocka_unit_test(a_map_inside_the_folder_is_named_from_there),
        cmocka_unit_test(the_lights_are_those_of_the_map_times_its_scale),
        cmocka_unit_test(a_lamp_without_a_map_gives_no_lights),
        cmocka_unit_test(every_bad_lamp_is_named),
        cmocka_unit_test(a_spectrum_without_light_is_refused),
        cmocka_unit_test(a_name_that_is_no_file_name_is_not_saved),
    };
    return cmocka_run_group_tests(tests, open_here, close_here);
}
