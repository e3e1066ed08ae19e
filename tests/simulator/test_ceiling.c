// SPDX-License-Identifier: Apache-2.0
#include "simulator/ceiling.h"

#include "tests/simulator/cmocka_here.h"

#define EXACT 1e-12      // relative: the same sum in another order
#define SMALL_PIXEL 1e-5 // relative: a 2 mm source seen from 0.5 m is nearly a point
#define QUADRATURE 1e-3  // relative: 4 cm pixels at 1 m, midpoint rule
#define ENDLESS 1e-3     // relative: a ceiling 60 times as wide as it is high is nearly endless
#define HALF_CELL 1e-12  // absolute: a uniform image stays uniform when resampled

static const struct vec3 up = {0, 1, 0}, origin = {0, 0, 0};

static struct ceiling_image uniform(double width_m, double depth_m, double height_m, int width,
                                    int height, double luminance)
{
    struct ceiling_image image = {
        {0, height_m, 0}, width_m,
        depth_m,          width,
        height,           malloc(sizeof *image.luminance * (size_t)width * (size_t)height)};
    for (int i = 0; i < width * height; i++)
        image.luminance[i] = luminance;
    return image;
}

static void a_small_source_follows_the_inverse_square_law(void **state)
{
    (void)state;
    struct ceiling_image image = uniform(0.002, 0.002, 0.5, 1, 1, 10000);
    double near = ceiling_illuminance(&image, origin, up);
    double far = ceiling_illuminance(&image, (struct vec3){0, -0.5, 0}, up);
    assert_near(near, 10000 * 0.002 * 0.002 / 0.25, SMALL_PIXEL * near);
    assert_near(near, 4 * far, EXACT * near);
    ceiling_fini(&image);
}

static void a_tilted_surface_follows_the_cosine_law(void **state)
{
    (void)state;
    struct ceiling_image image = uniform(0.002, 0.002, 0.5, 1, 1, 10000);
    double straight = ceiling_illuminance(&image, origin, up);
    for (int deg = 0; deg < 90; deg += 15) {
        double a = deg * M_PI / 180;
        struct vec3 n = {sin(a) * 0.6, cos(a), sin(a) * 0.8};
        assert_near(ceiling_illuminance(&image, origin, n), straight * cos(a), EXACT * straight);
    }
    assert_true(ceiling_illuminance(&image, origin, (struct vec3){0, -1, 0}) == 0);
    ceiling_fini(&image);
}

static void light_from_the_side_falls_with_the_fourth_power_of_the_cosine(void **state)
{
    (void)state;
    struct ceiling_image image = uniform(0.002, 0.002, 0.5, 1, 1, 10000);
    double straight = ceiling_illuminance(&image, origin, up);
    for (double x = 0.1; x < 1; x += 0.2) {
        double cosine = 0.5 / hypot(0.5, x);
        assert_near(ceiling_illuminance(&image, (struct vec3){x, 0, 0}, up),
                    straight * pow(cosine, 4), EXACT * straight);
    }
    ceiling_fini(&image);
}

// Illuminance under the corner of a uniform rectangle a x b at height 1 over
// pi L: the textbook configuration factor (e.g. Howell's catalogue, B-3).
static double corner_factor(double a, double b)
{
    double ra = sqrt(1 + a * a), rb = sqrt(1 + b * b);
    return (a / ra * atan(b / ra) + b / rb * atan(a / rb)) / (2 * M_PI);
}

static void a_uniform_rectangle_matches_its_closed_form(void **state)
{
    (void)state;
    struct ceiling_image image = uniform(2, 1.2, 1, 50, 30, 1000);
    double expected = M_PI * 1000 * 4 * corner_factor(1, 0.6);
    assert_near(ceiling_illuminance(&image, origin, up), expected, QUADRATURE * expected);
    ceiling_fini(&image);
}

static void an_endless_uniform_ceiling_gives_pi_times_its_luminance(void **state)
{
    (void)state;
    struct ceiling_image image = uniform(60, 60, 1, 1500, 1500, 1000);
    assert_near(ceiling_illuminance(&image, origin, up), M_PI * 1000, ENDLESS * M_PI * 1000);
    ceiling_fini(&image);
}

static void nothing_above_the_ceiling_is_lit(void **state)
{
    (void)state;
    struct ceiling_image image = uniform(1, 1, 0.5, 10, 10, 1000);
    assert_true(ceiling_illuminance(&image, (struct vec3){0, 0.5, 0}, up) == 0);
    assert_true(ceiling_illuminance(&image, (struct vec3){0, 0.6, 0}, (struct vec3){0, -1, 0}) ==
                0);
    ceiling_fini(&image);
}

static void a_spot_is_the_mean_over_its_disc(void **state)
{
    (void)state;
    struct ceiling_image image = uniform(1, 1, 0.5, 100, 100, 300);
    assert_near(ceiling_spot(&image, 0.1, -0.2, 0.01), 300, EXACT * 300);
    assert_true(ceiling_spot(&image, 0.6, 0, 0.01) == 0);
    for (int i = 0; i < 100 * 50; i++)
        image.luminance[i] = 0; // the half with z < 0
    assert_near(ceiling_spot(&image, 0, 0, 0.1), 150, EXACT * 300);
    assert_near(ceiling_spot(&image, 0, 0.1, 0.1), 300, EXACT * 300);
    ceiling_fini(&image);
}

