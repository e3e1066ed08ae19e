// SPDX-License-Identifier: Apache-2.0
#include "tests/render/support.h"

#include "render/stand.h"

// Sums in double over 1e5 pixels.
static const double ENERGY = 1e-12;

static const struct stand STAND = {{0, 0, 0}, {0, 0.20, 0.03}};
static const struct screen SCREEN = {0.520, 0.325, 1280, 800};

static double map_candela(const struct luminance_map *map)
{
    long double sum = 0;
    for (int i = 0; i < map->width * map->height; i++)
        sum += map->luminance[i];
    return (double)(sum * map->ceiling.width_m * map->ceiling.depth_m / map->width / map->height);
}

static double lights_candela(const struct light_points *lights)
{
    double sum = 0;
    for (int i = 0; i < lights->count; i++)
        sum += lights->points[i].intensity_cd;
    return sum;
}

static struct light_points cut(const struct luminance_map *map, enum median_cut how, int most)
{
    struct light_points lights;
    struct error err = {0};
    assert_good(median_cut(map, how, most, &lights, &err), err);
    return lights;
}

// Every light lit and on the ceiling, their sum the map's.
static void check_lights(const struct luminance_map *map, const struct light_points *lights)
{
    const struct ceiling *c = &map->ceiling;
    for (int i = 0; i < lights->count; i++) {
        const struct light_point *p = &lights->points[i];
        assert_true(p->intensity_cd > 0);
        assert_true(fabs(p->at.x - c->centre_m[0]) <= c->width_m / 2);
        assert_true(fabs(p->at.z - c->centre_m[2]) <= c->depth_m / 2);
        assert_true(p->at.y == c->centre_m[1]);
    }
    assert_relative(lights_candela(lights), map_candela(map), ENERGY);
}

static void the_lights_hold_the_light_of_the_map_and_none_is_empty(void **state)
{
    (void)state;
    double (*const patterns[])(double, double) = {uniform_light, tubes, spots};
    for (size_t k = 0; k < 3; k++) {
        struct luminance_map map = map_from(booth_ceiling(), 320, 200, patterns[k]);
        for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++)
            for (int most = 1; most <= 600; most = most * 3 + 1) {
                struct light_points lights = cut(&map, how, most);
                assert_int_equal(lights.count, most);
                check_lights(&map, &lights);
                light_points_fini(&lights);
            }
        luminance_map_fini(&map);
    }
}

static void maps_of_one_to_five_pixels_a_side_become_exactly_their_lit_pixels(void **state)
{
    (void)state;
    for (int width = 1; width <= 5; width++)
        for (int height = 1; height <= 5; height++) {
            struct luminance_map map = map_from(booth_ceiling(), width, height, uniform_light);
            int lit = 0;
            for (int i = 0; i < width * height; i++) {
                map.luminance[i] = i % 3 == 1 ? 0 : 1 + i;
                lit += map.luminance[i] > 0;
            }
            for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
                struct light_points lights = cut(&map, how, 4096);
                assert_int_equal(lights.count, lit);
                check_lights(&map, &lights);
                light_points_fini(&lights);
            }
            luminance_map_fini(&map);
        }
}

static void a_row_and_a_column_of_pixels_are_cut_into_as_many_as_wanted(void **state)
{
    (void)state;
    for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
        struct luminance_map row = map_from(booth_ceiling(), 257, 1, tubes);
        struct luminance_map column = map_from(booth_ceiling(), 1, 257, tubes);
        struct light_points a = cut(&row, how, 100), b = cut(&column, how, 100);
        assert_int_equal(a.count, 100);
        assert_int_equal(b.count, 100);
        check_lights(&row, &a);
        check_lights(&column, &b);
        light_points_fini(&a);
        light_points_fini(&b);
        luminance_map_fini(&row);
        luminance_map_fini(&column);
    }
}

