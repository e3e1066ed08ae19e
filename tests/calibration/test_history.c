// SPDX-License-Identifier: Apache-2.0
// boothcal history, diff and use, on a store with two calibrations whose
// differences are known.
#include "tests/fakes/support.h"

#include <jansson.h>

#include "base/clock.h"
#include "calibration/commands.h"
#include "calibration/compare.h"
#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "config/display_file.h"
#include "config/geometry.h"
#include "files/exr.h"
#include "tests/calibration/command_here.h"
#include "tests/fakes/folder.h"

static const double EXACT = 1e-9, FILES = 1e-4; // relative: .sp and EXR hold seven digits
static const double BRIGHTER = 1.02, LAMP_BRIGHTER = 1.05, MAP_BRIGHTER = 1.5, HINGE_M = 0.003;

static struct folder here;
static struct store_place place;
static char config[256];

// ---- two calibrations --------------------------------------------------------

static struct display_model panel(double white)
{
    struct display_model m = {.name = "panel 1",
                              .matrix = {{410.1, 350.7, 180.3, 0.3},
                                         {212.6, 715.2, 72.2, 0.3},
                                         {19.3, 119.2, 950.5, 0.3}}};
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < 4; i++)
            m.matrix[c][i] *= white;
        for (int k = 0; k < DISPLAY_NODES; k++)
            m.curve[c][k] = pow(k / 1020.0, 2.2);
        display_curve_repair(m.curve[c]);
    }
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

// One bright column of a ceiling of 0.9 m.
static void put_map(const char *folder, const char *name, int column, double luminance)
{
    struct exr map;
    char path[STORE_PATH];
    assert_true(exr_init(&map, 90, 60, 1, NULL));
    strcpy(map.names[0], "Y");
    for (int row = 0; row < 60; row++)
        map.pixels[row * 90 + column] = (float)luminance;
    snprintf(path, sizeof path, "%.900s/%s.exr", folder, name);
    assert_true(exr_save(path, &map, NULL));
    exr_fini(&map);
}

static void put_lamp(struct store_draft *d, const char *spectrum, double lux, int column,
                     double luminance)
{
    struct lamp lamp = {.file = {.name = "day", .map = "day.exr", .map_scale = 1, .readings = 3}};
    char folder[STORE_PATH + 64];
    assert_true(illuminant(spectrum, &lamp.irradiance, NULL));
    spectrum_scale(&lamp.irradiance, lux / xyz_absolute(&lamp.irradiance, OBSERVER_1931_2).Y);
    lamp.file.taught_lux = lux;
    snprintf(folder, sizeof folder, "%s/lamps", d->folder);
    assert_true(lamp_save(folder, &lamp, NULL));
    put_map(folder, "day", column, luminance);
}

static void put_display(struct store_draft *d, double white)
{
    struct display_model model = panel(white);
    struct display_origin origin = {.patches = 20};
    char path[STORE_PATH + 64];
    snprintf(path, sizeof path, "%s/" STORE_DISPLAY, d->folder);
    assert_true(display_save(path, &model, &origin, NULL));
}

static void put_geometry(struct store_draft *d, double hinge_z)
{
    struct geometry g = {.rows = 1u << STORED_HINGE};
    char path[STORE_PATH + 64];
    g.booth.stand.stand.hinge_m[2] = hinge_z;
    snprintf(path, sizeof path, "%s/" STORE_GEOMETRY, d->folder);
    assert_true(geometry_save(path, &g, NULL));
}