static void the_lamps_light_different_places(void **state)
{
    (void)state;
    struct scenario s;
    struct error err;
    small_booth(&s);
    struct ceiling_image images[3];
    for (int i = 0; i < 3; i++)
        assert_true(ceiling_make(&s.ceiling, &s.lamps[i], 1, &images[i], &err));
    double middle = s.ceiling.centre_m[2];
    double tube = ceiling_spot(&images[2], 0, middle - 0.11, 0.01);
    double spot = ceiling_spot(&images[0], -0.32, middle + 0.06, 0.01);
    assert_true(tube > 20 * ceiling_spot(&images[0], 0, middle - 0.11, 0.01));
    assert_true(spot > 20 * ceiling_spot(&images[2], -0.32, middle + 0.06, 0.01));
    for (int i = 0; i < 3; i++)
        ceiling_fini(&images[i]);
}

struct map_facts {
    double ratio, noise;
    int negative;
};

// Against a map without any error.
static struct map_facts facts_of(const struct exr *map, const struct exr *clean)
{
    struct map_facts f = {0};
    double sum = 0, wanted = 0, squares = 0;
    int count = map->width * map->height, bright = 0;
    for (int i = 0; i < count; i++) {
        sum += map->pixels[i];
        wanted += clean->pixels[i];
        f.negative += map->pixels[i] < 0;
    }
    f.ratio = sum / wanted;
    for (int i = 0; i < count; i++)
        if (clean->pixels[i] > 2000) {
            double off = map->pixels[i] / f.ratio / clean->pixels[i] - 1;
            squares += off * off;
            bright++;
        }
    f.noise = sqrt(squares / bright);
    return f;
}

static void the_cameras_map_is_off_in_scale_noisy_and_negative_where_dark(void **state)
{
    (void)state;
    struct scenario s;
    struct error err;
    struct ceiling_image image;
    struct exr clean = {0}, map = {0};
    small_booth(&s);
    s.ceiling.map_px[0] = 256;
    s.ceiling.map_px[1] = 170;
    struct scenario_ceiling perfect = s.ceiling;
    perfect.map_noise = perfect.map_read_noise_cdm2 = perfect.map_scale_error = 0;
    assert_true(ceiling_make(&s.ceiling, &s.lamps[1], 1, &image, &err));
    ceiling_scale(&image, 10000);
    assert_true(ceiling_camera_map(&image, &perfect, "D50", 1, &clean, &err));
    assert_true(ceiling_camera_map(&image, &s.ceiling, "D50", 1, &map, &err));
    struct map_facts f = facts_of(&map, &clean);
    assert_true(fabs(f.ratio - 1) > 0.015 && fabs(f.ratio - 1) < 0.045);
    assert_true(f.noise > 0.004 && f.noise < 0.006);
    assert_true(f.negative > 0 && f.negative < map.width * map.height / 10);
    double width = 0, depth = 0;
    assert_true(exr_number(&map, "boothd.width_m", &width) && width == s.ceiling.width_m);
    assert_true(exr_number(&map, "boothd.depth_m", &depth) && depth == s.ceiling.depth_m);
    assert_int_equal(exr_channel(&map, "Y"), 0);
    exr_fini(&clean);
    exr_fini(&map);
    ceiling_fini(&image);
}

static void resampling_to_a_map_keeps_a_uniform_image_uniform(void **state)
{
    (void)state;
    struct scenario s;
    struct error err;
    struct exr map = {0};
    scenario_preset(&s);
    s.ceiling.map_noise = s.ceiling.map_read_noise_cdm2 = s.ceiling.map_scale_error = 0;
    s.ceiling.map_px[0] = 37;
    s.ceiling.map_px[1] = 29;
    struct ceiling_image image = uniform(0.9, 0.6, 0.75, 100, 70, 512);
    assert_true(ceiling_camera_map(&image, &s.ceiling, "x", 1, &map, &err));
    for (int i = 0; i < 37 * 29; i++)
        assert_near(map.pixels[i], 512, HALF_CELL);
    exr_fini(&map);
    ceiling_fini(&image);
}

static void the_same_seed_gives_the_same_map_and_another_another(void **state)
{
    (void)state;
    struct scenario s;
    struct error err;
    struct exr map[3] = {0};
    small_booth(&s);
    for (int i = 0; i < 3; i++) {
        struct ceiling_image image;
        int seed = i < 2 ? 5 : 6;
        assert_true(ceiling_make(&s.ceiling, &s.lamps[0], seed, &image, &err));
        assert_true(ceiling_camera_map(&image, &s.ceiling, "A", seed, &map[i], &err));
        ceiling_fini(&image);
    }
    size_t size = sizeof *map[0].pixels * (size_t)map[0].width * (size_t)map[0].height;
    assert_memory_equal(map[0].pixels, map[1].pixels, size);
    assert_memory_not_equal(map[0].pixels, map[2].pixels, size);
    for (int i = 0; i < 3; i++)
        exr_fini(&map[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_small_source_follows_the_inverse_square_law),
        cmocka_unit_test(a_tilted_surface_follows_the_cosine_law),
        cmocka_unit_test(light_from_the_side_falls_with_the_fourth_power_of_the_cosine),
        cmocka_unit_test(a_uniform_rectangle_matches_its_closed_form),
        cmocka_unit_test(an_endless_uniform_ceiling_gives_pi_times_its_luminance),
        cmocka_unit_test(nothing_above_the_ceiling_is_lit),
        cmocka_unit_test(a_spot_is_the_mean_over_its_disc),
        cmocka_unit_test(the_lamps_light_different_places),
        cmocka_unit_test(the_cameras_map_is_off_in_scale_noisy_and_negative_where_dark),
        cmocka_unit_test(resampling_to_a_map_keeps_a_uniform_image_uniform),
        cmocka_unit_test(the_same_seed_gives_the_same_map_and_another_another),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
