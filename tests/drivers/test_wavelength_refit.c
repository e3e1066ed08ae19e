// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "drivers/wavelength_refit.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

enum { PIXELS = 2048 };

// The axis of a real Flame-S, and the same after a year.
static const double true_nm[4] = {189.80809, 0.38583738, -1.9762801e-05, -9.4763608e-10};
static const double old_nm[4] = {191.10, 0.38530, -1.95e-05, -9.6e-10};
static const double close_nm = 0.02; // a twentieth of a pixel, with noise and lines of 1.3 nm width

static const double arithmetic = 1e-9;
static const double sigmas = 4; // of a normal error, over 37 pixels

static double axis(const double c[4], double x)
{
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

static double chance(uint64_t *seed)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*seed >> 11) / (double)(UINT64_C(1) << 52) - 1;
}

// Gaussian lines between least_nm and most_nm on a noisy floor.
static void lamp_of(double least_nm, double most_nm, double width_nm, double counts[PIXELS])
{
    const double sigma = width_nm / 2.355;
    uint64_t seed = 3;
    for (int i = 0; i < PIXELS; i++) {
        double nm = axis(true_nm, i);
        counts[i] = 20 * chance(&seed);
        for (int l = 0; refit_mercury_argon[l] > 0; l++) {
            double line = refit_mercury_argon[l], off = (nm - line) / sigma;
            if (line >= least_nm && line <= most_nm)
                counts[i] += (3000 + 9000 * (l % 4)) * exp(-0.5 * off * off);
        }
    }
}

static void lamp(double least_nm, double most_nm, double counts[PIXELS])
{
    lamp_of(least_nm, most_nm, 1.3, counts);
}

static void a_drifted_axis_is_found_again(void **state)
{
    (void)state;
    static double counts[PIXELS];
    struct refit r;
    struct error err = {0};
    lamp(250, 880, counts);
    bool ok = refit_wavelengths(counts, PIXELS, old_nm, refit_mercury_argon, &r, &err);
    if (!ok)
        print_error("%s\n", err.text);
    assert_true(ok);
    assert_true(r.lines >= 15);
    assert_true(r.rms_nm < close_nm);
    for (int i = 200; i < PIXELS; i += 50)
        assert_near(axis(r.wavelength, i), axis(true_nm, i), close_nm);
}

static void each_line_tells_where_it_was_and_what_is_left(void **state)
{
    (void)state;
    static double counts[PIXELS];
    struct refit r;
    double sum = 0, worst = 0;
    lamp(250, 880, counts);
    assert_true(refit_wavelengths(counts, PIXELS, old_nm, refit_mercury_argon, &r, NULL));
    for (int i = 0; i < r.lines; i++) {
        const struct refit_line *l = &r.line[i];
        assert_near(l->was_nm, axis(old_nm, l->pixel), arithmetic);
        assert_near(l->left_nm, refit_nm(r.wavelength, l->pixel) - l->nm, arithmetic);
        assert_near(axis(true_nm, l->pixel), l->nm, close_nm);
        assert_true(i == 0 || l->nm > r.line[i - 1].nm);
        sum += l->left_nm * l->left_nm;
    }
    assert_near(r.rms_nm, sqrt(sum / r.lines), arithmetic);
    for (int i = 200; i < PIXELS; i += 50)
        worst = fmax(worst, fabs(axis(r.wavelength, i) - axis(true_nm, i)) / refit_sigma(&r, i));
    assert_true(worst < sigmas);
}

// At 1.3 nm the yellow pair stands apart; at 2.2 nm each would push the other aside by 0.3 nm.
static void lines_that_run_into_each_other_are_left_out(void **state)
{
    (void)state;
    static double counts[PIXELS];
    struct refit r;
    const double pair[] = {576.960, 579.066};
    for (int broad = 0; broad < 2; broad++) {
        int found = 0;
        lamp_of(250, 880, broad ? 2.2 : 1.3, counts);
        assert_true(refit_wavelengths(counts, PIXELS, old_nm, refit_mercury_argon, &r, NULL));
        for (int i = 0; i < r.lines; i++)
            found += r.line[i].nm == pair[0] || r.line[i].nm == pair[1];
        assert_int_equal(found, broad ? 0 : 2);
        assert_true(r.rms_nm < close_nm);
    }
}

