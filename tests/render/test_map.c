// SPDX-License-Identifier: Apache-2.0
// Luminance maps from files.
#include <unistd.h>

#include "tests/render/support.h"

static char path[64];

static int name_file(void **state)
{
    (void)state;
    snprintf(path, sizeof path, "/tmp/boothd-map-%d.exr", (int)getpid());
    return 0;
}

static int remove_file(void **state)
{
    (void)state;
    unlink(path);
    return 0;
}

static struct exr image_of(const char *channel, int width, int height)
{
    struct exr image;
    struct error err = {0};
    assert_good(exr_init(&image, width, height, 1, &err), err);
    snprintf(image.names[0], sizeof image.names[0], "%s", channel);
    for (int i = 0; i < width * height; i++)
        image.pixels[i] = 100.0f + i;
    return image;
}

static bool load(const struct exr *image, struct luminance_map *map, struct error *err)
{
    struct ceiling ceiling = booth_ceiling();
    assert_good(exr_save(path, image, err), *err);
    return luminance_map_load(path, &ceiling, map, err);
}

static void a_map_is_read_as_it_was_written(void **state)
{
    (void)state;
    struct luminance_map map;
    struct error err = {0};
    struct exr image = image_of("Y", 5, 3);
    assert_good(load(&image, &map, &err), err);
    assert_int_equal(map.width, 5);
    assert_int_equal(map.height, 3);
    assert_true(map.ceiling.width_m == 0.90 && map.ceiling.centre_m[1] == 0.75);
    for (int i = 0; i < 15; i++)
        assert_true(map.luminance[i] == 100 + i);
    luminance_map_fini(&map);
    exr_fini(&image);
}

static void pixels_below_zero_become_zero(void **state)
{
    (void)state;
    struct luminance_map map;
    struct error err = {0};
    struct exr image = image_of("Y", 4, 4);
    image.pixels[3] = -2;
    image.pixels[9] = -4;
    assert_good(load(&image, &map, &err), err);
    assert_true(map.luminance[3] == 0 && map.luminance[9] == 0 && map.luminance[8] == 108);
    luminance_map_fini(&map);
    exr_fini(&image);
}

static void the_files_own_size_counts_when_it_agrees_with_the_settings(void **state)
{
    (void)state;
    struct luminance_map map;
    struct error err = {0};
    struct exr image = image_of("Y", 4, 4);
    exr_set_number(&image, "boothd.width_m", 0.905);
    exr_set_number(&image, "boothd.depth_m", 0.598);
    assert_good(load(&image, &map, &err), err);
    assert_true(map.ceiling.width_m == 0.905 && map.ceiling.depth_m == 0.598);
    luminance_map_fini(&map);
    exr_fini(&image);
    image = image_of("Y", 4, 4);
    exr_set_number(&image, "boothd.width_m", 0.92);
    assert_false(load(&image, &map, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "boothd.width_m"));
    assert_non_null(strstr(err.text, path));
    exr_fini(&image);
}

static void an_image_without_y_is_refused(void **state)
{
    (void)state;
    struct luminance_map map;
    struct error err = {0};
    struct exr image = image_of("R", 4, 4);
    assert_false(load(&image, &map, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "\"Y\""));
    exr_fini(&image);
}

static void a_pixel_that_is_not_a_number_is_refused(void **state)
{
    (void)state;
    struct luminance_map map = {.width = 77};
    struct error err = {0};
    struct exr image = image_of("Y", 4, 4);
    image.pixels[6] = NAN;
    assert_true(!exr_save(path, &image, &err) ||
                !luminance_map_load(path, &map.ceiling, &map, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_int_equal(map.width, 77);
    exr_fini(&image);
}

static void a_missing_file_is_named(void **state)
{
    (void)state;
    struct luminance_map map;
    struct error err = {0};
    struct ceiling ceiling = booth_ceiling();
    assert_false(luminance_map_load("/nowhere/ceiling.exr", &ceiling, &map, &err));
    assert_non_null(strstr(err.text, "/nowhere/ceiling.exr"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_map_is_read_as_it_was_written),
        cmocka_unit_test(pixels_below_zero_become_zero),
        cmocka_unit_test(the_files_own_size_counts_when_it_agrees_with_the_settings),
        cmocka_unit_test(an_image_without_y_is_refused),
        cmocka_unit_test(a_pixel_that_is_not_a_number_is_refused),
        cmocka_unit_test(a_missing_file_is_named),
    };
    return cmocka_run_group_tests(tests, name_file, remove_file);
}
