// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "calibration/proof.h"

// cmocka defines a macro named fail: it comes last.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static const double EXACT = 1e-9; // sums of a few doubles

static void percentiles_interpolate_linearly_between_order_statistics(void **state)
{
    (void)state;
    const double v[] = {1, 2, 3, 4};
    assert_float_equal(percentile(v, 4, 0), 1, EXACT);
    assert_float_equal(percentile(v, 4, 50), 2.5, EXACT);
    assert_float_equal(percentile(v, 4, 90), 3.7, EXACT);
    assert_float_equal(percentile(v, 4, 100), 4, EXACT);
}

static void a_summary_holds_mean_sample_deviation_and_percentiles(void **state)
{
    (void)state;
    const double v[] = {4, 2, 4, 4, 5, 5, 7, 9};
    struct summary s = summarise(v, 8);
    assert_int_equal(s.n, 8);
    assert_float_equal(s.mean, 5, EXACT);
    assert_float_equal(s.std, sqrt(32.0 / 7), EXACT);
    assert_float_equal(s.median, 4.5, EXACT);
    assert_float_equal(s.p90, 7.6, EXACT);
    assert_float_equal(s.max, 9, EXACT);
    assert_float_equal(v[0], 4, EXACT);
}

static void a_summary_of_nothing_is_zero(void **state)
{
    (void)state;
    struct summary s = summarise(NULL, 0);
    assert_int_equal(s.n, 0);
    assert_float_equal(s.max, 0, EXACT);
}

static void fill(struct lamp_report *lamp, double factor)
{
    static const struct xyz colours[3] = {{42, 45, 30}, {20, 10, 5}, {8, 12, 20}};
    memset(lamp, 0, sizeof *lamp);
    lamp->white_reference = lamp->white_taught = (struct xyz){48, 50, 40};
    lamp->white_measured = (struct xyz){48 * factor, 50 * factor, 40 * factor};
    lamp->patch_count = 3;
    for (int i = 0; i < 3; i++) {
        struct patch_report *p = &lamp->patches[i];
        p->reference = p->full = p->bands = colours[i];
        p->measured = (struct xyz){colours[i].X * factor, colours[i].Y * factor, colours[i].Z * factor};
        p->in_gamut = i != 1;
    }
}

static void a_screen_that_is_only_too_bright_is_right_as_published_and_wrong_absolutely(void **state)
{
    (void)state;
    struct lamp_report lamp;
    fill(&lamp, 1.05);
    assert_true(proof_judge(&lamp, NULL));
    assert_float_equal(lamp.proof.published.max, 0, EXACT);
    assert_false(lamp.reached);
    assert_true(lamp.proof.absolute.mean > 0.3);
    assert_float_equal(lamp.white_error_percent, 5, EXACT);
    assert_float_equal(lamp.proof.simulation.max, 0, EXACT);
}

static void patches_out_of_gamut_are_summed_up_apart(void **state)
{
    (void)state;
    struct lamp_report lamp;
    fill(&lamp, 1);
    lamp.patches[1].measured.X *= 1.5;
    assert_true(proof_judge(&lamp, NULL));
    assert_int_equal(lamp.proof.published_in_gamut.n, 2);
    assert_int_equal(lamp.proof.published.n, 3);
    assert_float_equal(lamp.proof.published_in_gamut.max, 0, EXACT);
    assert_true(lamp.proof.published.max > 5);
}

// The white patch of a set at Y = 1/1.13 of its diffuser under D65 is left as
// it is by the published method: L* of 0.885.
static void the_published_method_puts_the_white_patch_at_its_own_reflectance(void **state)
{
    (void)state;
    struct xyz d65 = {0.95047, 1, 1.08883};
    struct xyz white = {d65.X / 1.13, d65.Y / 1.13, d65.Z / 1.13};
    double de;
    assert_true(proof_published_difference(white, d65, d65, &de, NULL));
    struct lab a, b;
    assert_true(lab_of(white, d65, &a, NULL) && lab_of(d65, d65, &b, NULL));
    assert_float_equal(de, delta_e_2000(a, b), EXACT);
    assert_true(a.L > 95 && a.L < 96);
}

static void targets_are_reached_just_when_all_are(void **state)
{
    (void)state;
    struct lamp_report lamp;
    fill(&lamp, 1.019);
    assert_true(proof_judge(&lamp, NULL) && lamp.reached);
    fill(&lamp, 1.021);
    assert_true(proof_judge(&lamp, NULL) && !lamp.reached);
    fill(&lamp, 1);
    lamp.patches[2].measured.Z *= 1.2;
    assert_true(proof_judge(&lamp, NULL) && !lamp.reached);
    fill(&lamp, 1);
    for (int i = 0; i < 3; i++)
        lamp.patches[i].in_gamut = false;
    assert_true(proof_judge(&lamp, NULL) && !lamp.reached);
}

static void a_dark_white_is_refused_with_the_lamps_name(void **state)
{
    (void)state;
    struct lamp_report lamp;
    struct error err = {0};
    fill(&lamp, 1);
    lamp.patches[0].measured.Y = 0;
    strcpy(lamp.name, "D50");
    assert_false(proof_judge(&lamp, &err));
    assert_non_null(strstr(err.text, "D50"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(percentiles_interpolate_linearly_between_order_statistics),
        cmocka_unit_test(a_summary_holds_mean_sample_deviation_and_percentiles),
        cmocka_unit_test(a_summary_of_nothing_is_zero),
        cmocka_unit_test(a_screen_that_is_only_too_bright_is_right_as_published_and_wrong_absolutely),
        cmocka_unit_test(patches_out_of_gamut_are_summed_up_apart),
        cmocka_unit_test(the_published_method_puts_the_white_patch_at_its_own_reflectance),
        cmocka_unit_test(targets_are_reached_just_when_all_are),
        cmocka_unit_test(a_dark_white_is_refused_with_the_lamps_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
