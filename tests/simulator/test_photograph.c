// SPDX-License-Identifier: Apache-2.0
// The emulated still camera: lens, sensor, and the series it takes.
#include "simulator/photograph.h"

#include "simulator/lens.h"
#include "simulator/sensor.h"
#include "tests/simulator/cmocka_here.h"

#include "base/clock.h"
#include "tests/fakes/folder.h"

#define EXACT 1e-12   // the same formula in double
#define SOLVED 1e-11  // Newton's method ends at 1e-14 of tangents, times a slope
#define ROUNDED 1e-9  // pixels: Newton's method times the focal length
#define HALF_STEP 0.6 // and to 1/65536 of the well before
#define PIXEL 0.06    // relative: what lies in a pixel is not what lies in a disc about its middle
#define PIXEL_MEAN 0.005 // relative: the mean of that over hundreds of pixels
#define FLOATS 1e-6      // relative: truth.exr holds floats

static struct scenario booth;

static int a_booth(void **state)
{
    (void)state;
    small_booth(&booth);
    return 0;
}

// ---- lens ------------------------------------------------------------------

static void distortion_is_that_of_conrady_and_brown(void **state)
{
    (void)state;
    struct scenario_ceiling_camera c = booth.ceiling_camera;
    memcpy(c.radial, (double[3]){-0.12, 0.03, -0.004}, sizeof c.radial);
    memcpy(c.decentred, (double[2]){0.0006, -0.0004}, sizeof c.decentred);
    struct lens lens = lens_make(&c);
    struct tangent d = lens_distort(&lens, (struct tangent){0.3, 0.4});
    // r2 = 0.25: factor 1 - 0.03 + 0.001875 - 0.0000625.
    assert_near(d.x, 0.3 * 0.9718125 + 0.0006 * 0.43 - 2 * 0.0004 * 0.12, EXACT);
    assert_near(d.y, 0.4 * 0.9718125 + 2 * 0.0006 * 0.12 - 0.0004 * 0.57, EXACT);
    struct tangent axis = lens_distort(&lens, (struct tangent){0, 0});
    assert_true(axis.x == 0 && axis.y == 0);
}

static void distorting_and_back_ends_where_it_began(void **state)
{
    (void)state;
    struct lens lens = lens_make(&booth.ceiling_camera);
    for (double x = -0.9; x <= 0.9; x += 0.15)
        for (double y = -0.7; y <= 0.7; y += 0.1) {
            struct tangent back =
                lens_undistort(&lens, lens_distort(&lens, (struct tangent){x, y}));
            assert_near(back.x, x, SOLVED);
            assert_near(back.y, y, SOLVED);
        }
}

static void light_falls_with_the_fourth_power_of_the_cosine(void **state)
{
    (void)state;
    struct scenario_ceiling_camera c = booth.ceiling_camera;
    c.vignetting = 0;
    struct lens lens = lens_make(&c);
    assert_near(lens_falloff(&lens, (struct tangent){0, 0}), 1, EXACT);
    assert_near(lens_falloff(&lens, (struct tangent){1, 0}), 0.25, EXACT);         // 45 degrees
    assert_near(lens_falloff(&lens, (struct tangent){0, sqrt(3)}), 0.0625, EXACT); // 60
    c.vignetting = -0.1;
    assert_near(lens_falloff(&lens, (struct tangent){1, 0}), 0.225, EXACT);
}

static void a_camera_at_zero_angles_looks_straight_up_with_near_on_top(void **state)
{
    (void)state;
    struct scenario_ceiling_camera c = {.width_px = 101, .height_px = 81, .focal_px = 100};
    struct lens lens = lens_make(&c);
    double x, y;
    assert_true(lens_project(&lens, (struct vec3){0, 1, 0}, &x, &y));
    assert_near(x, 50, EXACT);
    assert_near(y, 40, EXACT);
    assert_true(lens_project(&lens, (struct vec3){0.1, 1, 0.2}, &x, &y));
    assert_near(x, 60, ROUNDED);
    assert_near(y, 20, ROUNDED);
    assert_false(lens_project(&lens, (struct vec3){0, -1, 0}, &x, &y));
}