static void a_dark_map_gives_no_light_and_no_illuminance(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 64, 32, no_light);
    struct light_points lights = cut(&map, CUT_VARIANCE, 32);
    struct vec3 p = {0, 0, 0}, up = {0, 1, 0};
    assert_int_equal(lights.count, 0);
    assert_true(light_points_illuminance(&lights, 1, p, up) == 0);
    assert_true(luminance_map_illuminance(&map, p, up) == 0);
    light_points_fini(&lights);
    luminance_map_fini(&map);
}

static void one_lit_pixel_gives_one_light_in_its_middle(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 90, 60, no_light);
    map.luminance[7 * 90 + 12] = 5000;
    struct light_points lights = cut(&map, CUT_VARIANCE, 32);
    assert_int_equal(lights.count, 1);
    assert_relative(lights.points[0].intensity_cd, 5000 * 0.01 * 0.01, ENERGY);
    assert_float_within(lights.points[0].at.x, -0.45 + 0.125, 1e-15);
    assert_float_within(lights.points[0].at.z, 0.05 - 0.30 + 0.075, 1e-15);
    light_points_fini(&lights);
    luminance_map_fini(&map);
}

static void a_uniform_map_is_cut_into_equal_parts(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 96, 64, uniform_light);
    for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
        struct light_points lights = cut(&map, how, 32);
        for (int i = 0; i < 32; i++)
            assert_relative(lights.points[i].intensity_cd, 3000 * 0.54 / 32, ENERGY);
        light_points_fini(&lights);
    }
    luminance_map_fini(&map);
}

static void a_faint_corner_beside_a_bright_spot_keeps_its_digits(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 512, 256, no_light);
    map.luminance[0] = 1e6;
    map.luminance[255 * 512 + 510] = 1e-6;
    map.luminance[255 * 512 + 511] = 3e-6;
    struct light_points lights = cut(&map, CUT_VARIANCE, 2);
    struct light_point faint = lights.points[lights.points[0].intensity_cd > 1e-3];
    double pixel_m = 0.90 / 512;
    assert_int_equal(lights.count, 2);
    assert_relative(faint.intensity_cd, 4e-6 * pixel_m * (0.60 / 256), ENERGY);
    assert_float_within(faint.at.x, 0.45 - 0.75 * pixel_m, 1e-14);
    light_points_fini(&lights);
    luminance_map_fini(&map);
}

static void of_two_equal_cuts_the_lower_index_is_taken(void **state)
{
    (void)state;
    for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
        struct luminance_map map = map_from(booth_ceiling(), 3, 1, uniform_light);
        struct light_points lights = cut(&map, how, 2);
        assert_relative(lights.points[0].intensity_cd, 3000 * 0.54 / 3, ENERGY);
        assert_true(lights.points[0].at.x < lights.points[1].at.x);
        light_points_fini(&lights);
        luminance_map_fini(&map);
    }
}

// Second moment of columns left..right-1 and rows top..bottom-1 about their
// centroid, in two passes.
static double moment_of(const struct luminance_map *map, int left, int top, int right, int bottom)
{
    double step_x = map->ceiling.width_m / map->width, step_z = map->ceiling.depth_m / map->height;
    double energy = 0, x = 0, z = 0, sum = 0;
    for (int i = top; i < bottom; i++)
        for (int j = left; j < right; j++) {
            energy += map->luminance[i * map->width + j];
            x += map->luminance[i * map->width + j] * j * step_x;
            z += map->luminance[i * map->width + j] * i * step_z;
        }
    for (int i = top; i < bottom; i++)
        for (int j = left; j < right; j++)
            sum += map->luminance[i * map->width + j] *
                   (pow(j * step_x - x / energy, 2) + pow(i * step_z - z / energy, 2));
    return sum;
}

