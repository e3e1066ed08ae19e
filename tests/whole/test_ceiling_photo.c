// SPDX-License-Identifier: Apache-2.0
// The luminance map that boothcal makes of the emulated camera's pictures,
// against the ceiling that the emulated booth really has.
#include "tests/fakes/support.h"

#include "base/clock.h"
#include "calibration/ceiling_photo.h"
#include "simulator/photograph.h"
#include "simulator/world_control.h"
#include "tests/fakes/folder.h"

static const double LUMINANCE = 0.02; // the reach: of a place that is not clipped
static const double SHIFT = 0.002;    // and of geometry, of the ceiling's width
static const double LIT = 1e-3;       // of the greatest: below it the trim is, and noise
static const double TYPICAL = 0.01;   // of 99 in 100 even places: tells that 2 % is no chance

enum { MAP_W = 256, MAP_H = 170 };

static struct folder folder;
static struct scenario scenario;
static struct world *world;

// The shipped booth with a camera of fewer pixels; more settings are the test's.
static int make_scenario(void **state)
{
    (void)state;
    struct error err = {0};
    folder_open(&folder);
    if (!scenario_load("simulator/scenarios/booth.ini", &scenario, &err))
        return -1;
    scenario.world.cold = false;
    scenario.ceiling_camera.width_px = 640;
    scenario.ceiling_camera.height_px = 480;
    scenario.ceiling_camera.focal_px = 410;
    return 0;
}

static int clear(void **state)
{
    (void)state;
    folder_close(&folder);
    return 0;
}

struct shot {
    struct exr truth, map;
    struct ceiling_photo photo;
    json_t *answer;
    struct ceiling_recipe recipe;
    char list[256];
};

static void light_lamp(const char *name)
{
    struct error err = {0};
    json_t *request = json_pack("{ss}", "name", name);
    json_t *reply = world_answer(world, 2 * NS_PER_S, CONTROL_LAMP, request, &err);
    assert_non_null(reply);
    json_decref(request);
    json_decref(reply);
}

// What a radiometer reads at two places of the lit ceiling.
static struct spot_scale scale_by_spots(const struct shot *s, const char *lamp)
{
    const struct ceiling_image *image =
        &world_lamp(world, scenario_lamp_index(&scenario, lamp))->image;
    struct spot_reading readings[2] = {{0.33, -0.15, 0}, {-0.2, -0.22, 0}};
    struct luminance_map map;
    struct spot_scale scale;
    struct error err = {0};
    for (int i = 0; i < 2; i++)
        readings[i].cdm2 = ceiling_spot(image, readings[i].x_m, readings[i].z_m, 0.01);
    assert_true(ceiling_photo_map(&s->photo, &s->recipe.ceiling, &map, &err));
    if (!spots_apply(&map, readings, 2, &scale, &err))
        print_error("%s\n", err.text);
    assert_string_equal(err.text, "");
    luminance_map_fini(&map);
    return scale;
}

// Photographs a lamp and makes the map of it, as the command does.
static void shoot(struct shot *s, const char *lamp, enum response_source response)
{
    struct error err = {0};
    char pictures[128], path[256];
    snprintf(pictures, sizeof pictures, "%s", folder_at(&folder, lamp));
    *s = (struct shot){.answer = NULL};
    world = world_create(&scenario, NS_PER_S, &err);
    assert_non_null(world);
    light_lamp(lamp);
    s->answer = photograph(world, 3 * NS_PER_S, pictures, &err);
    assert_non_null(s->answer);
    snprintf(s->list, sizeof s->list, "%s/list.csv", pictures);
    s->recipe = (struct ceiling_recipe){.list = s->list,
                                        .response = response,
                                        .ceiling = {{0, 0.75, 0.05}, 0.9, 0.6},
                                        .width_px = MAP_W,
                                        .height_px = MAP_H};
    snprintf(path, sizeof path, "%s/camera.ini", pictures);
    assert_true(still_camera_load(path, &s->recipe.camera, &err));
    if (!ceiling_photo_take(&s->recipe, &s->photo, &err))
        print_error("%s\n", err.text);
    assert_string_equal(err.text, "");
    struct ceiling_origin origin = {.spots = scale_by_spots(s, lamp)};
    snprintf(path, sizeof path, "%s/map.exr", pictures);
    assert_true(ceiling_photo_save(path, &s->photo, &s->recipe.ceiling, &origin, &err));
    assert_true(exr_load(path, &s->map, &err));
    snprintf(path, sizeof path, "%s/truth.exr", pictures);
    assert_true(exr_load(path, &s->truth, &err));
    world_destroy(world);
}

