// SPDX-License-Identifier: Apache-2.0
// Whether displays lie where the uncertainty of their models says.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration/cholesky.h"
#include "calibration/display_fit.h"
#include "calibration/uncertainty_fit.h"
#include "colorimetry/metric.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

// 95 % of errors lie within two standard uncertainties of a Gaussian; what is
// left for some hundred readings of another distribution.
#define COVERED_LEAST 0.90
#define COVERED_MOST 0.99
// Standard deviation of a standard deviation from 40 draws, thrice, and what the
// robust loss and the truncated modes add.
#define SPREAD_RATIO 1.6

static uint64_t seed;

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

// Sum of twelve: near enough a Gaussian.
static double gaussian(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += uniform();
    return sum;
}

static struct display_model panel(void)
{
    struct display_model m = {
        .matrix = {{438, 239, 179, 0.35}, {206, 622, 71, 0.36}, {0.1, 41, 941, 0.5}}};
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < DISPLAY_NODES; k++)
            m.curve[c][k] = pow(k / 1020.0, 2.2 + 0.05 * c);
        display_curve_repair(m.curve[c]);
    }
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

// Readings whose CIELAB is off by `noise` CIEDE2000 units an axis, so that any
// colour is as uncertain as any other.
static struct xyz read_with(const struct display_model *p, struct counts c, double noise)
{
    struct lab lab;
    struct mat3 scale;
    struct xyz xyz = display_forward(p, c);
    assert_true(lab_of(xyz, p->white, &lab, NULL));
    assert_true(mat3_invert(de00_metric(lab), &scale));
    struct vec3 off = mat3_apply(
        scale, (struct vec3){noise * gaussian(), noise * gaussian(), noise * gaussian()});
    return xyz_of_lab((struct lab){lab.L + off.x, lab.a + off.y, lab.b + off.z}, p->white);
}

static struct measurements measured(const struct display_model *p, int random, double noise)
{
    struct measurements m = {.path = "panel", .white = p->white, .absolute = true};
    m.patches = calloc(300, sizeof *m.patches);
    assert_non_null(m.patches);
    for (int k = 0; k <= 10 * 4; k++) {
        double v = k / 4 / 10.0;
        const struct counts ramps[4] = {{v, 0, 0}, {0, v, 0}, {0, 0, v}, {v, v, v}};
        m.patches[m.count++].counts = ramps[k % 4];
    }
    for (int k = 0; k < 6; k++)
        m.patches[m.count++].counts = (struct counts){1, 1, 1};
    for (int k = 0; k < random; k++)
        m.patches[m.count++].counts = (struct counts){uniform(), uniform(), uniform()};
    for (int i = 0; i < m.count; i++)
        m.patches[i].xyz = read_with(p, m.patches[i].counts, noise);
    return m;
}

static void the_parameters_covariance_is_the_scatter_of_repeated_fits(void **state)
{
    (void)state;
    enum { FITS = 40, PLACES = 4 };
    static const struct counts at[PLACES] = {
        {1, 1, 1}, {1.0 / 3, 1.0 / 3, 1.0 / 3}, {1, 0, 0}, {0, 2.0 / 3, 1}};
    static double covariance[9 * UNCERTAINTY_PLACES * UNCERTAINTY_PLACES];
    struct counts places[UNCERTAINTY_PLACES];
    struct display_model p = panel(), model = {0};
    struct display_uncertainty u = {0};
    struct day_fit solution = day_fit_start(6);
    struct error err = {0};
    double square[PLACES] = {0}, said[PLACES];
    for (int k = 0; k < UNCERTAINTY_PLACES; k++)
        places[k] = uncertainty_place(k);
    seed = 21;
    for (int n = 0; n < FITS; n++) {
        struct measurements m = measured(&p, 60, 0.2);
        assert_true(day_fit(&m, DISPLAY_DAY, &solution, &model, &err));
        for (int k = 0; k < PLACES; k++) {
            struct lab is, was;
            assert_true(lab_of(display_forward(&p, at[k]), p.white, &is, NULL));
            assert_true(lab_of(display_forward(&model, at[k]), p.white, &was, NULL));
            square[k] += pow(delta_e_2000(is, was), 2) / FITS;
        }
        if (n == 0) {
            assert_true(day_fit_covariance(&m, DISPLAY_DAY, &solution, places, UNCERTAINTY_PLACES,
                                           covariance, &err));
            assert_true(uncertainty_modes(covariance, &u, &err));
            for (int k = 0; k < PLACES; k++)
                said[k] = display_uncertainty_de00(&u, &model, at[k]);
        }
        measurements_fini(&m);
    }
    for (int k = 0; k < PLACES; k++) {
        print_message("said %.4f, is %.4f CIEDE2000\n", said[k], sqrt(square[k]));
        assert_in_range((long)(1000 * said[k]), (long)(1000 * sqrt(square[k]) / SPREAD_RATIO),
                        (long)(1000 * sqrt(square[k]) * SPREAD_RATIO));
    }
}