static void variance_cut_makes_the_larger_of_both_moments_least(void **state)
{
    (void)state;
    uint32_t random = 1;
    for (int trial = 0; trial < 200; trial++) {
        struct luminance_map map = map_from(booth_ceiling(), 7, 5, uniform_light);
        for (int i = 0; i < 35; i++) {
            random = random * 1664525u + 1013904223u;
            map.luminance[i] = 1 + pow(random >> 16, 1.5);
        }
        double best = INFINITY, first = 0;
        for (int at = 1; at < 7 + 5 - 1; at++) {
            int right = at < 7 ? at : 7, bottom = at < 7 ? 5 : at - 6;
            double a = moment_of(&map, 0, 0, right, bottom);
            double b = moment_of(&map, at < 7 ? right : 0, at < 7 ? 0 : bottom, 7, 5);
            if (fmax(a, b) >= best)
                continue;
            best = fmax(a, b);
            first = 0;
            for (int i = 0; i < 35; i++)
                first += i % 7 < right && i / 7 < bottom ? map.luminance[i] * 0.54 / 35 : 0;
        }
        struct light_points lights = cut(&map, CUT_VARIANCE, 2);
        assert_relative(lights.points[0].intensity_cd, first, ENERGY);
        light_points_fini(&lights);
        luminance_map_fini(&map);
    }
}

static void a_count_outside_1_to_a_million_is_refused(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 4, 4, uniform_light);
    struct light_points lights = {77, NULL};
    struct error err = {0};
    assert_false(median_cut(&map, CUT_VARIANCE, 0, &lights, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_false(median_cut(&map, CUT_VARIANCE, (1 << 20) + 1, &lights, &err));
    assert_int_equal(lights.count, 77);
    luminance_map_fini(&map);
}

// Greatest and rms relative error over a grid of points of the tilted screen.
struct deviation {
    double most, rms;
};

static struct deviation deviation_of(const struct luminance_map *map,
                                     const struct light_points *lights, double tilt_deg)
{
    struct rigid pose = stand_pose(&STAND, tilt_deg);
    struct vec3 n = mat3_apply(pose.rotation, (struct vec3){0, 0, 1});
    struct deviation d = {0};
    int count = 0;
    for (int y = 0; y < 800; y += 133)
        for (int x = 0; x < 1280; x += 182) {
            struct vec3 p = rigid_apply(pose, screen_point(&SCREEN, x, y));
            double wanted = luminance_map_illuminance(map, p, n);
            double e = light_points_illuminance(lights, 1, p, n) / wanted - 1;
            d.most = fmax(d.most, fabs(e));
            d.rms += e * e;
            count++;
        }
    d.rms = sqrt(d.rms / count);
    return d;
}

static void the_error_of_n_points_falls_like_one_over_n(void **state)
{
    (void)state;
    // Numbers of the published median cut say 1/N; measured here over factors
    // of 16, so a third either way on the exponent is loose and 0 is far off.
    double (*const patterns[])(double, double) = {uniform_light, tubes, spots};
    for (size_t k = 0; k < 3; k++) {
        struct luminance_map map = map_from(booth_ceiling(), 256, 128, patterns[k]);
        struct light_points few = cut(&map, CUT_VARIANCE, 16);
        struct light_points many = cut(&map, CUT_VARIANCE, 256);
        double slope = log(deviation_of(&map, &many, 30).rms / deviation_of(&map, &few, 30).rms) /
                       log(256.0 / 16);
        print_message("pattern %zu: 16 points rms %.3f %%, 256 points %.3f %%\n", k,
                      100 * deviation_of(&map, &few, 30).rms,
                      100 * deviation_of(&map, &many, 30).rms);
        assert_float_within(slope, -1, 0.34);
        light_points_fini(&few);
        light_points_fini(&many);
        luminance_map_fini(&map);
    }
}

static void thirty_two_points_stay_below_the_engineering_rule(void **state)
{
    (void)state;
    // max error = 0.16 A / (N d2) for tilts up to 30 degrees, good to 1.3.
    double (*const patterns[])(double, double) = {uniform_light, tubes, spots};
    for (size_t k = 0; k < 3; k++) {
        struct luminance_map map = map_from(booth_ceiling(), 256, 128, patterns[k]);
        for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
            struct light_points lights = cut(&map, how, 32);
            double nearest = 0.75 - (0.20 + 0.1625) * sin(M_PI / 6);
            double rule = 0.16 * 0.54 / (32 * nearest * nearest);
            struct deviation d = deviation_of(&map, &lights, 30);
            print_message("pattern %zu, cut %d: max %.3f %%, rms %.3f %%, rule %.3f %%\n", k, how,
                          100 * d.most, 100 * d.rms, 100 * rule);
            assert_true(d.most < 1.3 * rule);
            light_points_fini(&lights);
        }
        luminance_map_fini(&map);
    }
}

