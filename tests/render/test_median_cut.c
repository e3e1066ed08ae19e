// SPDX-License-Identifier: Apache-2.0
#include "tests/render/support.h"

#include "render/line_sums.h"

// Ten thousand roundings of 1e-16, each of the sum of magnitudes at most.
static const double SUMS = 1e-13;
static const double ENERGY = 1e-12; // sums in double over 1e4 pixels
static const double TIE = 1e-12;    // median_cut.c: differences below it are rounding

static uint32_t random_state = 7;

static double chance(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) / 16777216.0;
}

// Over nine decades, a third of it dark.
static double rough(double u, double v)
{
    double share = chance();
    return share < 0.33 ? 0 * (u + v) : pow(10, 9 * chance() - 4);
}

struct long_sum {
    long double energy, first, second, size;
};

static void count_in(struct long_sum *s, double luminance, long double d)
{
    s->energy += luminance;
    s->first += luminance * d;
    s->second += luminance * d * d;
}

static void check_sum(const struct line_sum *got, const struct long_sum *wanted, double half_m)
{
    double e = (double)wanted->energy;
    assert_float_within(got->energy, e, SUMS * e);
    assert_float_within(got->first, (double)wanted->first, SUMS * e * half_m);
    assert_float_within(got->second, (double)wanted->second, SUMS * e * half_m * half_m);
}

static void check_rectangle(const struct line_sums *sums, struct pixels at)
{
    static struct line_sum columns[200], rows[200];
    const struct luminance_map *map = sums->map;
    line_sums_of(sums, at, columns, rows);
    for (int col = at.left; col < at.right; col++) {
        struct long_sum sum = {0};
        for (int row = at.top; row < at.bottom; row++)
            count_in(&sum, map->luminance[row * map->width + col],
                     (row + 0.5L - (at.top + at.bottom) / 2.0L) * sums->step_z);
        check_sum(&columns[col - at.left], &sum, (at.bottom - at.top) / 2.0 * sums->step_z);
    }
    for (int row = at.top; row < at.bottom; row++) {
        struct long_sum sum = {0};
        for (int col = at.left; col < at.right; col++)
            count_in(&sum, map->luminance[row * map->width + col],
                     (col + 0.5L - (at.left + at.right) / 2.0L) * sums->step_x);
        check_sum(&rows[row - at.top], &sum, (at.right - at.left) / 2.0 * sums->step_x);
    }
}

static void lines_of_any_rectangle_add_up_as_in_long_double(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 167, 131, rough);
    struct line_sums sums;
    struct error err = {0};
    assert_good(line_sums_init(&sums, &map, &err), err);
    check_rectangle(&sums, (struct pixels){0, 0, 167, 131});
    check_rectangle(&sums, (struct pixels){32, 32, 64, 64});
    for (int i = 0; i < 200; i++) {
        int left = (int)(166 * chance()), top = (int)(130 * chance());
        struct pixels at = {left, top, left + 1 + (int)((166 - left) * chance()),
                            top + 1 + (int)((130 - top) * chance())};
        check_rectangle(&sums, at);
    }
    line_sums_fini(&sums);
    luminance_map_fini(&map);
}

// ---- the cut by brute force ------------------------------------------------

struct part {
    struct pixels at;
    long double energy, x, z, moment; // moment about the centroid
};

// Two passes over the pixels, in long double.
static struct part part_of(const struct luminance_map *map, struct pixels at)
{
    long double step_x = map->ceiling.width_m / map->width;
    long double step_z = map->ceiling.depth_m / map->height;
    struct part p = {.at = at};
    for (int pass = 0; pass < 2; pass++) {
        for (int row = at.top; row < at.bottom; row++)
            for (int col = at.left; col < at.right; col++) {
                double l = map->luminance[row * map->width + col];
                long double x = (col + 0.5L) * step_x, z = (row + 0.5L) * step_z;
                if (pass)
                    p.moment += l * ((x - p.x) * (x - p.x) + (z - p.z) * (z - p.z));
                else
                    p.energy += l, p.x += l * x, p.z += l * z;
            }
        if (!pass && p.energy > 0)
            p.x /= p.energy, p.z /= p.energy;
    }
    return p;
}

static struct part trimmed(const struct luminance_map *map, struct pixels at)
{
    struct pixels lit = {at.right, at.bottom, at.left, at.top};
    for (int row = at.top; row < at.bottom; row++)
        for (int col = at.left; col < at.right; col++) {
            if (!(map->luminance[row * map->width + col] > 0))
                continue;
            lit.left = col < lit.left ? col : lit.left;
            lit.right = col >= lit.right ? col + 1 : lit.right;
            lit.top = row < lit.top ? row : lit.top;
            lit.bottom = row >= lit.bottom ? row + 1 : lit.bottom;
        }
    return part_of(map, lit);
}

// Tries every cut that is allowed, columns before rows, and keeps the first of
// those that cost least.
static void divide(const struct luminance_map *map, enum median_cut how, struct part *a,
                   struct part *b)
{
    struct pixels at = a->at;
    int width = at.right - at.left, height = at.bottom - at.top;
    double long_x = width * map->ceiling.width_m / map->width;
    double long_z = height * map->ceiling.depth_m / map->height;
    long double worth = how == CUT_ENERGY ? a->energy : a->moment, best = INFINITY;
    struct pixels first = at, second = at;
    for (int i = 1; i < width + height - 1; i++) {
        bool across_x = i < width;
        bool allowed = how == CUT_VARIANCE ||
                       (across_x ? height == 1 || long_x >= long_z : width == 1 || long_x < long_z);
        struct pixels one = at, two = at;
        if (across_x)
            one.right = two.left = at.left + i;
        else
            one.bottom = two.top = at.top + i - width + 1;
        struct part p = part_of(map, one), q = part_of(map, two);
        long double cost =
            how == CUT_ENERGY ? fabsl(p.energy - q.energy) : fmaxl(p.moment, q.moment);
        if (!allowed || !(cost < best - TIE * worth))
            continue;
        best = cost;
        first = one;
        second = two;
    }
    *a = trimmed(map, first);
    *b = trimmed(map, second);
}

