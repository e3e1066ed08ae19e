// SPDX-License-Identifier: Apache-2.0
// What settings and store of calibrations make of each other; geometry.ini.
#include "tests/fakes/support.h"

#include "base/clock.h"
#include "config/booth_store.h"
#include "config/geometry.h"
#include "files/write.h"
#include "tests/fakes/folder.h"

static const double EXACT = 1e-12;
static const int64_t DAY = 86400;

#define BARE                                                                                       \
    "[booth]\nname = lab\n[screen]\nwidth_m = 0.52\nheight_m = 0.325\nwidth_px = 1280\n"           \
    "height_px = 800\n[ceiling]\ncentre_m = 0 0.75 0.05\nwidth_m = 0.9\ndepth_m = 0.6\n"
#define STORE "[calibration]\nstore = store\n"
#define SERIAL "[display]\nserial = panel 1\n"
#define CENTRE "[stand]\ncentre_from_hinge_m = 0 0.2 0.03\n"

static struct folder here;
static struct store_place place;
static int64_t now;

static int open_here(void **state)
{
    (void)state;
    folder_open(&here);
    now = clock_utc_s();
    return !store_place(folder_at(&here, "store"), "lab", "panel 1", &place, NULL);
}

static int close_here(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static struct booth_settings settings(const char *text)
{
    struct booth_settings b;
    struct error err = {0};
    if (!booth_load(folder_put(&here, "b.conf", text), NULL, 0, &b, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    return b;
}

static struct geometry found_geometry(void)
{
    struct geometry g = {.rows = 1u << STORED_HINGE | 1u << STORED_CENTRE};
    g.booth.stand.stand =
        (struct stand){.hinge_m = {0, 0.01, -0.02}, .centre_from_hinge_m = {0.001, 0.21, 0.031}};
    g.uncertainty.hinge_m[1] = 0.0005;
    strcpy(g.origin.stand_at, "2026-01-31T12:00:00Z");
    strcpy(g.origin.software, "test 1");
    g.origin.stand_poses = 4;
    return g;
}

// A version with these files: 'd'isplay, 'l'amps, 'g'eometry.
static void version(const char *files, int64_t valid_until)
{
    struct store_draft d;
    struct store_manifest m = {.note = "of the test"};
    struct error err = {0};
    char path[STORE_PATH + 64];
    clock_utc_text(now, m.created);
    clock_utc_text(valid_until, m.valid_until);
    assert_true(store_begin(&place, false, &d, &err));
    const char *text = folder_put(&here, "text", "some text");
    assert_true(!strchr(files, 'd') || store_put(&d, text, STORE_DISPLAY, &err));
    assert_true(!strchr(files, 'l') || store_put(&d, text, STORE_LAMPS "/A.ini", &err));
    snprintf(path, sizeof path, "%s/" STORE_GEOMETRY, d.folder);
    struct geometry g = found_geometry();
    assert_true(!strchr(files, 'g') || geometry_save(path, &g, &err));
    assert_true(store_commit(&d, &m, NULL, &err));
}

static struct booth_calibration taken(struct booth_settings *b)
{
    struct booth_calibration c;
    struct error err = {0};
    if (!booth_from_store(b, now, &c, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    return c;
}

static void refused(const char *text, enum error_code code, const char *part)
{
    struct booth_settings b = settings(text);
    struct booth_calibration c;
    struct error err = {0};
    assert_false(booth_from_store(&b, now, &c, &err));
    assert_holds(err.text, part);
    assert_int_equal(err.code, code);
    assert_true(c.used);
    assert_int_equal(c.number, 0);
    assert_string_equal(b.display.model, "");
}

static void without_a_store_all_is_as_it_was(void **state)
{
    (void)state;
    struct booth_settings b = settings(BARE CENTRE);
    assert_string_equal(b.lamps.folder, folder_at(&here, "lamps"));
    struct booth_calibration c = taken(&b);
    assert_false(c.used);
    assert_int_equal(c.number, 0);
    assert_true(booth_is_placed(&b));
    struct error err = {0};
    assert_false(booth_load(folder_put(&here, "b.conf", BARE), NULL, 0, &b, &err));
    assert_holds(err.text, "centre_from_hinge_m is missing");
}

static void before_its_first_version_a_store_gives_nothing(void **state)
{
    (void)state;
    struct booth_settings b = settings(BARE CENTRE SERIAL STORE);
    assert_string_equal(b.lamps.folder, "");
    struct booth_calibration c = taken(&b);
    assert_true(c.used);
    assert_int_equal(c.named, 0);
    assert_string_equal(b.display.model, "");
    assert_true(booth_is_placed(&b));
}

static void a_version_gives_what_the_settings_do_not(void **state)
{
    (void)state;
    version("dlg", now + DAY);
    struct booth_settings b = settings(BARE SERIAL STORE);
    struct booth_calibration c = taken(&b);
    char path[STORE_PATH];
    assert_int_equal(c.number, 1);
    assert_int_equal(c.overruled, 0);
    assert_true(c.has_geometry);
    assert_string_equal(c.manifest.note, "of the test");
    snprintf(path, sizeof path, "%.900s/0001/display.ini", place.folder);
    assert_string_equal(b.display.model, path);
    snprintf(path, sizeof path, "%.900s/0001/lamps", place.folder);
    assert_string_equal(b.lamps.folder, path);
    assert_near(b.stand.stand.hinge_m[2], -0.02, EXACT);
    assert_near(b.stand.stand.centre_from_hinge_m[1], 0.21, EXACT);
    assert_near(b.tracker.default_eye_m[1], 0.55, EXACT); // as preset
}

static void what_the_settings_give_counts_and_is_said(void **state)
{
    (void)state;
    version("dlg", now + DAY);
    struct booth_settings b =
        settings(BARE "[display]\nserial = panel 1\nmodel = own.ini\n" STORE
                      "[stand]\ncentre_from_hinge_m = 0 0.3 0\nhinge_m = 0 0.01 -0.02\n");
    struct booth_calibration c = taken(&b);
    assert_string_equal(b.display.model, folder_at(&here, "own.ini"));
    assert_near(b.stand.stand.centre_from_hinge_m[1], 0.3, EXACT);
    // The hinge is given as it was found: nothing is lost.
    assert_int_equal(c.overruled, 1u << STORED_MODEL | 1u << STORED_CENTRE);
    const char *set[] = {"stand.centre_from_hinge_m=0 0.4 0"};
    assert_true(booth_load(folder_put(&here, "b.conf", BARE SERIAL STORE), set, 1, &b, NULL));
    c = taken(&b);
    assert_near(b.stand.stand.centre_from_hinge_m[1], 0.4, EXACT);
    assert_int_equal(c.overruled, 1u << STORED_CENTRE);
}

static void an_expired_one_is_refused_or_said(void **state)
{
    (void)state;
    version("dl", now - 1);
    refused(BARE CENTRE SERIAL STORE, ERROR_CONFIG, "expired: it was valid until");
    struct booth_settings b = settings(BARE CENTRE SERIAL STORE "expired = warn\n");
    struct booth_calibration c = taken(&b);
    assert_int_equal(c.number, 1);
    assert_true(store_expired(&c.manifest, now));
}

static void a_foreign_or_changed_one_is_refused(void **state)
{
    (void)state;
    version("dl", now + DAY);
    char line[2 * STORE_PATH + 64];
    snprintf(line, sizeof line, "cp -r '%s' '%s/../panel-2'", place.folder, place.folder);
    assert_int_equal(system(line), 0);
    refused(BARE CENTRE "[display]\nserial = panel 2\n" STORE, ERROR_CONFIG, "foreign");
    snprintf(line, sizeof line, "cd '%s/0001' && chmod u+w display.ini && echo more >>display.ini",
             place.folder);
    assert_int_equal(system(line), 0);
    refused(BARE CENTRE SERIAL STORE, ERROR_DATA, "display.ini: was changed");
}

static void store_settings_that_are_not_enough_are_refused(void **state)
{
    (void)state;
    refused(BARE CENTRE STORE, ERROR_CONFIG, "serial");
    refused(BARE SERIAL STORE, ERROR_CONFIG, "neither the settings nor a calibration");
    version("dl", now + DAY);
    refused(BARE SERIAL STORE, ERROR_CONFIG, "neither the settings nor a calibration");
}

static void a_new_calibration_is_valid_as_long_as_the_settings_say(void **state)
{
    (void)state;
    char text[24];
    struct booth_settings b = settings(BARE CENTRE);
    booth_valid_until(&b, 1769862896, text);
    assert_string_equal(text, "2026-03-02T12:34:56Z"); // 30 days after 2026-01-31
    b.calibration.valid_days = 0;
    booth_valid_until(&b, 1769862896, text);
    assert_string_equal(text, "");
}

static void geometry_is_read_as_it_was_written(void **state)
{
    (void)state;
    struct geometry g = found_geometry(), back;
    struct error err = {0};
    const char *path = folder_at(&here, "geometry.ini");
    size_t size;
    assert_true(geometry_save(path, &g, &err));
    assert_true(geometry_load(path, &back, &err));
    assert_int_equal(back.rows, g.rows);
    assert_memory_equal(&back.booth.stand.stand, &g.booth.stand.stand, sizeof(struct stand));
    assert_near(back.uncertainty.hinge_m[1], 0.0005, EXACT);
    assert_string_equal(back.origin.stand_at, "2026-01-31T12:00:00Z");
    char *text = file_read(path, 10000, &size, NULL);
    assert_holds(text, "[stand]\nhinge_m = 0 0.01 -0.02\ncentre_from_hinge_m = 0.001 0.21 0.031\n");
    assert_null(strstr(text, "[tracker]")); // it was not found
    assert_null(strstr(text, "default_tilt"));
    free(text);
    folder_put(&here, "geometry.ini", "[stand]\ndefault_tilt_deg = 3\n");
    assert_false(geometry_load(path, &back, &err));
    assert_holds(err.text, "geometry.ini:2");
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, open_here, close_here)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(without_a_store_all_is_as_it_was),
        TEST(before_its_first_version_a_store_gives_nothing),
        TEST(a_version_gives_what_the_settings_do_not),
        TEST(what_the_settings_give_counts_and_is_said),
        TEST(an_expired_one_is_refused_or_said),
        TEST(a_foreign_or_changed_one_is_refused),
        TEST(store_settings_that_are_not_enough_are_refused),
        TEST(a_new_calibration_is_valid_as_long_as_the_settings_say),
        TEST(geometry_is_read_as_it_was_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
