// SPDX-License-Identifier: Apache-2.0
// boothd.conf: every way of getting it wrong names file, line, key, value and
// what is allowed.
#include "tests/fakes/support.h"

#include "config/bands_file.h"
#include "config/booth.h"
#include "config/paths.h"
#include "tests/fakes/folder.h"

static const double EXACT = 1e-12;

#define NEEDED                                                                                     \
    "[screen]\nwidth_m = 0.52\nheight_m = 0.325\nwidth_px = 1280\nheight_px = 800\n"               \
    "[stand]\ncentre_from_hinge_m = 0 0.2 0.03\n"                                                  \
    "[ceiling]\ncentre_m = 0 0.75 0.05\nwidth_m = 0.9\ndepth_m = 0.6\n"

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

static bool load(const char *text, struct booth_settings *booth, struct error *err)
{
    return booth_load(folder_put(&here, "b.conf", text), NULL, 0, booth, err);
}

static void what_must_be_given_suffices(void **state)
{
    (void)state;
    struct booth_settings b;
    struct error err = {0};
    if (!load(NEEDED, &b, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_near(b.screen.width_m, 0.52, EXACT);
    assert_int_equal(b.screen.height_px, 800);
    assert_near(b.stand.stand.centre_from_hinge_m[1], 0.2, EXACT);
    assert_near(b.stand.default_tilt_deg, 30, EXACT);
    assert_near(b.display.reflectance, 0.002, EXACT);
    assert_int_equal(booth_bits(&b), 8);
    assert_int_equal(b.quality.observer, OBSERVER_1931_2);
    assert_non_null(booth_spectrometer(&b));
    assert_null(booth_radiometer(&b)); // no port is given
}

static void some_drivers_need_no_port(void **state)
{
    (void)state;
    struct booth_settings b;
    struct error err = {0};
    assert_true(load(NEEDED "[radiometer]\ndriver = spotread\n"
                            "[accelerometer]\ndriver = iio\nport =\n",
                     &b, &err));
    assert_string_equal(booth_radiometer(&b)->name, "spotread");
    assert_string_equal(booth_accelerometer(&b)->name, "iio");
    assert_true(load(NEEDED "[accelerometer]\nport =\n", &b, &err));
    assert_null(booth_accelerometer(&b));
}

static void every_bad_line_is_named(void **state)
{
    (void)state;
    static const struct {
        const char *text, *parts[4];
    } bad[] = {
        {NEEDED "[booth]\nnme = x\n", {"b.conf:13", "nme", "no such setting", "name"}},
        {NEEDED "[boot]\nname = x\n", {"b.conf:12", "boot", "no such section", "booth"}},
        {NEEDED "[display]\nreflectance = 0.3\n", {"b.conf:13", "reflectance", "0.3", "0..0.2"}},
        {NEEDED "[display]\nreflectance = nan\n", {"b.conf:13", "reflectance", "nan", "number"}},
        {NEEDED "[display]\nreflectance = 0,002\n", {"b.conf:13", "reflectance", "0,002", ""}},
        {NEEDED "[display]\nbits = 12\n", {"b.conf:13", "bits", "12", "8, 10"}},
        {NEEDED "[display]\ndither = maybe\n", {"b.conf:13", "dither", "maybe", "no, yes"}},
        {NEEDED "[display]\ndither = yes\ndither = no\n", {"b.conf:14", "dither", "second", ""}},
        {NEEDED "[quality]\nlights = 12.5\n", {"b.conf:13", "lights", "12.5", "whole"}},
        {NEEDED "[quality]\nobserver = cie\n", {"b.conf:13", "observer", "cie", "1931-2"}},
        {NEEDED "[quality]\nbands = 2\n", {"b.conf", "[quality] bands", "2", "3..16"}},
        {NEEDED "[quality]\nobserver = 1964-10\n", {"b.conf", "1964-10", "1931 2", "radiometer"}},
        {NEEDED "[quality]\nbands = none.ini\n", {"b.conf", "bands", "none.ini", "cannot be"}},
        {NEEDED "[quality]\nlights = 0x10\n", {"b.conf:13", "lights", "0x10", "not a number"}},
        {NEEDED "[tracker]\nplace_m = 0 1\n", {"b.conf:13", "place_m", "", ""}},
        {NEEDED "[tracker]\nplace_m = 0 1 2 3\n", {"b.conf:13", "place_m", "3", ""}},
        {NEEDED "[tracker]\npitch_deg = 10 deg\n", {"b.conf:13", "pitch_deg", "10 deg", ""}},
        {NEEDED "[spectrometer]\ndriver = oceanic\n", {"b.conf:13", "driver", "oceanic", "none"}},
        {NEEDED "[state]\nconfirmations = 0\n", {"b.conf:13", "confirmations", "0", "1..20"}},
        {"[screen]\nwidth_m = 0.52\n", {"b.conf", "height_m", "must be given", ""}},
        {"", {"b.conf", "width_m", "must be given", ""}},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct booth_settings b = {.quality = {.lights = 77}};
        struct error err = {0};
        assert_false(load(bad[i].text, &b, &err));
        assert_int_equal(err.code, ERROR_CONFIG);
        assert_null(strchr(err.text, '\n'));
        for (int k = 0; k < 4; k++)
            assert_holds(err.text, bad[i].parts[k]);
        assert_int_equal(b.quality.lights, 77); // untouched
    }
}

static void a_file_that_is_not_there_is_named(void **state)
{
    (void)state;
    struct booth_settings b;
    struct error err = {0};
    assert_false(booth_load(folder_at(&here, "none.conf"), NULL, 0, &b, &err));
    assert_holds(err.text, "none.conf");
}

static void paths_are_relative_to_the_file(void **state)
{
    (void)state;
    struct booth_settings b;
    assert_true(load(NEEDED "[display]\nmodel = sub/d.ini\n[lamps]\nfolder = /var/lamps\n"
                            "[accelerometer]\nport = inclinometer\n[control]\nsocket = s\n"
                            "[materials]\nshow = white\n",
                     &b, NULL));
    assert_string_equal(b.display.model, folder_at(&here, "sub/d.ini"));
    assert_string_equal(b.lamps.folder, "/var/lamps");
    assert_string_equal(b.accelerometer.options.port, folder_at(&here, "inclinometer"));
    assert_string_equal(b.control.socket, folder_at(&here, "s"));
    assert_string_equal(b.materials.folder, "");
    assert_string_equal(b.materials.show, "white"); // a name, no path
}

static void bands_are_a_number_or_a_file_beside_the_settings(void **state)
{
    (void)state;
    struct booth_settings b;
    struct band_set made, loaded;
    struct error err = {0};
    assert_true(load(NEEDED, &b, NULL));
    assert_true(booth_bands(&b, &loaded, NULL));
    assert_int_equal(loaded.count, 6);
    const double centre[] = {450, 550, 600, 650}, width[] = {30, 25, 20, 30};
    assert_true(band_set_make(4, centre, width, &made, NULL));
    assert_true(bands_save(folder_at(&here, "mine.ini"), &made, NULL));
    if (!load(NEEDED "[quality]\nbands = mine.ini\n", &b, &err))
        print_error("%s\n", err.text);
    assert_string_equal(b.quality.bands, folder_at(&here, "mine.ini"));
    assert_true(booth_bands(&b, &loaded, &err));
    assert_int_equal(loaded.count, 4);
    assert_near(loaded.centre_nm[2], 600, EXACT);
    assert_near(loaded.width_nm[1], 25, EXACT);
}

static void a_network_port_is_no_path(void **state)
{
    (void)state;
    struct booth_settings b;
    assert_true(load(NEEDED "[accelerometer]\nport = moxa.lab:502\n", &b, NULL));
    assert_string_equal(b.accelerometer.options.port, "moxa.lab:502");
}

static void a_path_that_does_not_fit_is_refused(void **state)
{
    (void)state;
    struct booth_settings b;
    struct error err = {0};
    char text[2048];
    snprintf(
        text, sizeof text, "%s[control]\nsocket = %.*s\n", NEEDED, 100,
        "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
        "aaaaaaaaaaaaaaaaaaaa");
    assert_false(load(text, &b, &err));
    assert_holds(err.text, "socket");
    assert_holds(err.text, "107");
}

static void overrides_win_over_the_file_and_are_checked_like_it(void **state)
{
    (void)state;
    struct booth_settings b;
    struct error err = {0};
    const char *path = folder_put(&here, "b.conf", NEEDED "[quality]\nlights = 16\n");
    const char *good[] = {"quality.lights=99", "stand.default_tilt_deg=-12.5"};
    assert_true(booth_load(path, good, 2, &b, &err));
    assert_int_equal(b.quality.lights, 99);
    assert_near(b.stand.default_tilt_deg, -12.5, EXACT);
    static const struct {
        const char *text, *part;
    } bad[] = {{"quality.lights=0", "1..4096"},       {"quality.light=1", "no such setting"},
               {"quantity.lights=1", "no section"},   {"quality.lights", "section.key=value"},
               {"quality.lights 12", "section.key="}, {"=3", "section.key=value"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_false(booth_load(path, &bad[i].text, 1, &b, &err));
        assert_holds(err.text, "--set");
        assert_holds(err.text, bad[i].part);
    }
}

static void the_described_file_lacks_only_what_must_be_given(void **state)
{
    (void)state;
    char text[65536] = "";
    struct booth_settings b;
    struct error err = {0};
    FILE *out = fmemopen(text, sizeof text - 1, "w");
    booth_describe(out);
    fclose(out);
    assert_false(load(text, &b, &err));
    assert_holds(err.text, "width_m");
    struct booth_tables tables;
    booth_tables_init(&tables, NULL);
    for (const struct settings_section *s = tables.sections; s->name; s++)
        for (const struct setting *row = s->rows; row->name; row++) {
            char line[128];
            snprintf(line, sizeof line, "\n%s%s = ", row->preset ? "# " : "", row->name);
            assert_holds(text, line);
            assert_true(strlen(row->help) > 5);
        }
}

static void every_preset_lies_within_its_own_range(void **state)
{
    (void)state;
    struct booth_tables tables;
    struct booth_settings b = {0};
    booth_tables_init(&tables, &b);
    for (const struct settings_section *s = tables.sections; s->name; s++)
        for (const struct setting *row = s->rows; row->name; row++) {
            struct error err = {0};
            if (row->preset && !settings_set(s->rows, &b, row->name, row->preset, &err)) {
                print_error("[%s] %s\n", s->name, err.text);
                _fail(__FILE__, __LINE__);
            }
        }
}

static void no_two_rows_share_a_field_or_a_name(void **state)
{
    (void)state;
    struct booth_tables tables;
    booth_tables_init(&tables, NULL);
    int sections = 0, rows = 0;
    for (const struct settings_section *s = tables.sections; s->name; s++, sections++)
        for (const struct setting *row = s->rows; row->name; row++, rows++)
            for (const struct settings_section *t = tables.sections; t->name; t++)
                for (const struct setting *other = t->rows; other->name; other++) {
                    if (other == row)
                        continue;
                    assert_int_not_equal(other->offset, row->offset);
                    assert_true(s != t || strcmp(other->name, row->name));
                }
    assert_int_equal(sections, BOOTH_SECTIONS);
    assert_true(rows + BOOTH_SECTIONS <= BOOTH_ROWS_MOST);
}

static void the_camera_pitched_up_looks_up_and_yawed_looks_right(void **state)
{
    (void)state;
    struct booth_settings b = {0};
    b.tracker.pitch_deg = 10;
    struct vec3 ahead = {0, 0, 1}, right = {1, 0, 0};
    struct vec3 axis = rigid_apply(booth_from_tracker(&b), ahead);
    assert_near(axis.y, sin(10 * acos(-1) / 180), EXACT);
    assert_true(axis.z > 0.9);
    b.tracker.pitch_deg = 0;
    b.tracker.yaw_deg = 20;
    axis = rigid_apply(booth_from_tracker(&b), ahead);
    assert_near(axis.x, sin(20 * acos(-1) / 180), EXACT);
    b.tracker.yaw_deg = 0;
    b.tracker.roll_deg = 90;
    axis = rigid_apply(booth_from_tracker(&b), right);
    assert_near(axis.y, 1, EXACT);
}

static void the_default_socket_needs_a_runtime_folder(void **state)
{
    (void)state;
    char path[108];
    struct error err = {0};
    assert_true(booth_socket_default("/run/user/7", path, sizeof path, &err));
    assert_string_equal(path, "/run/user/7/boothd/boothd.sock");
    assert_false(booth_socket_default(NULL, path, sizeof path, &err));
    assert_holds(err.text, "XDG_RUNTIME_DIR");
    assert_false(booth_socket_default("", path, sizeof path, &err));
}

static void the_shipped_booth_loads(void **state)
{
    (void)state;
    struct booth_settings b;
    struct error err = {0};
    if (!booth_load("config/booths/emulated.conf", NULL, 0, &b, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_true(b.booth.emulated);
    assert_true(b.accelerometer.driver && b.tracker.driver && b.spectrometer.driver);
    assert_non_null(booth_radiometer(&b));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_must_be_given_suffices),
        cmocka_unit_test(some_drivers_need_no_port),
        cmocka_unit_test(every_bad_line_is_named),
        cmocka_unit_test(a_file_that_is_not_there_is_named),
        cmocka_unit_test(paths_are_relative_to_the_file),
        cmocka_unit_test(bands_are_a_number_or_a_file_beside_the_settings),
        cmocka_unit_test(a_network_port_is_no_path),
        cmocka_unit_test(a_path_that_does_not_fit_is_refused),
        cmocka_unit_test(overrides_win_over_the_file_and_are_checked_like_it),
        cmocka_unit_test(the_described_file_lacks_only_what_must_be_given),
        cmocka_unit_test(every_preset_lies_within_its_own_range),
        cmocka_unit_test(no_two_rows_share_a_field_or_a_name),
        cmocka_unit_test(the_camera_pitched_up_looks_up_and_yawed_looks_right),
        cmocka_unit_test(the_default_socket_needs_a_runtime_folder),
        cmocka_unit_test(the_shipped_booth_loads),
    };
    return cmocka_run_group_tests(tests, open_here, close_here);
}