static void variance_cut_beats_equal_energy_on_spots(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 256, 128, spots);
    struct light_points v = cut(&map, CUT_VARIANCE, 32), e = cut(&map, CUT_ENERGY, 32);
    assert_true(deviation_of(&map, &v, 0).rms < deviation_of(&map, &e, 0).rms);
    light_points_fini(&v);
    light_points_fini(&e);
    luminance_map_fini(&map);
}

static void a_single_point_follows_the_cosine_and_inverse_square_laws(void **state)
{
    (void)state;
    struct light_point point = {{0.3, 0.75, -0.4}, 100};
    struct light_points lights = {1, &point};
    struct vec3 p = {0, 0.15, 0.1}, n = {0, 0.6, -0.8};
    // to = (0.3, 0.6, -0.5), d2 = 0.7; n.to = 0.76; straight down 0.6.
    double wanted = 100 * (0.76 / sqrt(0.7)) * (0.6 / sqrt(0.7)) / 0.7;
    assert_relative(light_points_illuminance(&lights, 1, p, n), wanted, 1e-14);
    assert_true(light_points_illuminance(&lights, 2, p, n) ==
                2 * light_points_illuminance(&lights, 1, p, n));
}

static void a_light_behind_beside_or_upon_the_surface_gives_nothing(void **state)
{
    (void)state;
    struct light_point point = {{0, 0.75, 0}, 100};
    struct light_points lights = {1, &point};
    struct vec3 up = {0, 1, 0}, down = {0, -1, 0}, front = {0, 0, 1};
    struct vec3 below = {0, 0, 0}, above = {0, 1, 0}, level = {0.5, 0.75, 0}, at = point.at;
    assert_true(light_points_illuminance(&lights, 1, below, down) == 0);
    assert_true(light_points_illuminance(&lights, 1, below, front) == 0);
    assert_true(light_points_illuminance(&lights, 1, above, down) == 0);
    assert_true(light_points_illuminance(&lights, 1, level, up) == 0);
    assert_true(light_points_illuminance(&lights, 1, at, up) == 0);
}

// Configuration factor of a rectangle a x b that begins above the surface
// point at height c and is parallel to it. Source: Howell, catalogue of
// radiation configuration factors, B-4.
static double corner_factor(double a, double b, double c)
{
    double A = a / c, B = b / c;
    return (A / sqrt(1 + A * A) * atan(B / sqrt(1 + A * A)) +
            B / sqrt(1 + B * B) * atan(A / sqrt(1 + B * B))) /
           (2 * M_PI);
}

static void dense_integration_agrees_with_the_published_factor_of_a_rectangle(void **state)
{
    (void)state;
    struct vec3 p = {0.1, 0.25, -0.05}, up = {0, 1, 0};
    double left = 0.55, right = 0.35, far = 0.20, near = 0.40, gap = 0.5;
    double wanted = 3000 * M_PI *
                    (corner_factor(left, far, gap) + corner_factor(right, far, gap) +
                     corner_factor(left, near, gap) + corner_factor(right, near, gap));
    // One pixel is exact; 300 x 200 are points beyond 50 pixels' distance.
    struct luminance_map one = map_from(booth_ceiling(), 1, 1, uniform_light);
    struct luminance_map many = map_from(booth_ceiling(), 300, 200, uniform_light);
    assert_relative(luminance_map_illuminance(&one, p, up), wanted, 1e-13);
    assert_relative(luminance_map_illuminance(&many, p, up), wanted, 1e-5);
    luminance_map_fini(&one);
    luminance_map_fini(&many);
}

