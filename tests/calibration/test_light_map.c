// SPDX-License-Identifier: Apache-2.0
// boothcal light map, from pictures of a made-up ceiling straight above.
#include "tests/fakes/support.h"

#include <jansson.h>
#include <unistd.h>

#include "calibration/commands.h"
#include "files/exr.h"
#include "tests/calibration/command_here.h"
#include "tests/calibration/series_here.h"

// The ceiling of 0.9 x 0.6 m is 180 x 120 pixels from (30, 20) on; near on top.
static const double PIXEL_M = 0.005;
static const double LIGHT = 0.015; // a response that is found from few luminances; besides, noise
static const double EVEN_M = 0.01; // places nearer to a step hold some of both sides

static struct folder folder;
static struct command_here c;
static char list[128], out[128], response[128];

static double ceiling(double x_m, double z_m)
{
    return 800 * exp(1.2 * sin(7 * x_m)) + (fabs(z_m - 0.1) < 0.04 ? 9000 : 0);
}

static bool inside(double x, double y)
{
    return x >= 30 && x < 210 && y >= 20 && y < 140;
}

// 1 cd/m2 fills a pixel in 4000 s.
static double camera(double x, double y)
{
    double x_m = (x - 119.5) * PIXEL_M, z_m = (79.5 - y) * PIXEL_M;
    return (inside(x, y) ? ceiling(x_m, z_m) : 30) / 4000;
}

static int make(void **state)
{
    (void)state;
    struct series s = {.folder = &folder,
                       .width = 240,
                       .height = 160,
                       .channels = 1,
                       .bits = 8,
                       .light = camera,
                       .electrons = 20000,
                       .count = 8,
                       .seconds = {0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8}};
    folder_open(&folder);
    series_begin(&s, "list.csv");
    series_lights(&s);
    series_end(&s);
    snprintf(list, sizeof list, "%s", folder_at(&folder, "list.csv"));
    snprintf(out, sizeof out, "%s", folder_at(&folder, "map.exr"));
    snprintf(response, sizeof response, "%s", folder_at(&folder, "true.csv"));
    FILE *file = fopen(response, "w");
    fprintf(file, "code,exposure\n");
    for (int z = 0; z < 256; z++)
        fprintf(file, "%d,%.9g\n", z, series_exposure(z / 255.0));
    fclose(file);
    return 0;
}

static int clear(void **state)
{
    (void)state;
    folder_close(&folder);
    return 0;
}

#define MAP(...)                                                                                   \
    command_here(&c, command_light, "light", (const char *const[]){"map", __VA_ARGS__, NULL})

// Light at x 0, z -0.15 is 800 cd/m2.
#define SPOT "--size", "0.9,0.6", "--spot", "0,-0.15,800"

static void fine(void)
{
    if (c.code != COMMAND_FINE)
        print_error("%s%s\n", c.said, c.complained);
    assert_int_equal(c.code, COMMAND_FINE);
}

static void check_map(const char *path, double scale)
{
    struct exr map = {0};
    struct error err = {0};
    double width, depth;
    assert_true(exr_load(path, &map, &err));
    assert_true(exr_number(&map, "boothd.width_m", &width) &&
                exr_number(&map, "boothd.depth_m", &depth));
    assert_near(width, 0.9, 0);
    assert_near(depth, 0.6, 0);
    int count = map.width * map.height, compared = 0;
    const float *Y = map.pixels + exr_channel(&map, "Y") * count;
    const float *sigma = map.pixels + exr_channel(&map, "sigma") * count;
    const float *clipped = map.pixels + exr_channel(&map, "clipped") * count;
    for (int i = 0; i < count; i++) {
        double x = ((i % map.width + 0.5) / map.width - 0.5) * 0.9;
        double z = ((i / map.width + 0.5) / map.height - 0.5) * 0.6;
        assert_true(clipped[i] == 0 && sigma[i] > 0 && (double)sigma[i] < 0.02 * (double)Y[i]);
        if (fabs(fabs(z - 0.1) - 0.04) < EVEN_M || fabs(x) > 0.44 || fabs(z) > 0.29)
            continue;
        assert_near((double)Y[i], scale * ceiling(x, z),
                    LIGHT * scale * ceiling(x, z) + 4 * (double)sigma[i]);
        compared++;
    }
    assert_true(compared > count / 2);
    exr_fini(&map);
}

static void a_map_is_made_of_corners_that_are_found(void **state)
{
    (void)state;
    MAP(list, "-o", out, SPOT, "--json", "--response", response);
    fine();
    json_t *said = json_loads(c.said, 0, NULL), *corners = json_object_get(said, "corners_px");
    static const double WANTED[4][2] = {{29.5, 139.5}, {209.5, 139.5}, {209.5, 19.5}, {29.5, 19.5}};
    for (size_t i = 0; i < 4; i++)
        for (size_t k = 0; k < 2; k++)
            assert_near(json_number_value(json_array_get(json_array_get(corners, i), k)),
                        WANTED[i][k], 0.1); // noise of 200 places along a side
    assert_int_equal(json_integer_value(json_object_get(said, "exposures")), 8);
    json_decref(said);
    check_map(out, 1);
}