static void put_away(struct shot *s)
{
    ceiling_photo_fini(&s->photo);
    exr_fini(&s->map);
    exr_fini(&s->truth);
    json_decref(s->answer);
}

// ---- luminance -------------------------------------------------------------

static double truth_at(const struct shot *s, double x, double y)
{
    double cx = fmin(fmax(x, 0), MAP_W - 1.001), cy = fmin(fmax(y, 0), MAP_H - 1.001);
    int i = (int)cx, j = (int)cy;
    const float *a = s->truth.pixels + j * MAP_W + i, *b = a + MAP_W;
    double u = cx - i, v = cy - j;
    return (1 - v) * ((1 - u) * (double)a[0] + u * (double)a[1]) +
           v * ((1 - u) * (double)b[0] + u * (double)b[1]);
}

static double greatest(const struct exr *image)
{
    double most = 0;
    for (int i = 0; i < MAP_W * MAP_H; i++)
        most = fmax(most, (double)image->pixels[i]);
    return most;
}

// How far a pixel is outside what the truth is within SHIFT of its place.
static double beyond(const struct shot *s, int x, int y, double got)
{
    double least = INFINITY, most = 0, reach = SHIFT * MAP_W;
    for (int k = 0; k < 17; k++) {
        double turn = k * M_PI / 8, r = k < 16 ? reach : 0;
        double there = truth_at(s, x + r * cos(turn), y + r * sin(turn));
        least = fmin(least, there);
        most = fmax(most, there);
    }
    return got > most ? got / most - 1 : got < least ? 1 - got / least : 0;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void check_luminance(const struct shot *s)
{
    static double off[MAP_W * MAP_H];
    const float *Y = s->map.pixels + exr_channel(&s->map, "Y") * MAP_W * MAP_H;
    const float *clipped = s->map.pixels + exr_channel(&s->map, "clipped") * MAP_W * MAP_H;
    double dark = LIT * greatest(&s->truth);
    int n = 0;
    for (int i = 0; i < MAP_W * MAP_H; i++)
        if (clipped[i] == 0 && (double)s->truth.pixels[i] > dark)
            off[n++] = beyond(s, i % MAP_W, i / MAP_W, (double)Y[i]);
    qsort(off, (size_t)n, sizeof *off, by_size);
    print_message("%d places: off by %.2f %% (99 %%), %.2f %% (all)\n", n, 100 * off[n * 99 / 100],
                  100 * off[n - 1]);
    assert_true(n > MAP_W * MAP_H / 2);
    assert_true(off[n - 1] <= LUMINANCE);
    assert_true(off[n * 99 / 100] <= TYPICAL);
}

// ---- geometry --------------------------------------------------------------

// Centroid of what is brighter than half the greatest, in a part of the map.
static bool centroid(const float *light, int left, int top, int right, int bottom, double at[2])
{
    double most = 0, sum = 0;
    at[0] = at[1] = 0;
    for (int y = top; y < bottom; y++)
        for (int x = left; x < right; x++)
            most = fmax(most, (double)light[y * MAP_W + x]);
    for (int y = top; y < bottom; y++)
        for (int x = left; x < right; x++) {
            double over = (double)light[y * MAP_W + x] - most / 2;
            if (over <= 0)
                continue;
            sum += over;
            at[0] += over * x;
            at[1] += over * y;
        }
    at[0] /= sum;
    at[1] /= sum;
    return sum > 0;
}

// Where along a row or a column light first passes half of what it has `deep`
// pixels farther in.
static double edge_along(const float *light, int from, int step, int deep)
{
    double half = (double)light[from + deep * step] / 2;
    for (int i = 1; i < deep; i++) {
        double a = (double)light[from + (i - 1) * step], b = (double)light[from + i * step];
        if (a < half && b >= half)
            return i - 1 + (half - a) / (b - a);
    }
    return NAN;
}

static void check_shift(double got, double wanted, const char *what)
{
    if (!(fabs(got - wanted) <= SHIFT * MAP_W))
        print_error("%s: at %.3f, not %.3f pixels\n", what, got, wanted);
    assert_true(fabs(got - wanted) <= SHIFT * MAP_W);
}

static void check_geometry(const struct shot *s)
{
    const float *truth = s->truth.pixels;
    const float *map = s->map.pixels + exr_channel(&s->map, "Y") * MAP_W * MAP_H;
    enum { ACROSS = 5, DOWN = 3, DEEP = 8 };
    double most = 0;
    for (int k = 0; k < ACROSS * DOWN; k++) {
        int left = k % ACROSS * MAP_W / ACROSS, top = k / ACROSS * MAP_H / DOWN;
        double a[2], b[2];
        assert_true(centroid(truth, left, top, left + MAP_W / ACROSS, top + MAP_H / DOWN, a) &&
                    centroid(map, left, top, left + MAP_W / ACROSS, top + MAP_H / DOWN, b));
        check_shift(b[0], a[0], "centroid across");
        check_shift(b[1], a[1], "centroid down");
        most = fmax(most, hypot(b[0] - a[0], b[1] - a[1]));
    }
    for (int i = 1; i < 8; i++) {
        int row = i * MAP_H / 8 * MAP_W, column = i * MAP_W / 8, last = MAP_H - 1;
        check_shift(edge_along(map, row, 1, DEEP), edge_along(truth, row, 1, DEEP), "left edge");
        check_shift(edge_along(map, row + MAP_W - 1, -1, DEEP),
                    edge_along(truth, row + MAP_W - 1, -1, DEEP), "right edge");
        check_shift(edge_along(map, column, MAP_W, DEEP), edge_along(truth, column, MAP_W, DEEP),
                    "far edge");
        check_shift(edge_along(map, last * MAP_W + column, -MAP_W, DEEP),
                    edge_along(truth, last * MAP_W + column, -MAP_W, DEEP), "near edge");
    }
    print_message("centroids off by %.3f %% of the width at most\n", 100 * most / MAP_W);
}

// The ceiling's own corners, behind the trim, fall where they do.
static void check_corners(const struct shot *s)
{
    double uv[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, px[4][2];
    struct ceiling_view view;
    struct error err = {0};
    assert_true(ceiling_view_make(&s->recipe.camera, 640, 480,
                                  (const double(*)[2])s->photo.corner_px, &s->recipe.ceiling, &view,
                                  &err));
    assert_true(ceiling_view_pixels(&view, (const double(*)[2])uv, 4, px, &err));
    for (size_t i = 0; i < 4; i++) {
        json_t *c = json_array_get(json_object_get(s->answer, "corners_px"), i);
        double dx = px[i][0] - json_number_value(json_array_get(c, 0));
        double dy = px[i][1] - json_number_value(json_array_get(c, 1));
        assert_true(hypot(dx, dy) <= SHIFT * (px[1][0] - px[0][0]));
    }
}

static void a_map_of_tubes_is_within_2_percent_and_a_fifth_of_a_percent_of_the_width(void **state)
{
    (void)state;
    struct shot s;
    shoot(&s, "D50", CURVE_ROBERTSON);
    check_luminance(&s);
    check_geometry(&s);
    check_corners(&s);
    assert_true(s.photo.method_difference < 0.02);
    put_away(&s);
}

static void a_map_of_spots_is_so_too_with_debevecs_response(void **state)
{
    (void)state;
    struct shot s;
    shoot(&s, "A", CURVE_DEBEVEC);
    check_luminance(&s);
    check_geometry(&s);
    check_corners(&s);
    put_away(&s);
}

static void
without_the_shortest_exposures_what_is_clipped_is_marked_and_the_rest_is_right(void **state)
{
    (void)state;
    struct shot s;
    scenario.ceiling_camera.shortest_s *= 8;
    scenario.ceiling_camera.exposures -= 2;
    shoot(&s, "D65", CURVE_AUTO);
    const float *Y = s.map.pixels + exr_channel(&s.map, "Y") * MAP_W * MAP_H;
    const float *clipped = s.map.pixels + exr_channel(&s.map, "clipped") * MAP_W * MAP_H;
    int count = 0;
    for (int i = 0; i < MAP_W * MAP_H; i++) {
        count += clipped[i] == 1;
        if (clipped[i] == 1)
            assert_true((double)Y[i] < (1 + LUMINANCE) * (double)s.truth.pixels[i]);
    }
    assert_true(count > 500);
    check_luminance(&s);
    put_away(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_map_of_tubes_is_within_2_percent_and_a_fifth_of_a_percent_of_the_width),
        cmocka_unit_test(a_map_of_spots_is_so_too_with_debevecs_response),
        cmocka_unit_test(
            without_the_shortest_exposures_what_is_clipped_is_marked_and_the_rest_is_right),
    };
    return cmocka_run_group_tests(tests, make_scenario, clear);
}
