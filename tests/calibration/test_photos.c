// SPDX-License-Identifier: Apache-2.0
// Reading an exposure series, and what is refused.
#include "tests/fakes/support.h"

#include "calibration/photos.h"
#include "tests/calibration/series_here.h"

static struct folder folder;

static double ramp(double x, double y)
{
    return 0.02 * (x + 1) + 0 * y;
}

static double darkness(double x, double y)
{
    return 0 * (x + y);
}

static struct series eight(void)
{
    return (struct series){.folder = &folder,
                           .width = 32,
                           .height = 20,
                           .channels = 1,
                           .bits = 8,
                           .light = ramp,
                           .count = 3,
                           .seconds = {0.5, 1, 2}};
}

static int make(void **state)
{
    (void)state;
    struct series s = eight();
    folder_open(&folder);
    series_begin(&s, "list.csv");
    fprintf(s.list, "# file, seconds, kind\n");
    series_picture(&s, "dark.png", " , dark", 2, darkness);
    series_picture(&s, "flat.png", ";flat", 1, ramp);
    series_lights(&s);
    series_end(&s);
    return 0;
}

static int clear(void **state)
{
    (void)state;
    folder_close(&folder);
    return 0;
}

static void a_list_is_read_in_order_of_kind_and_exposure(void **state)
{
    (void)state;
    struct photos p;
    struct error err = {0};
    const char *list = folder_put(&folder, "turned.csv",
                                  "light-2.png,2\ndark.png,2,dark\n\"light-0.png\" , 0.5, light\n"
                                  "flat.png;1;flat\nlight-1.png,1.0e0\n");
    if (!photos_load(list, &p, &err))
        print_error("%s\n", err.text);
    assert_int_equal(p.count, 5);
    assert_int_equal(p.light_count, 3);
    for (int i = 0; i < 3; i++)
        assert_near(p.photos[i].seconds, 0.5 * (1 << i), 0);
    assert_int_equal(p.photos[3].kind, PHOTO_DARK);
    assert_int_equal(p.photos[4].kind, PHOTO_FLAT);
    assert_int_equal(p.width, 32);
    assert_int_equal(p.height, 20);
    assert_int_equal(p.photos[0].picture.samples[3], lround(255 * series_count(0.5 * 0.08)));
    photos_fini(&p);
}

static void refused(const char *text, const char *says)
{
    struct photos p = {.count = 77};
    struct error err = {0};
    const char *list = folder_put(&folder, "bad.csv", text);
    assert_false(photos_load(list, &p, &err));
    assert_holds(err.text, says);
    assert_holds(err.text, "bad.csv");
    assert_int_equal(p.count, 77);
}

static void a_list_that_is_none_is_refused_with_its_line(void **state)
{
    (void)state;
    struct photos p;
    struct error err = {0};
    assert_false(photos_load(folder_at(&folder, "none.csv"), &p, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    refused("light-0.png\n", "bad.csv:1: is not");
    refused("light-0.png,0.5,light,more\n", "is not");
    refused("# comment\n\nlight-0.png,half\n", "bad.csv:3: seconds: \"half\"");
    refused("light-0.png,0\n", "outside");
    refused("light-0.png,-1\n", "outside");
    refused("light-0.png,0.5,bright\n", "kind: \"bright\"");
    refused("dark.png,2,dark\n", "no picture of the kind light");
    refused("", "no picture of the kind light");
    refused("missing.png,0.5\n", "missing.png");
}

static void exchanged_exposures_are_refused(void **state)
{
    (void)state;
    refused("light-0.png,1\nlight-1.png,0.5\nlight-2.png,2\n", "exchanged");
    refused("light-0.png,2\nlight-1.png,1\nlight-2.png,0.5\n", "exchanged");
    refused("light-0.png,0.5\nlight-1.png,2\nlight-2.png,1\n", "light-1.png (2 s) is darker");
}

static void pictures_that_do_not_belong_together_are_refused(void **state)
{
    (void)state;
    struct series other = eight(), deep = eight(), colour = eight();
    other.width = 31;
    series_picture(&other, "other.png", "", 1, ramp);
    deep.bits = 16;
    series_picture(&deep, "deep.png", "", 1, ramp);
    colour.channels = 3;
    series_picture(&colour, "colour.png", "", 1, ramp);
    refused("light-0.png,0.5\nother.png,1\n", "31 x 20");
    refused("light-0.png,0.5\ndeep.png,1\n", "16 bits");
    refused("light-0.png,0.5\ncolour.png,1\n", "3 channels");
    folder_put(&folder, "text.png", "this is text");
    refused("light-0.png,0.5\ntext.png,1\n", "text.png");
}

static double glare(double x, double y)
{
    return 9 + 0 * (x + y);
}

static void a_series_without_any_light_left_is_refused(void **state)
{
    (void)state;
    struct series s = eight();
    series_picture(&s, "glare-1.png", "", 1, glare);
    series_picture(&s, "glare-2.png", "", 2, glare);
    refused("glare-1.png,1\nglare-2.png,2\n", "even the shortest exposure (1 s) is clipped");
    refused("dark.png,2\n", "dark all over");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_list_is_read_in_order_of_kind_and_exposure),
        cmocka_unit_test(a_list_that_is_none_is_refused_with_its_line),
        cmocka_unit_test(exchanged_exposures_are_refused),
        cmocka_unit_test(pictures_that_do_not_belong_together_are_refused),
        cmocka_unit_test(a_series_without_any_light_left_is_refused),
    };
    return cmocka_run_group_tests(tests, make, clear);
}