static void commit(struct store_draft *d, const char *note, int64_t valid_s)
{
    struct store_manifest m = {.software = "test"};
    struct error err = {0};
    snprintf(m.note, sizeof m.note, "%s", note);
    clock_utc(m.created);
    clock_utc_text(clock_utc_s() + valid_s, m.valid_until);
    if (!store_commit(d, &m, NULL, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
}

static int open_here(void **state)
{
    (void)state;
    struct store_draft d;
    folder_open(&here);
    snprintf(config, sizeof config, "%s",
             folder_put(&here, "b.conf",
                        "[booth]\nname = lab\n[screen]\nwidth_m = 0.52\nheight_m = 0.325\n"
                        "width_px = 1280\nheight_px = 800\n[stand]\ncentre_from_hinge_m = 0 0.2 0\n"
                        "[ceiling]\ncentre_m = 0 0.75 0.05\nwidth_m = 0.9\ndepth_m = 0.6\n"
                        "[display]\nserial = panel 1\n[calibration]\nstore = store\n"));
    assert_true(store_place(folder_at(&here, "store"), "lab", "panel 1", &place, NULL));
    assert_true(store_begin(&place, false, &d, NULL));
    put_display(&d, 1);
    put_lamp(&d, "D65", 1500, 40, 1000);
    put_geometry(&d, 0);
    commit(&d, "the first", 86400);
    assert_true(store_begin(&place, true, &d, NULL));
    put_display(&d, BRIGHTER);
    put_lamp(&d, "D65", 1500 * LAMP_BRIGHTER, 50, 1000 * MAP_BRIGHTER);
    put_geometry(&d, HINGE_M);
    assert_true(store_put(&d, folder_put(&here, "x", "x"), "report.json", NULL));
    commit(&d, "the second", 86400);
    return 0;
}

static int close_here(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static struct command_here last;

// words: separated by blanks.
static int run(int (*command)(int, char **), const char *name, const char *words)
{
    char copy[256], *rest = NULL;
    const char *argv[16] = {"--config", config};
    int argc = 2;
    snprintf(copy, sizeof copy, "%s", words);
    for (char *w = strtok_r(copy, " ", &rest); w; w = strtok_r(NULL, " ", &rest))
        argv[argc++] = w;
    command_here(&last, command, name, argv);
    return last.code;
}

static struct difference difference(int a, int b)
{
    struct store_version one, other;
    struct booth_settings booth;
    struct difference d;
    struct error err = {0};
    assert_true(booth_load(config, NULL, 0, &booth, NULL));
    assert_true(store_open(&place, a, &one, NULL) && store_open(&place, b, &other, NULL));
    if (!compare_versions(&one, &other, &booth, &d, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    store_version_fini(&one);
    store_version_fini(&other);
    return d;
}

// ---- tests -------------------------------------------------------------------

static void known_changes_are_found_in_their_units(void **state)
{
    (void)state;
    struct difference d = difference(1, 2);
    static const char *const PATHS[] = {"display.ini",   "geometry.ini", "lamps/day.exr",
                                        "lamps/day.ini", "lamps/day.sp", "report.json"};
    assert_int_equal(d.file_count, 6);
    for (int i = 0; i < 6; i++) {
        assert_string_equal(d.files[i].path, PATHS[i]);
        assert_int_equal(d.files[i].kind, i < 5 ? FILE_CHANGED : FILE_ADDED);
    }
    assert_true(d.display.there);
    assert_near(d.display.white_percent, 2, 2 * FILES);
    assert_near(d.display.black_cdm2, 0.3 * 0.02, 0.3 * FILES);
    // White: L* = 116 cbrt(1.02) - 16 = 100.768, S_L at L' = 100.384: 0.768 / 1.748 = 0.439
    assert_true(d.display.de00.max >= 0.4390 && d.display.de00.max < 0.7);
    assert_true(d.display.de00.mean > 0.05 && d.display.de00.mean < d.display.de00.max);
    assert_int_equal(d.lamp_count, 1);
    assert_near(d.lamps[0].lux_percent, 5, 5 * FILES);
    assert_near(d.lamps[0].white_de00, 0, FILES);
    assert_near(d.lamps[0].shape, 0, FILES);
    assert_true(d.lamps[0].maps);
    assert_near(d.lamps[0].map_percent, 50, 50 * FILES);
    assert_near(d.lamps[0].map_shift_m, 0.1, 0.1 * FILES); // 10 of 90 columns of 0.9 m
    assert_true(d.geometry.there);
    assert_near(d.geometry.screen_m, HINGE_M, EXACT);
    assert_near(d.geometry.eye_m, 0, EXACT);
    difference_fini(&d);
}

static void the_other_way_round_all_signs_turn(void **state)
{
    (void)state;
    struct difference d = difference(2, 1);
    assert_int_equal(d.files[5].kind, FILE_REMOVED);
    assert_near(d.display.white_percent, 100 * (1 / BRIGHTER - 1), 2 * FILES);
    assert_near(d.lamps[0].lux_percent, 100 * (1 / LAMP_BRIGHTER - 1), 5 * FILES);
    assert_near(d.lamps[0].map_shift_m, 0.1, 0.1 * FILES);
    assert_near(d.geometry.screen_m, HINGE_M, EXACT);
    difference_fini(&d);
}

static void a_calibration_does_not_differ_from_itself(void **state)
{
    (void)state;
    struct difference d = difference(1, 1);
    assert_int_equal(d.file_count, 0);
    assert_int_equal(d.lamp_count, 0);
    assert_near(d.display.de00.max, 0, 0);
    assert_near(d.display.white_percent, 0, 0);
    assert_near(d.geometry.screen_m, 0, 0);
    difference_fini(&d);
}

static void another_lamp_of_the_name_differs_in_colour_and_shape(void **state)
{
    (void)state;
    struct store_draft draft;
    assert_true(store_begin(&place, true, &draft, NULL));
    put_lamp(&draft, "A", 1500 * LAMP_BRIGHTER, 50, 1500);
    commit(&draft, "the third", 86400);
    struct difference d = difference(2, 3);
    assert_near(d.lamps[0].lux_percent, 0, FILES);
    assert_true(d.lamps[0].white_de00 > 20);
    assert_true(d.lamps[0].shape > 0.05);
    difference_fini(&d);
}

static void the_farthest_corner_of_a_tilted_stand_counts(void **state)
{
    (void)state;
    const struct screen screen = {.width_m = 0.5, .height_m = 0.4};
    struct stand a = {{0, 0, 0}, {0, 0.2, 0.03}}, b = a;
    b.centre_from_hinge_m[0] = 0.004; // aside, at every tilt
    assert_near(compare_stands(&a, &b, &screen), 0.004, EXACT);
    b = a;
    b.hinge_m[1] = 0.003;
    b.centre_from_hinge_m[2] += 0.003; // the same way where the screen lies flat
    assert_near(compare_stands(&a, &b, &screen), 0.006, EXACT);
}

static void history_lists_and_marks_and_warns(void **state)
{
    (void)state;
    assert_int_equal(run(command_history, "history", "--verify"), COMMAND_FINE);
    assert_holds(last.said, "lab, panel 1: ");
    assert_holds(last.said, "\n  0001  ");
    assert_holds(last.said, "\n* 0002  ");
    assert_holds(last.said, "the second");
    assert_int_equal(run(command_history, "history", "--json"), COMMAND_FINE);
    json_t *all = json_loads(last.said, 0, NULL);
    json_t *two = json_array_get(json_object_get(all, "versions"), 1);
    assert_true(json_is_true(json_object_get(two, "in_force")));
    assert_int_equal(json_integer_value(json_object_get(two, "based_on")), 1);
    assert_true(json_is_null(json_object_get(two, "error")));
    json_decref(all);
    char line[STORE_PATH + 64];
    snprintf(line, sizeof line, "cd '%s/0002' && chmod u+w display.ini && echo >>display.ini",
             place.folder);
    assert_int_equal(system(line), 0);
    assert_int_equal(run(command_history, "history", ""), COMMAND_WARNED);
    assert_holds(last.said, "cannot be used: ");
    assert_holds(last.said, "0002/display.ini: was changed");
    assert_holds(last.complained, "no calibration is in force");
}

static void diff_says_it_and_use_puts_in_force(void **state)
{
    (void)state;
    assert_int_equal(run(command_diff, "diff", "1"), COMMAND_FINE); // against the one in force
    assert_holds(last.said, "changed  display.ini\n");
    assert_holds(last.said, "added    report.json\n");
    assert_holds(last.said, "white +2.00 %");
    assert_holds(last.said, "lamp day: illuminance +5.00 %");
    assert_holds(last.said, "corners by up to 0.0030 m");
    assert_int_equal(run(command_diff, "diff", "1 2 --json"), COMMAND_FINE);
    json_t *all = json_loads(last.said, 0, NULL);
    assert_near(json_number_value(json_object_get(json_object_get(all, "geometry"), "screen_m")),
                HINGE_M, 1e-8);
    json_decref(all);
    int number;
    assert_int_equal(run(command_use, "use", "1"), COMMAND_FINE);
    assert_holds(last.said, "0001 of ");
    assert_true(store_current(&place, &number, NULL));
    assert_int_equal(number, 1);
}

static void an_expired_calibration_is_used_with_a_warning(void **state)
{
    (void)state;
    struct store_draft d;
    assert_true(store_begin(&place, true, &d, NULL));
    commit(&d, "old", -5);
    assert_int_equal(run(command_use, "use", "3"), COMMAND_WARNED);
    assert_holds(last.complained, "expired");
    assert_int_equal(run(command_history, "history", ""), COMMAND_WARNED);
    assert_holds(last.said, "* 0003  ");
    assert_holds(last.said, "  expired     ");
}

static void single_results_are_kept_beside_the_rest(void **state)
{
    (void)state;
    struct store_version v;
    struct store_manifest before;
    char words[1024];
    assert_true(store_manifest(&place, 2, &before, NULL));
    snprintf(words, sizeof words, "--geometry %s --file %s --note tilted",
             folder_put(&here, "g.ini", "[stand]\nhinge_m = 0 0.5 0\n"),
             folder_put(&here, "view.ini", "[view]\n"));
    assert_int_equal(run(command_keep, "keep", words), COMMAND_FINE);
    assert_holds(last.said, "calibration 0003 is in force: tilted");
    assert_true(store_open(&place, 3, &v, NULL));
    assert_non_null(store_sum(&v, "view.ini"));
    assert_non_null(store_sum(&v, "lamps/day.exr")); // of the one before
    assert_string_equal(v.manifest.valid_until, before.valid_until);
    store_version_fini(&v);
    // A lamp and a model from elsewhere, here from an older version.
    snprintf(words, sizeof words,
             "--display %.400s/0001/display.ini --lamp %.400s/0001/lamps/day.ini", place.folder,
             place.folder);
    assert_int_equal(run(command_keep, "keep", words), COMMAND_FINE);
    struct difference d = difference(1, 4);
    assert_near(d.display.de00.max, 0, 0);
    assert_int_equal(d.lamp_count, 0);
    difference_fini(&d);
    assert_true(store_manifest(&place, 4, &before, NULL));
    struct store_manifest now = before;
    double days = (store_age_days(&now, clock_utc_s()));
    assert_true(days >= 0 && days < 1 && !store_expired(&now, clock_utc_s() + 29 * 86400));
}

static void what_boothd_would_refuse_is_not_kept(void **state)
{
    (void)state;
    char words[512];
    int number;
    folder_put(&here, "bad.ini", "[lamp]\nname = x\n");
    static const char *const OPTIONS[] = {"--display", "--lamp", "--geometry"};
    for (int i = 0; i < 3; i++) {
        snprintf(words, sizeof words, "%s %s", OPTIONS[i], folder_at(&here, "bad.ini"));
        assert_int_equal(run(command_keep, "keep", words), COMMAND_USAGE);
        assert_holds(last.complained, "bad.ini");
    }
    snprintf(words, sizeof words, "--file %s", folder_at(&here, "none"));
    assert_int_equal(run(command_keep, "keep", words), COMMAND_USAGE);
    assert_int_equal(run(command_keep, "keep", ""), COMMAND_USAGE);
    assert_holds(last.complained, "something to keep");
    assert_true(store_current(&place, &number, NULL));
    assert_int_equal(number, 2);
}

static void wrong_words_are_refused(void **state)
{
    (void)state;
    static const struct {
        int (*command)(int, char **);
        const char *words, *part;
    } bad[] = {{command_history, "3", "usage: boothcal history"},
               {command_history, "--verfy", "--verfy"},
               {command_diff, "", "usage: boothcal diff"},
               {command_diff, "1 2 3", "number of a version"},
               {command_diff, "one", "\"one\": the number"},
               {command_diff, "1 9", "no version 0009"},
               {command_use, "0", "\"0\": the number"},
               {command_use, "--verify 1", "usage: boothcal use"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(run(bad[i].command, "x", bad[i].words), COMMAND_USAGE);
        assert_holds(last.complained, bad[i].part);
    }
    const char *none[] = {NULL};
    command_here(&last, command_history, "history", none);
    assert_int_equal(last.code, COMMAND_USAGE);
    assert_int_equal(run(command_use, "use", "--help"), COMMAND_FINE);
    assert_holds(last.said, "usage: boothcal use");
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, open_here, close_here)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(known_changes_are_found_in_their_units),
        TEST(the_other_way_round_all_signs_turn),
        TEST(a_calibration_does_not_differ_from_itself),
        TEST(another_lamp_of_the_name_differs_in_colour_and_shape),
        TEST(the_farthest_corner_of_a_tilted_stand_counts),
        TEST(history_lists_and_marks_and_warns),
        TEST(diff_says_it_and_use_puts_in_force),
        TEST(an_expired_calibration_is_used_with_a_warning),
        TEST(single_results_are_kept_beside_the_rest),
        TEST(what_boothd_would_refuse_is_not_kept),
        TEST(wrong_words_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