static void corners_a_second_reading_and_a_picture_may_be_given(void **state)
{
    (void)state;
    const char *png = folder_at(&folder, "map.png");
    MAP(list, "-o", out, "--size", "0.9,0.6", "--corners",
        "29.5,139.5,209.5,139.5,209.5,19.5,29.5,19.5", "--spot", "0,-0.15,400", "--spot",
        "0,0.1,4900", "--pixels", "90,60", "--png", png, "--lamp", "D50", "--response", response);
    fine();
    assert_holds(c.said, "90 x 60 pixels");
    assert_holds(c.said, "2 spot readings");
    check_map(out, 0.5);
    assert_int_equal(access(png, R_OK), 0);
}

static void a_response_that_is_found_can_be_used_again(void **state)
{
    (void)state;
    const char *found = folder_at(&folder, "found.csv");
    MAP(list, "-o", out, SPOT, "--save-response", found);
    fine();
    check_map(out, 1);
    unlink(out);
    MAP(list, "-o", out, SPOT, "--response", found);
    fine();
    check_map(out, 1);
}

static void debevecs_method_does_it_too(void **state)
{
    (void)state;
    MAP(list, "-o", out, SPOT, "--response", "debevec");
    fine();
    struct exr map = {0};
    struct error err;
    assert_true(exr_load(out, &map, &err));
    int at = (map.height / 4) * map.width + map.width / 2; // x 0, z -0.15
    assert_near((double)map.pixels[at + exr_channel(&map, "Y") * map.width * map.height], 800,
                0.03 * 800);
    exr_fini(&map);
}

static void refused(int code, const char *says)
{
    if (c.code != code || !strstr(c.complained, says))
        print_error("%d %s\n", c.code, c.complained);
    assert_int_equal(c.code, code);
    assert_holds(c.complained, says);
    assert_int_equal(access(out, F_OK), -1);
}

static void what_cannot_be_is_refused_and_leaves_no_map(void **state)
{
    (void)state;
    unlink(out);
    MAP(list, "-o", out, "--size", "0.9,0.6");
    refused(COMMAND_USAGE, "without a reading the map has no scale");
    MAP(list, "-o", out, "--spot", "0,0,1");
    refused(COMMAND_USAGE, "--size");
    MAP(list, SPOT);
    refused(COMMAND_USAGE, "--out");
    MAP(list, "-o", out, SPOT, "--corners", "1,2,3");
    refused(COMMAND_USAGE, "1,2,3");
    MAP(list, "-o", out, SPOT, "--corners", "30,140,210,140,60,100,30,20");
    refused(COMMAND_USAGE, "convex");
    MAP(list, "-o", out, SPOT, "--corners", "30,20,210,20,210,140,30,140");
    refused(COMMAND_USAGE, "clockwise");
    MAP(list, "-o", out, SPOT, "--spot", "0,0.1,9000", "--response", response);
    refused(COMMAND_USAGE, "scales the map");
    MAP(list, "-o", out, "--size", "0.9,0.6", "--spot", "3,0,100", "--response", response);
    refused(COMMAND_USAGE, "ends before");
    MAP(list, "-o", out, SPOT, "--vignetting", "cos4");
    refused(COMMAND_USAGE, "focal length");
    MAP(list, "-o", out, SPOT, "--lens", "0,0,0,0,0");
    refused(COMMAND_USAGE, "--focal");
    MAP(list, "-o", out, SPOT, "--response", "none.csv");
    refused(COMMAND_USAGE, "none.csv");
    MAP(list, "-o", out, SPOT, "--top", "above");
    refused(COMMAND_USAGE, "above");
    MAP("/no/such/list.csv", "-o", out, SPOT);
    refused(COMMAND_USAGE, "/no/such/list.csv");
    const char *few = folder_put(&folder, "few.csv", "light-7.png,12.8\n");
    MAP(few, "-o", out, SPOT);
    refused(COMMAND_USAGE, "all exposures are equal");
}

static void half_a_series_makes_a_map_that_is_warned_about(void **state)
{
    (void)state;
    const char *half =
        folder_put(&folder, "half.csv", "light-3.png,0.8\nlight-4.png,1.6\nlight-5.png,3.2\n");
    MAP(half, "-o", out, SPOT, "--response", response);
    assert_int_equal(c.code, COMMAND_WARNED); // the bright stripe fills a pixel in 0.4 s
    assert_holds(c.complained, "clipped in every picture");
    assert_int_equal(access(out, R_OK), 0);
    MAP(half, "-o", out, "--size", "0.9,0.6", "--spot", "0,0.1,9000", "--response", response);
    assert_int_equal(c.code, COMMAND_USAGE);
    assert_holds(c.complained, "clipped");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_map_is_made_of_corners_that_are_found),
        cmocka_unit_test(corners_a_second_reading_and_a_picture_may_be_given),
        cmocka_unit_test(a_response_that_is_found_can_be_used_again),
        cmocka_unit_test(debevecs_method_does_it_too),
        cmocka_unit_test(half_a_series_makes_a_map_that_is_warned_about),
        cmocka_unit_test(what_cannot_be_is_refused_and_leaves_no_map),
    };
    return cmocka_run_group_tests(tests, make, clear);
}
