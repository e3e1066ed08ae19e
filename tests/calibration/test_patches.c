// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration/measurements.h"
#include "calibration/patches.h"

// cmocka defines a macro named fail: it comes last.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static const double CODE = 1e-9;     // counts are exact 8-bit fractions
static const double WRITTEN = 1e-4;  // relative: digits of a .ti3

static bool is_8_bit(double v)
{
    return v >= 0 && v <= 1 && fabs(v * 255 - rint(v * 255)) < CODE;
}

static void every_count_of_a_set_is_an_8_bit_code(void **state)
{
    (void)state;
    struct patch_set set;
    assert_true(patch_set_characterise(16, 60, 25, 7, &set, NULL));
    for (int i = 0; i < set.count; i++)
        assert_true(is_8_bit(set.patches[i].counts.r) && is_8_bit(set.patches[i].counts.g) &&
                    is_8_bit(set.patches[i].counts.b));
    patch_set_fini(&set);
}

static void white_opens_closes_and_recurs(void **state)
{
    (void)state;
    struct patch_set set;
    assert_true(patch_set_characterise(16, 60, 25, 7, &set, NULL));
    int whites = 0, since = 0;
    for (int i = 0; i < set.count; i++, since++) {
        struct counts c = set.patches[i].counts;
        if (c.r == 1 && c.g == 1 && c.b == 1) {
            whites++;
            since = 0;
        }
        assert_true(since <= 25);
    }
    assert_true(whites >= 5);
    assert_float_equal(set.patches[0].counts.g, 1, CODE);
    assert_float_equal(set.patches[set.count - 1].counts.g, 1, CODE);
    patch_set_fini(&set);
}

static void the_same_seed_gives_the_same_order_and_another_seed_another(void **state)
{
    (void)state;
    struct patch_set a, b, c;
    assert_true(patch_set_characterise(8, 20, 25, 7, &a, NULL));
    assert_true(patch_set_characterise(8, 20, 25, 7, &b, NULL));
    assert_true(patch_set_characterise(8, 20, 25, 8, &c, NULL));
    assert_memory_equal(a.patches, b.patches, (size_t)a.count * sizeof *a.patches);
    assert_memory_not_equal(a.patches, c.patches, (size_t)a.count * sizeof *a.patches);
    patch_set_fini(&a);
    patch_set_fini(&b);
    patch_set_fini(&c);
}

static void measure_by_formula(struct patch_set *set)
{
    for (int i = 0; i < set->count; i++) {
        struct counts c = set->patches[i].counts;
        double r = pow(c.r, 2.2), g = pow(c.g, 2.2), b = pow(c.b, 2.2);
        set->patches[i].xyz = (struct xyz){400 * r + 300 * g + 150 * b + 0.3, 200 * r + 650 * g + 60 * b + 0.3,
                                           10 * r + 80 * g + 900 * b + 0.3};
    }
}

static void a_saved_set_is_read_back_in_absolute_units(void **state)
{
    (void)state;
    struct patch_set set;
    struct measurements m;
    struct xyz white;
    char path[] = "/tmp/patches-XXXXXX";
    close(mkstemp(path));
    assert_true(patch_set_characterise(8, 20, 25, 7, &set, NULL));
    measure_by_formula(&set);
    assert_true(patch_set_white(&set, &white));
    assert_true(patch_set_save(&set, path, white, "PR-655 test", NULL));
    assert_true(measurements_load(path, &m, NULL));
    assert_int_equal(m.count, set.count);
    for (int i = 0; i < set.count; i++) {
        assert_float_equal(m.patches[i].xyz.Y / set.patches[i].xyz.Y, 1, WRITTEN);
        assert_float_equal(m.patches[i].counts.b, set.patches[i].counts.b, WRITTEN);
    }
    measurements_fini(&m);
    patch_set_fini(&set);
    unlink(path);
}

static void drift_is_the_spread_of_the_repeated_whites(void **state)
{
    (void)state;
    struct patch_set set;
    assert_true(patch_set_characterise(8, 20, 10, 7, &set, NULL));
    measure_by_formula(&set);
    assert_float_equal(patch_set_white_drift(&set), 0, CODE);
    set.patches[0].xyz.Y *= 1.04;
    assert_float_equal(patch_set_white_drift(&set), 0.04, CODE);
    patch_set_fini(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_count_of_a_set_is_an_8_bit_code),
        cmocka_unit_test(white_opens_closes_and_recurs),
        cmocka_unit_test(the_same_seed_gives_the_same_order_and_another_seed_another),
        cmocka_unit_test(a_saved_set_is_read_back_in_absolute_units),
        cmocka_unit_test(drift_is_the_spread_of_the_repeated_whites),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