static void the_direction_of_a_pixel_leads_back_to_it(void **state)
{
    (void)state;
    struct lens lens = lens_make(&booth.ceiling_camera);
    for (double at_x = 0; at_x < booth.ceiling_camera.width_px; at_x += 57)
        for (double at_y = 0; at_y < booth.ceiling_camera.height_px; at_y += 48) {
            struct vec3 d = lens_direction(&lens, at_x, at_y);
            double x, y;
            assert_true(lens_project(&lens, vec3_add(lens.place, vec3_scale(d, 0.7)), &x, &y));
            assert_near(x, at_x, ROUNDED);
            assert_near(y, at_y, ROUNDED);
        }
}

// ---- sensor ----------------------------------------------------------------

static struct scenario_ceiling_camera linear_camera(int width, int height)
{
    struct scenario_ceiling_camera c = booth.ceiling_camera;
    c.width_px = width;
    c.height_px = height;
    c.bits = 16;
    c.response = RESPONSE_LINEAR;
    c.dark_e_s = c.hot_share = c.read_noise_e = 0;
    return c;
}

static void counts_of_film_rise_from_nothing_to_all(void **state)
{
    (void)state;
    assert_true(sensor_response(RESPONSE_FILM, 0) == 0);
    assert_near(sensor_response(RESPONSE_FILM, 1), 1, EXACT);
    assert_near(sensor_response(RESPONSE_FILM, 0.5), 0.81353, 1e-5); // by hand
    for (double x = 0; x < 1; x += 0.001)
        assert_true(sensor_response(RESPONSE_FILM, x + 0.001) > sensor_response(RESPONSE_FILM, x));
    assert_near(sensor_response(RESPONSE_LINEAR, 0.3), 0.3, EXACT);
}

// Mean and variance of the electrons that equal light gives.
static void electrons(const struct scenario_ceiling_camera *c, double cdm2, double exposure_s,
                      double *mean, double *variance)
{
    size_t count = (size_t)c->width_px * (size_t)c->height_px;
    double *light = malloc(count * sizeof *light), sum = 0, square = 0;
    struct sensor sensor;
    struct picture out;
    struct error err;
    struct chance chance = chance_start(1, "test", 1);
    for (size_t i = 0; i < count; i++)
        light[i] = cdm2;
    assert_true(sensor_init(&sensor, c, 1, &err));
    assert_true(sensor_expose(&sensor, light, 1, exposure_s, &chance, &out, &err));
    for (size_t i = 0; i < count; i++) {
        double e = out.samples[i] / 65535.0 * c->full_well_e;
        sum += e;
        square += e * e;
    }
    *mean = sum / (double)count;
    *variance = square / (double)count - *mean * *mean;
    picture_fini(&out);
    sensor_fini(&sensor);
    free(light);
}

static void the_variance_of_electrons_is_their_number_and_that_of_reading(void **state)
{
    (void)state;
    struct scenario_ceiling_camera c = linear_camera(200, 100);
    double mean, variance;
    for (double read = 0; read <= 40; read += 40) {
        c.read_noise_e = read;
        electrons(&c, 1000, 0.002, &mean, &variance);
        // 2000 e/(cd/m2 s): 4000 electrons. Five standard errors of 20000 pixels.
        double wanted = 4000 + read * read;
        assert_near(mean, 4000, 5 * sqrt(wanted / 20000));
        assert_near(variance, wanted, 5 * wanted * sqrt(2.0 / 20000));
    }
}

static void a_full_well_holds_no_more(void **state)
{
    (void)state;
    struct scenario_ceiling_camera c = linear_camera(50, 50);
    double mean, variance;
    electrons(&c, 1000, 0.1, &mean, &variance);
    assert_near(mean, c.full_well_e, ROUNDED);
    assert_near(variance, 0, 1e-3); // rounding of sums of squares of 20000
}

static void without_light_only_the_hot_pixels_show(void **state)
{
    (void)state;
    struct scenario_ceiling_camera c = linear_camera(300, 200);
    struct sensor sensor;
    struct picture out;
    struct error err;
    struct chance chance = chance_start(1, "test", 2);
    int bright = 0;
    c.dark_e_s = 10;
    c.hot_share = 0.01;
    assert_true(sensor_init(&sensor, &c, 3, &err));
    assert_true(sensor_expose(&sensor, NULL, 1, 1, &chance, &out, &err));
    for (int i = 0; i < 300 * 200; i++)
        bright += out.samples[i] > 500 / c.full_well_e * 65535;
    assert_near(bright, 600, 5 * sqrt(600)); // a binomial count
    picture_fini(&out);
    sensor_fini(&sensor);
}

