// SPDX-License-Identifier: Apache-2.0
#include "tests/fakes/support.h"

#include <jansson.h>

#include "calibration/commands.h"
#include "files/exr.h"
#include "files/table.h"
#include "tests/calibration/command_here.h"
#include "tests/fakes/folder.h"

// Sums in double over 3000 pixels, written with 17 digits.
static const double SUMS = 1e-12;

enum { WIDTH = 60, HEIGHT = 50 };
static const double WIDTH_M = 0.9, DEPTH_M = 0.6;

static struct folder folder;
static struct command_here c;
static double candela;

static double at(int x, int y)
{
    return 40 + 5000 * exp(-pow((x - 40) / 6.0, 2) - pow((y - 12) / 3.0, 2));
}

static void save_map(const char *name, double scale, bool sized)
{
    struct exr image;
    struct error err;
    assert_true(exr_init(&image, WIDTH, HEIGHT, 1, &err));
    snprintf(image.names[0], sizeof image.names[0], "Y");
    double sum = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        image.pixels[i] = (float)(scale * at(i % WIDTH, i / WIDTH));
        sum += (double)image.pixels[i];
    }
    if (sized) {
        exr_set_number(&image, "boothd.width_m", WIDTH_M);
        exr_set_number(&image, "boothd.depth_m", DEPTH_M);
    }
    assert_true(exr_save(folder_at(&folder, name), &image, &err));
    exr_fini(&image);
    if (scale > 0)
        candela = sum * WIDTH_M * DEPTH_M / WIDTH / HEIGHT;
}

static int make(void **state)
{
    (void)state;
    folder_open(&folder);
    save_map("bare.exr", 1, false);
    save_map("dark.exr", 0, true);
    save_map("map.exr", 1, true);
    return 0;
}

static int clear(void **state)
{
    (void)state;
    folder_close(&folder);
    return 0;
}

#define POINTS(...)                                                                                \
    command_here(&c, command_light, "light", (const char *const[]){"points", __VA_ARGS__, NULL})

static double sum_of(const struct table *t, const char *column)
{
    double sum = 0;
    for (size_t row = 0; row < t->rows; row++)
        sum += table_at(t, row, (size_t)table_column(t, column));
    return sum;
}

static void the_points_of_a_map_hold_its_light_and_lie_within_it(void **state)
{
    (void)state;
    for (int cut = 0; cut < 2; cut++) {
        struct table t = {0};
        struct error err = {0};
        const char *csv = folder_at(&folder, "p.csv");
        POINTS(folder_at(&folder, "map.exr"), "--count", "50", "--cut", cut ? "energy" : "variance",
               "-o", csv);
        assert_int_equal(c.code, COMMAND_FINE);
        assert_holds(c.said, "50 points");
        assert_true(csv_load(csv, &t, &err));
        assert_int_equal(t.rows, 50);
        assert_near(sum_of(&t, "intensity_cd"), candela, SUMS * candela);
        for (size_t row = 0; row < t.rows; row++) {
            assert_true(table_at(&t, row, (size_t)table_column(&t, "intensity_cd")) > 0);
            assert_true(fabs(table_at(&t, row, 0)) <= WIDTH_M / 2);
            assert_true(table_at(&t, row, 1) == 0);
            assert_true(fabs(table_at(&t, row, 2)) <= DEPTH_M / 2);
        }
        table_fini(&t);
    }
}

static void settings_place_them_in_the_booth_and_scale_multiplies_them(void **state)
{
    (void)state;
    struct table plain = {0}, placed = {0};
    struct error err = {0};
    const char *config = "config/booths/emulated.conf"; // its ceiling: 0 0.75 0.05
    const char *a = folder_at(&folder, "a.csv"), *b = folder_at(&folder, "b.csv");
    POINTS(folder_at(&folder, "map.exr"), "--count", "7", "-o", a);
    assert_int_equal(c.code, COMMAND_FINE);
    POINTS(folder_at(&folder, "bare.exr"), "--count", "7", "--config", config, "--scale", "2",
           "--out", b);
    assert_string_equal(c.complained, "");
    assert_int_equal(c.code, COMMAND_FINE);
    assert_true(csv_load(a, &plain, &err) && csv_load(b, &placed, &err));
    for (size_t i = 0; i < 7; i++) {
        assert_near(table_at(&placed, i, 0), table_at(&plain, i, 0), SUMS);
        assert_near(table_at(&placed, i, 1), 0.75, 0);
        assert_near(table_at(&placed, i, 2), table_at(&plain, i, 2) + 0.05, SUMS);
        assert_near(table_at(&placed, i, 3), 2 * table_at(&plain, i, 3), SUMS * candela);
    }
    table_fini(&plain);
    table_fini(&placed);
}