static int brute_cut(const struct luminance_map *map, enum median_cut how, int most,
                     struct part *parts)
{
    int count = 1;
    parts[0] = trimmed(map, (struct pixels){0, 0, map->width, map->height});
    while (count < most) {
        int next = -1;
        long double greatest = -1;
        for (int i = 0; i < count; i++) {
            struct pixels at = parts[i].at;
            long double worth = how == CUT_ENERGY ? parts[i].energy : parts[i].moment;
            if ((at.right - at.left > 1 || at.bottom - at.top > 1) &&
                worth > greatest * (1 + TIE)) {
                greatest = worth;
                next = i;
            }
        }
        if (next < 0)
            break;
        divide(map, how, &parts[next], &parts[count]);
        count++;
    }
    return count;
}

static void check_against_brute_force(const struct luminance_map *map, enum median_cut how,
                                      int most)
{
    static struct part parts[128];
    struct light_points lights;
    struct pixels *regions;
    struct error err = {0};
    int count = brute_cut(map, how, most, parts);
    assert_good(median_cut_regions(map, how, most, &lights, &regions, &err), err);
    assert_int_equal(lights.count, count);
    double pixel = map->ceiling.width_m * map->ceiling.depth_m / map->width / map->height;
    for (int i = 0; i < count; i++) {
        assert_memory_equal(&regions[i], &parts[i].at, sizeof *regions);
        assert_relative(lights.points[i].intensity_cd, (double)parts[i].energy * pixel, ENERGY);
        assert_float_within(
            lights.points[i].at.x,
            (double)parts[i].x - map->ceiling.width_m / 2 + map->ceiling.centre_m[0], ENERGY);
        assert_float_within(
            lights.points[i].at.z,
            (double)parts[i].z - map->ceiling.depth_m / 2 + map->ceiling.centre_m[2], ENERGY);
    }
    light_points_fini(&lights);
    free(regions);
}

static void the_cut_is_that_of_brute_force_in_long_double(void **state)
{
    (void)state;
    double (*const patterns[])(double, double) = {rough, tubes, spots};
    for (size_t k = 0; k < 3; k++)
        for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
            struct luminance_map map = map_from(booth_ceiling(), 71, 67, patterns[k]);
            check_against_brute_force(&map, how, 40);
            luminance_map_fini(&map);
        }
}

static void equal_cuts_of_a_uniform_map_keep_the_lower_index_whatever_the_rounding(void **state)
{
    (void)state;
    static const int sizes[][2] = {{71, 67}, {67, 71}, {33, 1},  {1, 65}, {36, 24},
                                   {9, 9},   {70, 66}, {99, 50}, {45, 77}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
        for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
            struct luminance_map map =
                map_from(booth_ceiling(), sizes[k][0], sizes[k][1], uniform_light);
            luminance_map_scale(&map, 1 / 3.0);
            check_against_brute_force(&map, how, 31);
            luminance_map_fini(&map);
        }
}

static void columns_of_the_same_pixels_in_other_orders_are_equal(void **state)
{
    (void)state;
    for (int trial = 0; trial < 20; trial++) {
        struct luminance_map map = map_from(booth_ceiling(), 3, 90, rough);
        for (int i = 0; i < 90; i++)
            map.luminance[i * 3 + 1] = map.luminance[(i + 31) % 90 * 3];
        for (int i = 0; i < 90; i++)
            map.luminance[i * 3 + 2] = map.luminance[(i + 17) % 90 * 3];
        check_against_brute_force(&map, CUT_ENERGY, 2);
        luminance_map_fini(&map);
    }
}

static void the_regions_hold_every_lit_pixel_once(void **state)
{
    (void)state;
    struct luminance_map map = map_from(booth_ceiling(), 150, 97, rough);
    for (int how = CUT_VARIANCE; how <= CUT_ENERGY; how++) {
        struct light_points lights;
        struct pixels *regions;
        struct error err = {0};
        static unsigned char taken[150 * 97];
        memset(taken, 0, sizeof taken);
        assert_good(median_cut_regions(&map, how, 5000, &lights, &regions, &err), err);
        assert_int_equal(lights.count, 5000);
        for (int i = 0; i < lights.count; i++)
            for (int row = regions[i].top; row < regions[i].bottom; row++)
                for (int col = regions[i].left; col < regions[i].right; col++)
                    taken[row * 150 + col]++;
        for (int i = 0; i < 150 * 97; i++)
            assert_true(taken[i] <= 1 && (taken[i] || !(map.luminance[i] > 0)));
        light_points_fini(&lights);
        free(regions);
    }
    luminance_map_fini(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_of_any_rectangle_add_up_as_in_long_double),
        cmocka_unit_test(the_cut_is_that_of_brute_force_in_long_double),
        cmocka_unit_test(equal_cuts_of_a_uniform_map_keep_the_lower_index_whatever_the_rounding),
        cmocka_unit_test(columns_of_the_same_pixels_in_other_orders_are_equal),
        cmocka_unit_test(the_regions_hold_every_lit_pixel_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