static void splitting_a_rectangle_changes_nothing_even_where_the_horizon_cuts_it(void **state)
{
    (void)state;
    struct luminance_map one = map_from(booth_ceiling(), 1, 1, uniform_light);
    struct luminance_map six = map_from(booth_ceiling(), 3, 2, uniform_light);
    struct luminance_map many = map_from(booth_ceiling(), 300, 200, uniform_light);
    struct vec3 p = {0.1, 0.45, 0.1};
    for (double turn = 0; turn < 2 * M_PI; turn += 0.37)
        for (double tilt = 0.3; tilt < 2.3; tilt += 0.25) {
            struct vec3 n = {sin(tilt) * cos(turn), cos(tilt), sin(tilt) * sin(turn)};
            double e = luminance_map_illuminance(&one, p, n);
            assert_float_within(luminance_map_illuminance(&six, p, n), e, 1e-12 * 3000 * M_PI);
            // Points of 3 mm lie before or behind the horizon as a whole.
            assert_float_within(luminance_map_illuminance(&many, p, n), e, 1e-4 * 3000 * M_PI);
        }
    luminance_map_fini(&one);
    luminance_map_fini(&six);
    luminance_map_fini(&many);
}

static void no_surface_anywhere_gets_more_than_pi_times_the_luminance(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 16, 12, uniform_light);
    double most = 0;
    // Nearer than 0.1 um the rounding of metres shifts pixels by 1e-9 of the gap.
    for (double gap = 1e-7; gap < 1; gap *= 10)
        for (double tilt = -90; tilt <= 180; tilt += 15)
            for (double x = -0.5; x <= 0.5; x += 0.25) {
                struct vec3 p = {x, 0.75 - gap, 0.05};
                struct vec3 n =
                    mat3_apply(mat3_rotation(0, tilt * M_PI / 180), (struct vec3){0, 1, 0});
                double e = luminance_map_illuminance(&map, p, n);
                assert_true(e >= 0 && e <= 3000 * M_PI * (1 + 1e-9));
                most = fmax(most, e);
            }
    assert_relative(most, 3000 * M_PI, 1e-6); // face up at the ceiling
    luminance_map_fini(&map);
}

static void through_and_above_the_ceiling_it_is_dark(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 16, 12, uniform_light);
    struct vec3 up = {0, 1, 0}, down = {0, -1, 0};
    for (double y = 0.75; y < 2; y += 0.25) {
        assert_true(luminance_map_illuminance(&map, (struct vec3){0, y, 0}, up) == 0);
        assert_true(luminance_map_illuminance(&map, (struct vec3){0, y, 0}, down) == 0);
    }
    luminance_map_fini(&map);
}

static void light_adds_up_when_the_map_is_split_and_scales_with_it(void **state)
{
    (void)state;
    struct luminance_map whole = map_from(booth_ceiling(), 64, 40, tubes);
    struct luminance_map left = map_from(booth_ceiling(), 64, 40, tubes);
    struct luminance_map right = map_from(booth_ceiling(), 64, 40, tubes);
    for (int i = 0; i < 64 * 40; i++)
        (i % 64 < 20 ? &right : &left)->luminance[i] = 0;
    struct vec3 p = {0.1, 0.3, 0}, n = vec3_unit((struct vec3){0.1, 0.5, 0.8});
    double all = luminance_map_illuminance(&whole, p, n);
    assert_relative(luminance_map_illuminance(&left, p, n) +
                        luminance_map_illuminance(&right, p, n),
                    all, 1e-12);
    luminance_map_scale(&whole, 2);
    assert_true(luminance_map_illuminance(&whole, p, n) == 2 * all);
    luminance_map_fini(&whole);
    luminance_map_fini(&left);
    luminance_map_fini(&right);
}

