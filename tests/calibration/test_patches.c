// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration/measurements.h"
#include "calibration/patches.h"
#include "files/cgats.h"

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
    assert_true(patch_set_characterise(&(struct patch_sizes){16, 6, 60, 25}, 7, &set, NULL));
    for (int i = 0; i < set.count; i++)
        assert_true(is_8_bit(set.patches[i].counts.r) && is_8_bit(set.patches[i].counts.g) &&
                    is_8_bit(set.patches[i].counts.b));
    patch_set_fini(&set);
}

static void white_opens_closes_and_recurs(void **state)
{
    (void)state;
    struct patch_set set;
    assert_true(patch_set_characterise(&(struct patch_sizes){16, 6, 60, 25}, 7, &set, NULL));
    int whites = 0, since = 0;
    for (int i = 0; i < set.count; i++, since++) {
        struct counts c = set.patches[i].counts;
        if (c.r == 1 && c.g == 1 && c.b == 1) {
            whites++;
            since = 0;
        }
        assert_true(since <= 26); // a black may come between
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
    assert_true(patch_set_characterise(&(struct patch_sizes){8, 6, 20, 25}, 7, &a, NULL));
    assert_true(patch_set_characterise(&(struct patch_sizes){8, 6, 20, 25}, 7, &b, NULL));
    assert_true(patch_set_characterise(&(struct patch_sizes){8, 6, 20, 25}, 8, &c, NULL));
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
    assert_true(patch_set_characterise(&(struct patch_sizes){8, 6, 20, 25}, 7, &set, NULL));
    measure_by_formula(&set);
    assert_true(patch_set_white(&set, &white));
    assert_true(patch_set_save(&set, path, white, "PR-655 test", NULL, NULL));
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

static void spectra_go_along_where_every_patch_has_one(void **state)
{
    (void)state;
    struct patch_set set;
    struct cgats file;
    char path[] = "/tmp/patches-XXXXXX";
    close(mkstemp(path));
    assert_true(patch_set_characterise(&(struct patch_sizes){4, 0, 2, 25}, 7, &set, NULL));
    measure_by_formula(&set);
    json_t *readings = json_array();
    for (int i = 0; i < set.count; i++) {
        set.patches[i].reading = i;
        json_array_append_new(readings, json_pack("{s:[i,i,i],s:[f,f,f]}", "nm", 380, 580, 780, "values",
                                                  0.001 * i, 0.002, 0.003));
    }
    assert_true(patch_set_save(&set, path, (struct xyz){950, 1000, 1090}, "x", readings, NULL));
    assert_true(cgats_load_as(path, "CTI3", &file, NULL));
    assert_string_equal(cgats_keyword(&file, "SPECTRAL_BANDS"), "3");
    int first = table_column(&file.table, "SPEC_380");
    assert_true(first > 0 && table_column(&file.table, "SPEC_780") == first + 2);
    assert_float_equal(table_at(&file.table, 5, (size_t)first), 5, WRITTEN); // mW
    cgats_fini(&file);
    json_array_remove(readings, 0); // one short: none is written
    assert_true(patch_set_save(&set, path, (struct xyz){950, 1000, 1090}, "x", readings, NULL));
    assert_true(cgats_load_as(path, "CTI3", &file, NULL));
    assert_true(table_column(&file.table, "SPEC_380") < 0);
    cgats_fini(&file);
    json_decref(readings);
    patch_set_fini(&set);
    unlink(path);
}

static void near_black_colours_lie_below_code_sixteen(void **state)
{
    (void)state;
    struct patch_set with, without;
    assert_true(patch_set_characterise(&(struct patch_sizes){4, 30, 0, 200}, 7, &with, NULL));
    assert_true(patch_set_characterise(&(struct patch_sizes){4, 0, 0, 200}, 7, &without, NULL));
    int dark[2] = {0, 0};
    const struct patch_set *sets[] = {&with, &without};
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < sets[k]->count; i++) {
            struct counts c = sets[k]->patches[i].counts;
            dark[k] += fmax(c.r, fmax(c.g, c.b)) <= 16.0 / 255;
        }
    assert_int_equal(dark[0] - dark[1], 30);
    patch_set_fini(&with);
    patch_set_fini(&without);
}

static void drift_is_the_spread_and_the_slope_of_the_repeated_whites(void **state)
{
    (void)state;
    static const double PER_HOUR = 0.05;
    struct patch_set set;
    assert_true(patch_set_characterise(&(struct patch_sizes){8, 0, 20, 10}, 7, &set, NULL));
    measure_by_formula(&set);
    assert_float_equal(patch_set_drift(&set).white, 0, CODE);
    for (int i = 0; i < set.count; i++) {
        set.patches[i].elapsed_s = 36.0 * i;
        set.patches[i].xyz.Y *= 1 + PER_HOUR * 0.01 * i;
    }
    struct patch_drift d = patch_set_drift(&set);
    double span = PER_HOUR * 0.01 * (set.count - 1), mid = 1 + span / 2;
    assert_true(d.whites >= 5 && d.blacks >= 3);
    assert_float_equal(d.white, span / mid, 0.002); // the whites do not lie quite evenly
    assert_float_equal(d.white_per_hour, PER_HOUR / mid, 0.001);
    assert_true(d.white_per_hour_u < 1e-9);
    patch_set_fini(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_count_of_a_set_is_an_8_bit_code),
        cmocka_unit_test(white_opens_closes_and_recurs),
        cmocka_unit_test(the_same_seed_gives_the_same_order_and_another_seed_another),
        cmocka_unit_test(a_saved_set_is_read_back_in_absolute_units),
        cmocka_unit_test(spectra_go_along_where_every_patch_has_one),
        cmocka_unit_test(near_black_colours_lie_below_code_sixteen),
        cmocka_unit_test(drift_is_the_spread_and_the_slope_of_the_repeated_whites),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