// A cubic through four places, each seen twice, is as uncertain there as the
// mean of two; the residuals have eight less four degrees of freedom.
static void the_uncertainty_is_that_of_least_squares(void **state)
{
    (void)state;
    struct refit r = {.pixels = PIXELS, .lines = 8, .rms_nm = 0.1};
    for (int i = 0; i < 8; i++)
        r.line[i].pixel = PIXELS / 2.0 * (1 + (i / 2 - 1.5) / 1.5);
    for (int i = 0; i < 8; i++)
        assert_near(refit_sigma(&r, r.line[i].pixel), 0.1 * sqrt(2) * sqrt(0.5), arithmetic);
    assert_true(refit_sigma(&r, 1.2 * PIXELS) > refit_sigma(&r, PIXELS));
    r.lines = 4;
    assert_true(isinf(refit_sigma(&r, 0)));
}

static void a_list_of_wavelengths_has_its_coefficients(void **state)
{
    (void)state;
    static double nm[PIXELS];
    double found[4], worst;
    struct error err = {0};
    for (int i = 0; i < PIXELS; i++)
        nm[i] = rint(axis(true_nm, i) * 100) / 100; // as files round them
    assert_true(refit_axis(nm, PIXELS, found, &worst, &err));
    assert_true(worst < 0.0055);
    for (int i = 0; i < PIXELS; i += 100)
        assert_near(axis(found, i), axis(true_nm, i), 0.001);
    assert_false(refit_axis(nm, 7, found, &worst, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

static void a_right_axis_stays(void **state)
{
    (void)state;
    static double counts[PIXELS];
    struct refit r;
    lamp(250, 880, counts);
    assert_true(refit_wavelengths(counts, PIXELS, true_nm, refit_mercury_argon, &r, NULL));
    for (int i = 200; i < PIXELS; i += 50)
        assert_near(axis(r.wavelength, i), axis(true_nm, i), close_nm);
}

static void refused(const double counts[PIXELS], const double *lines, const char *why)
{
    struct refit r = {.lines = -1};
    struct error err = {0};
    assert_false(refit_wavelengths(counts, PIXELS, old_nm, lines, &r, &err));
    assert_int_equal(err.code, ERROR_DATA);
    if (!strstr(err.text, why))
        print_error("%s\n", err.text);
    assert_non_null(strstr(err.text, why));
    assert_int_equal(r.lines, -1);
}

static void too_few_lines_are_refused(void **state)
{
    (void)state;
    static double counts[PIXELS];
    lamp(500, 600, counts);
    refused(counts, refit_mercury_argon, "at least 6");
    memset(counts, 0, sizeof counts);
    refused(counts, refit_mercury_argon, "at least 6");
}

static void lines_over_a_small_part_of_the_axis_are_refused(void **state)
{
    (void)state;
    static double counts[PIXELS];
    lamp(690, 830, counts);
    refused(counts, refit_mercury_argon, "span");
}

static void lines_at_one_end_alone_are_refused(void **state)
{
    (void)state;
    static double counts[PIXELS];
    lamp(360, 580, counts); // mercury in glass
    refused(counts, refit_mercury_argon, "uncertain");
}

static void a_comb_that_fits_in_two_ways_is_refused(void **state)
{
    (void)state;
    static double counts[PIXELS];
    static double comb[64];
    for (int l = 0; l < 40; l++)
        comb[l] = 300 + 5 * l;
    for (int i = 0; i < PIXELS; i++)
        for (int l = 0; l < 90; l++)
            counts[i] += 1e4 * exp(-pow((axis(true_nm, i) - 270 - 5.0 * l) / 0.5, 2));
    refused(counts, comb, "ambiguous");
}

static void noise_and_a_smooth_lamp_have_no_lines(void **state)
{
    (void)state;
    static double counts[PIXELS];
    uint64_t seed = 5;
    for (int i = 0; i < PIXELS; i++)
        counts[i] = 30000 * exp(-pow((i - 1200) / 500.0, 2)) + 50 * chance(&seed);
    refused(counts, refit_mercury_argon, "at least 6");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_drifted_axis_is_found_again),
        cmocka_unit_test(each_line_tells_where_it_was_and_what_is_left),
        cmocka_unit_test(lines_that_run_into_each_other_are_left_out),
        cmocka_unit_test(the_uncertainty_is_that_of_least_squares),
        cmocka_unit_test(a_list_of_wavelengths_has_its_coefficients),
        cmocka_unit_test(lines_at_one_end_alone_are_refused),
        cmocka_unit_test(a_right_axis_stays),
        cmocka_unit_test(too_few_lines_are_refused),
        cmocka_unit_test(lines_over_a_small_part_of_the_axis_are_refused),
        cmocka_unit_test(a_comb_that_fits_in_two_ways_is_refused),
        cmocka_unit_test(noise_and_a_smooth_lamp_have_no_lines),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
