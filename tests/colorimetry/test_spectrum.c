// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/spectrum.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "tests/fakes/near.h"

#define ROUNDING 1e-12    // a few operations in double
#define POLYNOMIAL 1e-9   // values of about 1e3 in double
#define SMOOTH 2e-8       // of the value; a Planckian is far smoother than 5 nm
#define SAME_XYZ 1e-3     // of Y = 100: straight lines cut the tops of lines 1.2 nm wide
#define ENERGY 1e-9       // sums of some thousand terms

enum { ROOM = 3000 };

static double nm[ROOM], values[ROOM];

static size_t sample(double first, double last, double step, double (*f)(double))
{
    size_t n = 0;
    for (; first + step * (double)n <= last + 1e-9; n++) {
        nm[n] = first + step * (double)n;
        values[n] = f(nm[n]);
    }
    return n;
}

static double at(const struct spectrum *s, int wavelength)
{
    return s->v[wavelength - SPECTRUM_FIRST_NM];
}

// A lamp of a smooth ground and mercury lines 1.2 nm wide.
static double spiky(double x)
{
    static const double LINES[] = {404.7, 435.8, 546.1, 577.0, 579.1, 611.6};
    double sum = 10 + 5 * sin(x / 60);
    for (size_t i = 0; i < sizeof LINES / sizeof *LINES; i++) {
        double d = (x - LINES[i]) / 1.2;
        sum += 300 * exp(-d * d);
    }
    return sum;
}

static double quartic(double x)
{
    double t = (x - 595) / 200;
    return 7 + t * (3 + t * (-2 + t * (5 + t * 4)));
}

static double cubic(double x)
{
    double t = (x - 595) / 200;
    return 7 + t * (3 + t * (-2 + t * 5));
}

static double straight(double x)
{
    return 2 * x - 300;
}

static double hot(double x)
{
    struct spectrum s;
    planck(2856, &s);
    return s.v[(int)x - SPECTRUM_FIRST_NM];
}

// CIE 167's continuation at the ends is exact for straight lines only.
static void sprague_carries_a_polynomial_of_the_fourth_order(void **state)
{
    (void)state;
    struct spectrum s;
    const double steps[] = {2, 5, 10, 20};
    for (size_t k = 0; k < 4; k++) {
        size_t n = sample(320, 880, steps[k], quartic);
        assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            assert_near(s.v[i], quartic(360 + i), POLYNOMIAL);
        n = sample(360, 840, steps[k], straight);
        assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            assert_near(s.v[i], straight(360 + i), POLYNOMIAL);
    }
}

// y(-1) of 0, 1, 0, 0, 0, 0 is -540/209 and y(-2) is -1960/209 (CIE 167:2005), so
// that Sprague's own formula gives the value in the middle of the first interval.
static void sprague_goes_on_beyond_the_ends_as_cie_167_says(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(400, 450, 10, straight);
    for (size_t i = 0; i < n; i++)
        values[i] = i == 1 ? 1 : 0;
    values[5] = -1e-30; // a signed table is not clamped
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    double a = -1960 / 209.0, b = -540 / 209.0, c = 0, d = 1, t = 0.5;
    double wanted = c + t * (2 * a - 16 * b + 16 * d + t * (-a + 16 * b + 16 * d +
                    t * (-9 * a + 39 * b + 66 * d + t * (13 * a - 64 * b - 124 * d +
                    t * (-5 * a + 25 * b + 50 * d))))) / 24;
    assert_near(at(&s, 405), wanted, ROUNDING);
}

static void sprague_meets_its_samples(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(380, 780, 5, spiky);
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    for (size_t i = 0; i < n; i++)
        assert_near(at(&s, (int)nm[i]), values[i], 0);
}

static void a_smooth_lamp_at_5_nm_is_the_one_at_1_nm(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(360, 830, 5, hot);
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    for (int i = 2 * 5; i < SPECTRUM_COUNT - 2 * 5; i++) // the ends: see CIE 167 above
        assert_near(s.v[i] / hot(360 + i), 1, SMOOTH);
}

