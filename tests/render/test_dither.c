// SPDX-License-Identifier: Apache-2.0
#include "tests/render/support.h"

#include "render/dither.h"

static uint16_t ranks[DITHER_LEVELS];

static int make_tile(void **state)
{
    (void)state;
    dither_tile(ranks);
    return 0;
}

static void every_threshold_appears_once(void **state)
{
    (void)state;
    bool seen[DITHER_LEVELS] = {false};
    for (int i = 0; i < DITHER_LEVELS; i++) {
        assert_true(ranks[i] < DITHER_LEVELS && !seen[ranks[i]]);
        seen[ranks[i]] = true;
    }
}

static void the_mean_over_a_tile_is_the_wanted_value(void **state)
{
    (void)state;
    for (double wanted = 0; wanted <= 255; wanted += 0.0371) {
        double sum = 0;
        for (int i = 0; i < DITHER_LEVELS; i++)
            sum += floor(wanted + (ranks[i] + 0.5) / DITHER_LEVELS);
        assert_float_within(sum / DITHER_LEVELS, wanted, 0.01);
    }
}

static double wrapped(int a, int b)
{
    int d = abs(a - b);
    return d < DITHER_SIDE - d ? d : DITHER_SIDE - d;
}

static void pixels_that_light_first_keep_apart(void **state)
{
    (void)state;
    // 64 of 4096: a square grid has them 8 px apart, chance about 1.
    double nearest = INFINITY;
    for (int i = 0; i < DITHER_LEVELS; i++)
        for (int j = 0; j < i; j++)
            if (ranks[i] >= DITHER_LEVELS - 64 && ranks[j] >= DITHER_LEVELS - 64)
                nearest = fmin(nearest, hypot(wrapped(i % DITHER_SIDE, j % DITHER_SIDE),
                                              wrapped(i / DITHER_SIDE, j / DITHER_SIDE)));
    assert_true(nearest >= 4);
}

static void means_of_8_by_8_pixels_hardly_differ(void **state)
{
    (void)state;
    // Blue noise has no slow waves: white noise would have sqrt(1/12/64) = 0.036.
    double square = 0;
    for (int block = 0; block < 64; block++) {
        double sum = 0;
        for (int i = 0; i < 64; i++)
            sum += ranks[(block / 8 * 8 + i / 8) * DITHER_SIDE + block % 8 * 8 + i % 8];
        double off = (sum / 64 + 0.5) / DITHER_LEVELS - 0.5;
        square += off * off / 64;
    }
    print_message("rms of 8 x 8 means: %.4f\n", sqrt(square));
    assert_true(sqrt(square) < 0.018);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_threshold_appears_once),
        cmocka_unit_test(the_mean_over_a_tile_is_the_wanted_value),
        cmocka_unit_test(pixels_that_light_first_keep_apart),
        cmocka_unit_test(means_of_8_by_8_pixels_hardly_differ),
    };
    return cmocka_run_group_tests(tests, make_tile, NULL);
}