// Share of the L*, a*, b* errors of patches within two standard uncertainties.
static double covered(const struct measurements *test, const struct display_model *model,
                      const struct display_uncertainty *u)
{
    int within = 0;
    for (int i = 0; i < test->count; i++) {
        double c[9];
        struct lab is, was;
        assert_true(lab_of(test->patches[i].xyz, test->white, &is, NULL));
        assert_true(
            lab_of(display_forward(model, test->patches[i].counts), test->white, &was, NULL));
        display_uncertainty_lab(u, model, &test->patches[i].counts, 1, c);
        const double off[3] = {is.L - was.L, is.a - was.a, is.b - was.b};
        for (int n = 0; n < 3; n++)
            within += fabs(off[n]) <= 2 * sqrt(c[4 * n]);
    }
    return within / 3.0 / test->count;
}

static void new_readings_lie_within_twice_the_uncertainty(void **state)
{
    (void)state;
    static struct display_model model;
    static struct display_fit found;
    struct display_model p = panel();
    struct error err = {0};
    seed = 31;
    struct measurements m = measured(&p, 100, 0.2), test = measured(&p, 200, 0.2);
    assert_true(display_fit(&m, NULL, &model, &found, &err));
    double share = covered(&test, &model, &found.uncertainty);
    print_message("%.1f %% within two standard uncertainties\n", 100 * share);
    assert_true(share >= COVERED_LEAST && share <= COVERED_MOST);
    assert_near(found.uncertainty.noise_de00, 0.2, 0.12); // of 18 readings' differences
    measurements_fini(&m);
    measurements_fini(&test);
}

static void the_joint_covariance_of_many_colours_has_a_factor(void **state)
{
    (void)state;
    enum { COLOURS = 24 };
    static struct display_model model;
    static struct display_fit found;
    static double c[9 * COLOURS * COLOURS];
    struct counts counts[COLOURS];
    struct display_model p = panel();
    struct error err = {0};
    seed = 41;
    struct measurements m = measured(&p, 80, 0.2);
    assert_true(display_fit(&m, NULL, &model, &found, &err));
    found.uncertainty.smooth_de00 = 0.1;
    found.uncertainty.length_lab = 30;
    for (int i = 0; i < COLOURS; i++)
        counts[i] = (struct counts){uniform(), uniform(), uniform()};
    display_uncertainty_xyz(&found.uncertainty, &model, counts, COLOURS, c);
    for (int i = 0; i < 3 * COLOURS; i++)
        assert_true(c[i * 3 * COLOURS + i] > 0);
    assert_true(cholesky(c, 3 * COLOURS));
    measurements_fini(&m);
}

static const char *const panels[] = {
    "k2418u-202102090911",  "samsung-20200831",    "thinkbook14p-202208011950",
    "hp835g7-202009282223", "gpdwin-201906141510", "k2721ug-202302120107",
    "kolen-s-ipad-native",
};

static void real_panels_lie_where_the_uncertainty_of_their_models_says(void **state)
{
    (void)state;
    static struct display_model model;
    static struct display_fit found;
    const char *const data = "../shared/data/displays";
    if (access(data, R_OK)) {
        printf("skipped: measured displays are not at hand\n");
        skip();
    }
    for (size_t i = 0; i < sizeof panels / sizeof *panels; i++) {
        char path[256];
        struct measurements train, test;
        struct error err = {0};
        snprintf(path, sizeof path, "%s/%s.train.ti3", data, panels[i]);
        assert_true(measurements_load(path, &train, NULL));
        snprintf(path, sizeof path, "%s/%s.test.ti3", data, panels[i]);
        assert_true(measurements_load(path, &test, NULL));
        assert_true(display_fit(&train, NULL, &model, &found, &err));
        double share = covered(&test, &model, &found.uncertainty);
        print_message("%-26s %.1f %% within two standard uncertainties\n", panels[i], 100 * share);
        assert_true(share >= COVERED_LEAST && share <= COVERED_MOST);
        measurements_fini(&train);
        measurements_fini(&test);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_parameters_covariance_is_the_scatter_of_repeated_fits),
        cmocka_unit_test(new_readings_lie_within_twice_the_uncertainty),
        cmocka_unit_test(the_joint_covariance_of_many_colours_has_a_factor),
        cmocka_unit_test(real_panels_lie_where_the_uncertainty_of_their_models_says),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