static void few_samples_are_met_by_the_polynomial_they_allow(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(500, 580, 20, cubic);
    assert_int_equal(n, 5);
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    for (int w = 500; w <= 580; w++)
        assert_near(at(&s, w), cubic(w), POLYNOMIAL);
    n = sample(500, 520, 20, straight);
    assert_int_equal(n, 2);
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    for (int w = 500; w <= 520; w++)
        assert_near(at(&s, w), straight(w), POLYNOMIAL);
}

static void a_lamp_never_undershoots_below_zero_and_keeps_its_energy(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(380, 780, 5, straight);
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += 5 * (values[i] = i % 16 == 8 ? 1000 : 1);
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        assert_true(s.v[i] >= 0);
    assert_near(spectrum_sum(&s) / sum, 1, 1e-3); // the ends count half in one of the two sums
}

static void a_signed_table_may_undershoot(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(360, 830, 10, straight);
    for (size_t i = 0; i < n; i++)
        values[i] = -1;
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    assert_near(at(&s, 405), -1, ROUNDING);
}

static void a_table_on_the_grid_is_taken_as_it_is(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(360, 830, 1, spiky);
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        assert_near(s.v[i], values[i], 0);
}

static void uneven_steps_are_joined_by_straight_lines(void **state)
{
    (void)state;
    struct spectrum s;
    const double x[] = {380, 400, 410, 700.5, 780}, y[] = {460, 500, 520, 1101, 1260};
    assert_true(spectrum_from_samples(x, y, 5, false, &s, NULL));
    for (int w = 380; w <= 780; w++)
        assert_near(at(&s, w), straight(w), POLYNOMIAL);
}

static void outside_the_samples_lamps_are_dark_and_surfaces_go_on(void **state)
{
    (void)state;
    struct spectrum s;
    const double steps[] = {0.5, 1, 5, 30};
    for (size_t k = 0; k < 4; k++) {
        size_t n = sample(420, 660, steps[k], straight);
        assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
        assert_true(at(&s, 360) == 0 && at(&s, 418) == 0 && at(&s, 662) == 0);
        assert_true(spectrum_from_samples(nm, values, n, true, &s, NULL));
        assert_near(at(&s, 360), straight(420), POLYNOMIAL);
        assert_near(at(&s, 830), straight(660), POLYNOMIAL);
        assert_near(at(&s, 500), straight(500), POLYNOMIAL);
    }
}

static void fine_readings_keep_their_energy_when_binned(void **state)
{
    (void)state;
    struct spectrum s;
    size_t n = sample(370.13, 820.7, 0.35, spiky);
    double energy = 0;
    for (size_t i = 1; i < n; i++)
        energy += (nm[i] - nm[i - 1]) * (values[i] + values[i - 1]) / 2;
    assert_true(spectrum_from_samples(nm, values, n, false, &s, NULL));
    assert_near(spectrum_sum(&s) / energy, 1, ENERGY);
}

static void a_line_between_grid_points_is_not_lost(void **state)
{
    (void)state;
    struct spectrum s;
    const double x[] = {500, 549.4, 549.5, 549.6, 600}, y[] = {0, 0, 1000, 0, 0};
    assert_true(spectrum_from_samples(x, y, 5, false, &s, NULL));
    assert_near(spectrum_sum(&s), 100, 1e-9); // half of 0.2 nm times 1000
    assert_near(at(&s, 549), 50, 1e-9);      // its halves fall into two bins
    assert_near(at(&s, 550), 50, 1e-9);
}

// Mean of the lamp over each 1 nm bin, by many points.
static void average_over_bins(struct spectrum *out)
{
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        out->v[i] = 0;
        for (int k = 0; k < 100; k++)
            out->v[i] += spiky(SPECTRUM_FIRST_NM + i - 0.5 + (k + 0.5) / 100) / 100;
    }
}