// ---- the series ------------------------------------------------------------

static struct folder folder;
static struct world *world;
static json_t *answer;

static int a_series(void **state)
{
    (void)state;
    struct error err = {0};
    struct scenario s = booth;
    s.ceiling_camera = linear_camera(160, 120);
    s.ceiling_camera.focal_px = 100;
    s.ceiling_camera.sensitivity = 1e8; // noise of a full well is 5e-6 of it
    s.ceiling_camera.full_well_e = 1e7;
    s.ceiling_camera.shortest_s = 1e-5;
    s.ceiling_camera.exposures = 3;
    s.ceiling_camera.darks = 1;
    s.ceiling_camera.flats = 2;
    folder_open(&folder);
    world = world_create(&s, NS_PER_S, &err);
    answer = world ? photograph(world, 2 * NS_PER_S, folder_at(&folder, "D50"), &err) : NULL;
    if (!answer)
        print_error("%s\n", err.text);
    return answer ? 0 : -1;
}

static int no_series(void **state)
{
    (void)state;
    json_decref(answer);
    world_destroy(world);
    folder_close(&folder);
    return 0;
}

static void the_list_names_every_frame_with_its_exposure(void **state)
{
    (void)state;
    char text[1024];
    FILE *in = fopen(folder_at(&folder, "D50/list.csv"), "r");
    assert_non_null(in);
    text[fread(text, 1, sizeof text - 1, in)] = 0;
    fclose(in);
    assert_string_equal(text, "light-01.png,1e-05,light\nlight-02.png,2.3e-05,light\n"
                              "light-03.png,5.29e-05,light\ndark-03.png,5.29e-05,dark\n"
                              "flat-01.png,6e-05,flat\nflat-02.png,6e-05,flat\n");
    assert_int_equal(json_integer_value(json_object_get(answer, "frames")), 3);
}

static struct picture frame(const char *name)
{
    struct picture p = {0};
    struct error err = {0};
    char path[64];
    snprintf(path, sizeof path, "D50/%s.png", name);
    if (!png_load(folder_at(&folder, path), &p, &err))
        fail_msg("%s", err.text);
    return p;
}

static void corner(int i, double *x, double *y)
{
    json_t *c = json_array_get(json_object_get(answer, "corners_px"), (size_t)i);
    *x = json_number_value(json_array_get(c, 0));
    *y = json_number_value(json_array_get(c, 1));
}

// Seen from below with near on top: far left is below left.
static void the_corners_of_the_ceiling_run_anticlockwise_from_below_left(void **state)
{
    (void)state;
    double x[4], y[4];
    for (int i = 0; i < 4; i++)
        corner(i, &x[i], &y[i]);
    assert_true(x[0] < 80 && y[0] > 60 && x[1] > 80 && y[1] > 60);
    assert_true(x[2] > 80 && y[2] < 60 && x[3] < 80 && y[3] < 60);
}

static void the_picture_turns_from_wall_to_dark_trim_at_the_corner(void **state)
{
    (void)state;
    struct picture p = frame("light-03");
    double x, y;
    for (int i = 0; i < 4; i++) {
        corner(i, &x, &y);
        int out_x = (int)lround(x + (x < 80 ? -3 : 3)), out_y = (int)lround(y + (y < 60 ? -3 : 3));
        int in_x = (int)lround(x + (x < 80 ? 0.8 : -0.8)),
            in_y = (int)lround(y + (y < 60 ? 0.8 : -0.8));
        assert_true(p.samples[out_y * 160 + out_x] > 20);
        assert_true(p.samples[in_y * 160 + in_x] < p.samples[out_y * 160 + out_x] / 2);
    }
    picture_fini(&p);
}

static bool even_place(const struct ceiling_image *image, double x, double z, double l)
{
    for (int i = 0; i < 8; i++) {
        double turn = i * M_PI / 4, beside = 0.01;
        double there = ceiling_spot(image, x + beside * cos(turn), z + beside * sin(turn), 0.007);
        if (!(l > 100) || fabs(there / l - 1) > PIXEL)
            return false;
    }
    return true;
}