static void turning_through_90_degrees_of_tilt_is_continuous(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 64, 40, tubes);
    struct light_points lights = cut(&map, CUT_VARIANCE, 32);
    for (int side = -1; side <= 1; side += 2) {
        double e[2][2];
        for (int i = 0; i < 2; i++) {
            struct rigid pose = stand_pose(&STAND, side * 90 + (i ? 1e-7 : -1e-7));
            struct vec3 n = mat3_apply(pose.rotation, (struct vec3){0, 0, 1});
            e[i][0] = luminance_map_illuminance(&map, pose.translation, n);
            e[i][1] = light_points_illuminance(&lights, 1, pose.translation, n);
        }
        assert_float_within(e[0][0], e[1][0], 1e-6 * 1500);
        assert_float_within(e[0][1], e[1][1], 1e-6 * 1500);
    }
    light_points_fini(&lights);
    luminance_map_fini(&map);
}

static void a_spot_reads_the_mean_of_its_disc(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 90, 60, no_light);
    for (int i = 0; i < 90 * 60; i++)
        map.luminance[i] = 1000 + 10 * (i % 90); // 1000 cd/m2 a metre
    assert_relative(luminance_map_spot(&map, 0, 0.05, 0.2), 1000 + 10 * 44.5, 1e-9);
    assert_relative(luminance_map_spot(&map, 0.005, 0.05, 0.001), 1000 + 10 * 45, 1e-9);
    assert_relative(luminance_map_spot(&map, 0.005, 0.055, 0), 1000 + 10 * 45, 1e-9);
    assert_true(luminance_map_spot(&map, 2, 0, 0.05) == 0);
    luminance_map_fini(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_lights_hold_the_light_of_the_map_and_none_is_empty),
        cmocka_unit_test(maps_of_one_to_five_pixels_a_side_become_exactly_their_lit_pixels),
        cmocka_unit_test(a_row_and_a_column_of_pixels_are_cut_into_as_many_as_wanted),
        cmocka_unit_test(a_dark_map_gives_no_light_and_no_illuminance),
        cmocka_unit_test(one_lit_pixel_gives_one_light_in_its_middle),
        cmocka_unit_test(a_uniform_map_is_cut_into_equal_parts),
        cmocka_unit_test(a_faint_corner_beside_a_bright_spot_keeps_its_digits),
        cmocka_unit_test(of_two_equal_cuts_the_lower_index_is_taken),
        cmocka_unit_test(variance_cut_makes_the_larger_of_both_moments_least),
        cmocka_unit_test(a_count_outside_1_to_a_million_is_refused),
        cmocka_unit_test(the_error_of_n_points_falls_like_one_over_n),
        cmocka_unit_test(thirty_two_points_stay_below_the_engineering_rule),
        cmocka_unit_test(variance_cut_beats_equal_energy_on_spots),
        cmocka_unit_test(a_single_point_follows_the_cosine_and_inverse_square_laws),
        cmocka_unit_test(a_light_behind_beside_or_upon_the_surface_gives_nothing),
        cmocka_unit_test(dense_integration_agrees_with_the_published_factor_of_a_rectangle),
        cmocka_unit_test(splitting_a_rectangle_changes_nothing_even_where_the_horizon_cuts_it),
        cmocka_unit_test(no_surface_anywhere_gets_more_than_pi_times_the_luminance),
        cmocka_unit_test(through_and_above_the_ceiling_it_is_dark),
        cmocka_unit_test(light_adds_up_when_the_map_is_split_and_scales_with_it),
        cmocka_unit_test(turning_through_90_degrees_of_tilt_is_continuous),
        cmocka_unit_test(a_spot_reads_the_mean_of_its_disc),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