static void a_spiky_lamp_read_at_0_35_nm_has_the_colour_of_its_1_nm_version(void **state)
{
    (void)state;
    struct spectrum fine, coarse, white;
    size_t n = sample(350, 840, 0.35, spiky);
    assert_true(spectrum_from_samples(nm, values, n, false, &fine, NULL));
    average_over_bins(&coarse);
    for (enum observer o = 0; o < OBSERVER_COUNT; o++) {
        struct xyz a = xyz_absolute(&fine, o), b = xyz_absolute(&coarse, o);
        assert_near(100 * a.X / b.Y, 100 * b.X / b.Y, SAME_XYZ);
        assert_near(100 * a.Y / b.Y, 100, SAME_XYZ);
        assert_near(100 * a.Z / b.Y, 100 * b.Z / b.Y, SAME_XYZ);
    }
    // point-sampling every 10 nm would be far off
    n = sample(360, 830, 10, spiky);
    assert_true(spectrum_from_samples(nm, values, n, false, &white, NULL));
    struct xyz a = xyz_absolute(&white, OBSERVER_1931_2), b = xyz_absolute(&fine, OBSERVER_1931_2);
    assert_true(fabs(a.Y / b.Y - 1) > 0.02);
}

static void spectra_that_make_no_sense_are_refused(void **state)
{
    (void)state;
    static const struct {
        double x[4], y[4];
        size_t count;
        const char *says;
    } bad[] = {
        {{400, 500, 450, 600}, {1, 1, 1, 1}, 4, "450"},
        {{400, 500, 500, 600}, {1, 1, 1, 1}, 4, "sample 3"},
        {{400, NAN, 500, 600}, {1, 1, 1, 1}, 4, "wavelength 2"},
        {{400, 450, 500, INFINITY}, {1, 1, 1, 1}, 4, "wavelength 4"},
        {{400, 450, 500, 600}, {1, 1, NAN, 1}, 4, "500 nm"},
        {{400, 450, 500, 600}, {1, -INFINITY, 1, 1}, 4, "450 nm"},
        {{0.4, 0.5, 0.6, 0.7}, {1, 1, 1, 1}, 4, "nanometres"},
        {{4000, 5000, 6000, 7000}, {1, 1, 1, 1}, 4, "nanometres"},
        {{300, 320, 340, 360}, {1, 1, 1, 1}, 4, "400..700"},
        {{400, 500, 600, 700}, {1, 1, 1, 1}, 1, "at least 2"},
        {{400, 500, 600, 700}, {1, 1, 1, 1}, 0, "at least 2"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spectrum s = {{42}};
        struct error err;
        assert_false(spectrum_from_samples(bad[i].x, bad[i].y, bad[i].count, false, &s, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_non_null(strstr(err.text, bad[i].says));
        assert_true(s.v[0] == 42);
    }
}

static void scaling_scales_the_sum(void **state)
{
    (void)state;
    struct spectrum s;
    planck(5000, &s);
    double sum = spectrum_sum(&s);
    spectrum_scale(&s, 0.25);
    assert_near(spectrum_sum(&s), sum / 4, 0); // a power of two is exact
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sprague_carries_a_polynomial_of_the_fourth_order),
        cmocka_unit_test(sprague_goes_on_beyond_the_ends_as_cie_167_says),
        cmocka_unit_test(sprague_meets_its_samples),
        cmocka_unit_test(a_smooth_lamp_at_5_nm_is_the_one_at_1_nm),
        cmocka_unit_test(few_samples_are_met_by_the_polynomial_they_allow),
        cmocka_unit_test(a_lamp_never_undershoots_below_zero_and_keeps_its_energy),
        cmocka_unit_test(a_signed_table_may_undershoot),
        cmocka_unit_test(a_table_on_the_grid_is_taken_as_it_is),
        cmocka_unit_test(uneven_steps_are_joined_by_straight_lines),
        cmocka_unit_test(outside_the_samples_lamps_are_dark_and_surfaces_go_on),
        cmocka_unit_test(fine_readings_keep_their_energy_when_binned),
        cmocka_unit_test(a_line_between_grid_points_is_not_lost),
        cmocka_unit_test(a_spiky_lamp_read_at_0_35_nm_has_the_colour_of_its_1_nm_version),
        cmocka_unit_test(spectra_that_make_no_sense_are_refused),
        cmocka_unit_test(scaling_scales_the_sum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