// What falls on the middle pixel is the lamp's own luminance there.
static void counts_are_light_times_exposure(void **state)
{
    (void)state;
    const struct scenario_ceiling_camera *c = &world_scenario(world)->ceiling_camera;
    const struct ceiling_image *image = &world_lamp(world, 1)->image;
    struct lens lens = lens_make(c);
    struct picture one = frame("light-01"), two = frame("light-02");
    int compared = 0;
    double sum = 0;
    for (int y = 20; y < 100; y += 3)
        for (int x = 30; x < 130; x += 3) {
            struct vec3 d = lens_direction(&lens, x, y);
            double t = (image->centre.y - lens.place.y) / d.y;
            double at_x = lens.place.x + t * d.x, at_z = lens.place.z + t * d.z;
            double l = ceiling_spot(image, at_x, at_z, 0.007);
            if (!even_place(image, at_x, at_z, l))
                continue;
            double share = l * lens_falloff(&lens, lens_ideal(&lens, x, y)) * c->sensitivity *
                           c->shortest_s / c->full_well_e;
            if (share > 0.4)
                continue;
            double counts = one.samples[y * 160 + x];
            assert_near(counts, 65535 * share, PIXEL * counts + HALF_STEP);
            sum += counts / (65535 * share);
            // Five standard errors: 152.6 electrons a count, 2.3 (1 + 2.3) times as many.
            assert_near(two.samples[y * 160 + x], 2.3 * counts, 1.12 * sqrt(counts) + 1);
            compared++;
        }
    assert_true(compared > 100);
    assert_near(sum / compared, 1, PIXEL_MEAN);
    picture_fini(&one);
    picture_fini(&two);
}

static void the_truth_is_the_lamps_own_light(void **state)
{
    (void)state;
    struct exr truth = {0};
    struct error err = {0};
    const struct ceiling_image *image = &world_lamp(world, 1)->image;
    assert_true(exr_load(folder_at(&folder, "D50/truth.exr"), &truth, &err));
    double sum = 0, all = 0, width;
    for (int i = 0; i < truth.width * truth.height; i++)
        sum += (double)truth.pixels[i] / (truth.width * truth.height);
    for (int i = 0; i < image->width * image->height; i++)
        all += image->luminance[i] / (image->width * image->height);
    assert_near(sum, all, FLOATS * all);
    assert_true(exr_number(&truth, "boothd.width_m", &width));
    assert_near(width, 0.9, EXACT);
    exr_fini(&truth);
}

static void a_flat_field_shows_the_falloff_alone(void **state)
{
    (void)state;
    struct picture p = frame("flat-01");
    struct lens lens = lens_make(&world_scenario(world)->ceiling_camera);
    double middle = p.samples[59 * 160 + 79] / lens_falloff(&lens, lens_ideal(&lens, 79, 59));
    for (int y = 0; y < 120; y += 17)
        for (int x = 0; x < 160; x += 13)
            assert_near(p.samples[y * 160 + x],
                        middle * lens_falloff(&lens, lens_ideal(&lens, x, y)), 2e-3 * middle);
    picture_fini(&p);
}

int main(void)
{
    const struct CMUnitTest parts[] = {
        cmocka_unit_test(distortion_is_that_of_conrady_and_brown),
        cmocka_unit_test(distorting_and_back_ends_where_it_began),
        cmocka_unit_test(light_falls_with_the_fourth_power_of_the_cosine),
        cmocka_unit_test(a_camera_at_zero_angles_looks_straight_up_with_near_on_top),
        cmocka_unit_test(the_direction_of_a_pixel_leads_back_to_it),
        cmocka_unit_test(counts_of_film_rise_from_nothing_to_all),
        cmocka_unit_test(the_variance_of_electrons_is_their_number_and_that_of_reading),
        cmocka_unit_test(a_full_well_holds_no_more),
        cmocka_unit_test(without_light_only_the_hot_pixels_show),
    };
    const struct CMUnitTest series[] = {
        cmocka_unit_test(the_list_names_every_frame_with_its_exposure),
        cmocka_unit_test(the_corners_of_the_ceiling_run_anticlockwise_from_below_left),
        cmocka_unit_test(the_picture_turns_from_wall_to_dark_trim_at_the_corner),
        cmocka_unit_test(counts_are_light_times_exposure),
        cmocka_unit_test(the_truth_is_the_lamps_own_light),
        cmocka_unit_test(a_flat_field_shows_the_falloff_alone),
    };
    int failed = cmocka_run_group_tests(parts, a_booth, NULL);
    return failed + cmocka_run_group_tests(series, a_series, no_series);
}