static void json_says_what_the_table_says(void **state)
{
    (void)state;
    POINTS(folder_at(&folder, "map.exr"), "--count", "5", "--json");
    json_t *all = json_loads(c.said, 0, NULL), *points = json_object_get(all, "points");
    double sum = 0;
    for (size_t i = 0; i < json_array_size(points); i++)
        sum += json_number_value(json_object_get(json_array_get(points, i), "intensity_cd"));
    assert_int_equal(json_array_size(points), 5);
    assert_near(sum, candela, SUMS * candela);
    assert_near(json_number_value(json_object_get(all, "candela")), candela, SUMS * candela);
    assert_string_equal(json_string_value(json_object_get(all, "cut")), "variance");
    json_decref(all);
}

static void without_an_output_the_table_goes_to_standard_output(void **state)
{
    (void)state;
    struct table t = {0};
    struct error err = {0};
    POINTS(folder_at(&folder, "map.exr"), "--count", "5");
    assert_true(csv_parse("-", c.said, strlen(c.said), &t, &err));
    assert_int_equal(t.rows, 5);
    table_fini(&t);
}

static void fewer_lit_pixels_than_points_are_said(void **state)
{
    (void)state;
    POINTS(folder_at(&folder, "map.exr"), "--count", "5000", "-o", folder_at(&folder, "many.csv"));
    assert_int_equal(c.code, COMMAND_FINE);
    assert_holds(c.said, "3000 points");
    assert_holds(c.complained, "no more lit pixels");
}

static void the_picture_is_a_png_of_the_maps_form(void **state)
{
    (void)state;
    const char *png = folder_at(&folder, "p.png");
    unsigned char head[24];
    POINTS(folder_at(&folder, "map.exr"), "--count", "9", "--png", png);
    FILE *in = fopen(png, "r");
    assert_non_null(in);
    assert_int_equal(fread(head, 1, sizeof head, in), sizeof head);
    fclose(in);
    assert_memory_equal(head, "\x89PNG\r\n\x1a\n", 8);
    int width = head[18] << 8 | head[19], height = head[22] << 8 | head[23];
    assert_int_equal(width, 1080); // 18 pixels for each of 60
    assert_int_equal(height, 900);
}

static void what_cannot_be_is_refused_and_leaves_no_file(void **state)
{
    (void)state;
    const char *csv = folder_at(&folder, "none.csv"), *map = folder_at(&folder, "map.exr");
    POINTS(folder_at(&folder, "dark.exr"), "--count", "5", "-o", csv);
    assert_int_equal(c.code, COMMAND_USAGE);
    assert_holds(c.complained, "dark all over");
    POINTS(folder_at(&folder, "bare.exr"), "--count", "5", "-o", csv);
    assert_int_equal(c.code, COMMAND_USAGE);
    assert_holds(c.complained, "boothd.width_m");
    POINTS(map, "--count", "0", "-o", csv);
    assert_int_equal(c.code, COMMAND_USAGE);
    POINTS(map, "--count", "2000000", "-o", csv);
    assert_holds(c.complained, "outside 1..1048576");
    POINTS(map, "--count", "5x", "-o", csv);
    assert_int_equal(c.code, COMMAND_USAGE);
    POINTS(map, "--count", "5", "--cut", "half", "-o", csv);
    assert_int_equal(c.code, COMMAND_USAGE);
    assert_holds(c.complained, "half");
    POINTS(map, "--count", "5", "--scale", "-1", "-o", csv);
    assert_int_equal(c.code, COMMAND_USAGE);
    POINTS(map, "-o", csv);
    assert_int_equal(c.code, COMMAND_USAGE);
    POINTS(map, "--count", "5", "-o", folder_at(&folder, "no/such/folder.csv"));
    assert_int_equal(c.code, COMMAND_FAILED);
    assert_int_equal(access(csv, F_OK), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_points_of_a_map_hold_its_light_and_lie_within_it),
        cmocka_unit_test(settings_place_them_in_the_booth_and_scale_multiplies_them),
        cmocka_unit_test(json_says_what_the_table_says),
        cmocka_unit_test(without_an_output_the_table_goes_to_standard_output),
        cmocka_unit_test(fewer_lit_pixels_than_points_are_said),
        cmocka_unit_test(the_picture_is_a_png_of_the_maps_form),
        cmocka_unit_test(what_cannot_be_is_refused_and_leaves_no_file),
    };
    return cmocka_run_group_tests(tests, make, clear);
}
