// SPDX-License-Identifier: Apache-2.0
// What is set for a reading: calibration, stored darks, linearity, stray light,
// boxcar, uncertainty; and whether real counts become the real irradiance.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "colorimetry/colour.h"
#include "drivers/irradiance.h"
#include "drivers/vendor_files.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static const double arithmetic = 1e-9; // relative, double rounding
static const double xy_close = 0.0015; // the issue's own
static const double lux_close = 0.02;  // the issue's own
static const double noise_share = 0.1; // of sigma, from 400 readings

static struct ocean_unit plain_unit(void)
{
    return (struct ocean_unit){.model = ocean_model(0x101e),
                               .serial = "EMU1",
                               .wavelength = {190, 0.35},
                               .order = -1,
                               .saturation = 22000};
}

static bool make_axis(const struct ocean_unit *unit, const char *csv, struct ocean_axis *axis,
                      struct error *err)
{
    struct table table = {0};
    assert_true(csv_parse("cal.csv", csv, strlen(csv), &table, NULL));
    bool ok = ocean_axis_make(unit, &table, 11.95, axis, err);
    table_fini(&table);
    return ok;
}

static struct ocean_reading flat(const struct ocean_unit *unit, const struct ocean_axis *axis,
                                 int dark, int level)
{
    static uint16_t raw[OCEAN_PIXELS_MOST];
    struct ocean_reading r = {.integration_us = 100000};
    for (int i = 0; i < unit->model->pixels; i++)
        raw[i] = (uint16_t)(i < 18 ? dark : level);
    ocean_reading_add(unit, axis->used, raw, &r);
    return r;
}

static void a_calibration_says_in_its_header_what_it_is(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_axis uj, named, micro, plain;
    assert_true(make_axis(&unit, "300,1e-5\n1000,1e-5\n", &uj, NULL));
    assert_true(make_axis(&unit, "nm,[uJoule/count]\n300,1e-5\n1000,1e-5\n", &named, NULL));
    assert_true(
        make_axis(&unit, "nm,uW_per_cm2_nm_per_count_per_s\n300,1e-5\n1000,1e-5\n", &micro, NULL));
    assert_true(
        make_axis(&unit, "nm,W_per_m2_nm_per_count_per_s\n300,1e-5\n1000,1e-5\n", &plain, NULL));
    assert_near(uj.worth[1000], 1e-5 / 11.95 / 0.35, arithmetic * 1e-5);
    assert_near(named.worth[1000], uj.worth[1000], 0);
    assert_near(micro.worth[1000], 1e-7, arithmetic * 1e-7);
    assert_near(plain.worth[1000], 1e-5, arithmetic * 1e-5);
    struct error err = {0};
    assert_false(make_axis(&unit, "nm,volts\n300,1\n1000,1\n", &uj, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_false(
        make_axis(&unit, "nm,uJ_per_count,sigma_percent\n300,1,2\n1000,1,-1\n", &uj, &err));
    assert_non_null(strstr(err.text, "cal.csv:3"));
}

static void calibration_uncertainty_is_a_part_of_the_light(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_axis axis;
    assert_true(
        make_axis(&unit, "nm,uJ_per_count,sigma_percent\n300,1e-5,4\n1000,1e-5,4\n", &axis, NULL));
    struct ocean_reading r = flat(&unit, &axis, 1000, 11000);
    const struct ocean_process process = {0};
    struct spectrum e, sigma;
    struct ocean_sigma parts;
    ocean_irradiance(&unit, &axis, &process, &r, &e, &sigma, &parts);
    for (int b = 20; b < SPECTRUM_COUNT - 20; b += 50) {
        assert_near(parts.calibration.v[b], 0.04 * e.v[b], arithmetic * e.v[b]);
        double squares = parts.shot.v[b] * parts.shot.v[b] + parts.read.v[b] * parts.read.v[b] +
                         parts.dark.v[b] * parts.dark.v[b] +
                         parts.calibration.v[b] * parts.calibration.v[b];
        assert_near(sigma.v[b] * sigma.v[b] / squares, 1, arithmetic);
    }
}

// A dark of a fixed pattern that grows with exposure.
static void write_dark(const struct ocean_unit *unit, double us, double counts[OCEAN_PIXELS_MOST])
{
    for (int i = 0; i < unit->model->pixels; i++)
        counts[i] = 1000 + (i % 7) * us / 20000 * (i >= 20);
}

static struct ocean_darks stored(const struct ocean_unit *unit)
{
    char *text = malloc(200000), *at = text + sprintf(text, "us100000,us300000x16\n");
    static double low[OCEAN_PIXELS_MOST], high[OCEAN_PIXELS_MOST];
    struct table table = {0};
    struct ocean_darks darks;
    write_dark(unit, 100000, low);
    write_dark(unit, 300000, high);
    for (int i = 0; i < unit->model->pixels; i++)
        at += sprintf(at, "%.17g,%.17g\n", low[i], high[i]);
    assert_true(csv_parse("dark.csv", text, strlen(text), &table, NULL));
    assert_true(ocean_darks_make(unit, &table, &darks, NULL));
    table_fini(&table);
    free(text);
    return darks;
}

static void a_stored_dark_is_taken_at_its_exposure_and_between_two(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_darks darks = stored(&unit);
    static double wanted[OCEAN_PIXELS_MOST];
    static struct ocean_dark dark;
    const int exposures[] = {100000, 150000, 300000}, averaged[] = {1, 1, 16};
    for (int k = 0; k < 3; k++) {
        assert_true(ocean_dark_at(&darks, &unit, exposures[k], &dark));
        write_dark(&unit, exposures[k], wanted);
        for (int i = 0; i < unit.model->pixels; i++)
            assert_near(dark.raw[i], wanted[i], arithmetic * 1000);
        assert_near(dark.black, 1000, arithmetic * 1000);
        assert_int_equal(dark.averaged, averaged[k]);
    }
    assert_false(ocean_dark_at(&darks, &unit, 99990, &dark));
    assert_false(ocean_dark_at(&darks, &unit, 300010, &dark));
    assert_false(ocean_dark_at(&(struct ocean_darks){0}, &unit, 100000, &dark));
    ocean_darks_fini(&darks);
}

static void a_stored_dark_takes_its_pattern_away_and_follows_the_baseline(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_axis axis;
    assert_true(make_axis(&unit, "300,1e-5\n1000,1e-5\n", &axis, NULL));
    struct ocean_darks darks = stored(&unit);
    static struct ocean_dark dark;
    assert_true(ocean_dark_at(&darks, &unit, 300000, &dark));
    struct ocean_reading r = {.averaged = 1, .integration_us = 300000};
    write_dark(&unit, 300000, r.raw);
    for (int i = 0; i < unit.model->pixels; i++)
        r.raw[i] += 13 + (i >= 20 ? 5000 : 0); // warmed since
    const struct ocean_process process = {.dark = &dark}, without = {0};
    struct spectrum e, ripple, sigma;
    ocean_irradiance(&unit, &axis, &process, &r, &e, &sigma, NULL);
    ocean_irradiance(&unit, &axis, &without, &r, &ripple, &sigma, NULL);
    double wanted = 5000 * 65535.0 / 22000 * 1e-5 / (11.95 * 0.3 * 0.35), worst = 0;
    for (int b = 5; b < SPECTRUM_COUNT - 5; b++) {
        assert_near(e.v[b], wanted, 1e-7 * wanted);
        worst = fmax(worst, fabs(ripple.v[b] / wanted - 1));
    }
    assert_true(worst > 1e-3);
    ocean_darks_fini(&darks);
}

static void bad_darks_are_refused_with_their_place(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    const char *const names[] = {"us100000,us100000", "us200000,us100000", "a,b",
                                 "us100000x0,us200000", "us-5,us100000"};
    struct error err = {0};
    struct ocean_darks darks;
    for (int k = 0; k < 7; k++) {
        char *text = malloc(100000), *at = text;
        struct table table = {0};
        at += sprintf(at, "\"%.*s\",\"%s\"\n", k < 5 ? (int)strcspn(names[k], ",") : 7,
                      k < 5 ? names[k] : "us10000", k < 5 ? strchr(names[k], ',') + 1 : "us20000");
        for (int i = 0; i < unit.model->pixels - (k == 5); i++)
            at += sprintf(at, "1000,%d\n", k == 6 && i == 9 ? 30000 : 1000);
        assert_true(csv_parse("dark.csv", text, strlen(text), &table, NULL));
        assert_false(ocean_darks_make(&unit, &table, &darks, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_non_null(strstr(err.text, k == 6 ? "dark.csv:11" : "dark.csv"));
        table_fini(&table);
        free(text);
    }
}

static void a_boxcar_keeps_energy_and_lessens_noise(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_axis axis;
    assert_true(make_axis(&unit, "300,1e-5\n1000,1e-5\n", &axis, NULL));
    struct ocean_reading r = flat(&unit, &axis, 0, 0);
    r.raw[1000] = 10000;
    struct ocean_process process = {0};
    struct spectrum sharp, smooth, sigma, less;
    ocean_irradiance(&unit, &axis, &process, &r, &sharp, &sigma, NULL);
    process.boxcar = 20;
    ocean_irradiance(&unit, &axis, &process, &r, &smooth, &less, NULL);
    assert_near(spectrum_sum(&smooth) / spectrum_sum(&sharp), 1, arithmetic);
    int lit = 0;
    for (int b = 0; b < SPECTRUM_COUNT; b++)
        lit += smooth.v[b] > 0;
    assert_true(lit >= 14 && lit <= 16); // 41 pixels of 0.35 nm
    assert_true(less.v[100] < 0.6 * sigma.v[100]);
}

static double chance(uint64_t *seed)
{
    double sum = 0;
    for (int i = 0; i < 12; i++) {
        *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        sum += (double)(*seed >> 11) / (double)(UINT64_C(1) << 53);
    }
    return sum - 6;
}

static void sigma_is_the_scatter_even_through_a_boxcar(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_axis axis;
    assert_true(make_axis(&unit, "300,1e-5\n1000,1e-5\n", &axis, NULL));
    enum { READINGS = 400, BIN = 200 };
    const struct ocean_process process = {.boxcar = 8};
    const double scale = 65535.0 / 22000;
    uint64_t seed = 11;
    double sum = 0, squares = 0;
    struct spectrum e, sigma;
    for (int n = 0; n < READINGS; n++) {
        struct ocean_reading r = {.integration_us = 100000, .averaged = 1};
        for (int i = 0; i < unit.model->pixels; i++) {
            double light = i >= 20 ? 9000 : 0;
            double noise = sqrt(2500 + light * scale * 65535 / 160000) / scale;
            r.raw[i] = 1000 + light + noise * chance(&seed);
        }
        ocean_irradiance(&unit, &axis, &process, &r, &e, &sigma, NULL);
        sum += e.v[BIN];
        squares += e.v[BIN] * e.v[BIN];
    }
    double scatter = sqrt(squares / READINGS - sum * sum / READINGS / READINGS);
    assert_near(sigma.v[BIN] / scatter, 1, noise_share);
}

static void stray_light_is_a_part_of_the_mean_signal(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_axis axis;
    assert_true(make_axis(&unit, "300,1e-5\n1000,1e-5\n", &axis, NULL));
    struct ocean_reading r = flat(&unit, &axis, 1000, 11000);
    const struct ocean_process process = {0};
    struct spectrum before, after, sigma;
    ocean_irradiance(&unit, &axis, &process, &r, &before, &sigma, NULL);
    unit.stray = 0.002;
    ocean_irradiance(&unit, &axis, &process, &r, &after, &sigma, NULL);
    assert_near(after.v[200] / before.v[200], 0.998, arithmetic);
}

static void linearity_may_be_over_counts_as_read(void **state)
{
    (void)state;
    struct ocean_unit unit = plain_unit();
    struct ocean_axis axis;
    unit.order = 1;
    unit.nonlinearity[0] = 1;
    unit.nonlinearity[1] = -2e-6;
    assert_true(make_axis(&unit, "300,1e-5\n1000,1e-5\n", &axis, NULL));
    struct ocean_reading r = flat(&unit, &axis, 1000, 11000);
    struct ocean_process process = {.bend = BEND_AS_READ};
    struct spectrum read, off, sigma;
    ocean_irradiance(&unit, &axis, &process, &r, &read, &sigma, NULL);
    process.bend = BEND_OFF;
    ocean_irradiance(&unit, &axis, &process, &r, &off, &sigma, NULL);
    const double k = 65535.0 / 22000;
    double light = 11000 * k / (1 - 2e-6 * 11000 * k), dark = 1000 * k / (1 - 2e-6 * 1000 * k);
    assert_near(read.v[200] / off.v[200], (light - dark) / (10000 * k), arithmetic);
}

// ---- real counts -----------------------------------------------------------------

#define FOLDER "../shared/data/spectrometer/"

static bool there(const char *path)
{
    if (access(path, R_OK) == 0)
        return true;
    printf("skipped: %s is not there\n", path);
    return false;
}

// The line of a table of names and values that begins as wanted, behind that.
static char *line_of(const char *path, const char *wanted)
{
    FILE *in = fopen(path, "r");
    char *line = NULL;
    size_t room = 0;
    assert_non_null(in);
    while (getline(&line, &room, in) > 0 && strncmp(line, wanted, strlen(wanted)) != 0)
        ;
    assert_int_equal(strncmp(line, wanted, strlen(wanted)), 0);
    fclose(in);
    char *rest = strdup(line + strlen(wanted));
    free(line);
    return rest;
}

// "w <- C + x * w", highest order first.
static int polynomial_of(const char *path, const char *wanted, double *c)
{
    char *line = line_of(path, wanted);
    double falling[8];
    int count = 0;
    for (const char *at = line; (at = strstr(at, "w <- ")) != NULL; at += 5)
        if (strstr(at, "+ x") && strchr(at, '+') - at < 24 && count < 8)
            falling[count++] = strtod(at + 5, NULL);
    for (int i = 0; i < count; i++)
        c[i] = falling[count - 1 - i];
    free(line);
    return count - 1;
}

// Column names of a raw file: nm, light and dark of the shorter exposure, worth.
static struct ocean_reading real_reading(const struct table *raw, int averaged, int us,
                                         struct ocean_dark *dark, const struct ocean_unit *unit)
{
    int light = table_column(raw, "light.counts_1"), black = table_column(raw, "dark.counts_1");
    struct ocean_reading r = {.averaged = averaged, .integration_us = us};
    assert_int_equal(raw->rows, unit->model->pixels);
    assert_true(light >= 0 && black >= 0);
    memset(dark, 0, sizeof *dark);
    for (size_t i = 0; i < raw->rows; i++) {
        r.raw[i] = averaged * table_at(raw, i, (size_t)light);
        dark->raw[i] = table_at(raw, i, (size_t)black);
    }
    dark->black = ocean_black_mean(unit->model, dark->raw);
    dark->averaged = averaged;
    return r;
}

static void calibration_of(const struct table *raw, const struct ocean_unit *unit,
                           struct ocean_axis *axis)
{
    char *text = malloc(200000), *at = text;
    struct table table = {0};
    size_t worth = (size_t)table_column(raw, "irrad_mult");
    at += sprintf(at, "nm,W_per_m2_nm_per_count_per_s\n");
    for (size_t i = 0; i < raw->rows; i++)
        at += sprintf(at, "%.17g,%.17g\n", ocean_wavelength(unit, (double)i),
                      table_at(raw, i, worth));
    assert_true(csv_parse("irrad_mult", text, strlen(text), &table, NULL));
    assert_true(ocean_axis_make(unit, &table, 11.95, axis, NULL));
    table_fini(&table);
    free(text);
}

static void check_lamp(const char *lamp, const char *raw_kind)
{
    char base[256], path[300];
    snprintf(base, sizeof base, FOLDER "%s.spct__%s.%s", lamp, lamp, raw_kind);
    snprintf(path, sizeof path, "%s.meta.tsv", base);
    if (!there(path))
        skip();
    struct ocean_unit unit = {
        .model = ocean_model(0x102a), .serial = "MAYP11278", .saturation = 64000};
    assert_int_equal(polynomial_of(path, "calib\twl.fun", unit.wavelength), 3);
    unit.order = polynomial_of(path, "calib\too.nl.fun", unit.nonlinearity);
    assert_true(unit.order == 7 && ocean_nonlinearity_valid(unit.nonlinearity, 7, 64000));
    char *text = line_of(path, "light\tinteg.time\t");
    int us = atoi(text);
    free(text);
    text = line_of(path, "light\tnum.scans\t");
    int averaged = atoi(text);
    free(text);

    struct table raw = {0};
    static struct ocean_axis axis;
    static struct ocean_dark dark;
    snprintf(path, sizeof path, "%s.raw.csv", base);
    assert_true(csv_load(path, &raw, NULL));
    calibration_of(&raw, &unit, &axis);
    struct ocean_reading r = real_reading(&raw, averaged, us, &dark, &unit);
    const struct ocean_process process = {.bend = BEND_AS_READ, .dark = &dark};
    struct spectrum ours, sigma, theirs;
    ocean_irradiance(&unit, &axis, &process, &r, &ours, &sigma, NULL);
    table_fini(&raw);

    struct vendor_file finished;
    snprintf(path, sizeof path, FOLDER "%s.spct__%s.spct.result.csv", lamp, lamp);
    assert_true(vendor_file_load(path, &finished, NULL));
    assert_true(
        spectrum_from_samples(finished.nm, finished.values, finished.count, false, &theirs, NULL));
    vendor_file_fini(&finished);
    struct xyz a = xyz_absolute(&ours, OBSERVER_1931_2), b = xyz_absolute(&theirs, OBSERVER_1931_2);
    struct xy p = xy_of(a), q = xy_of(b);
    double worst = 0;
    for (int i = 40; i < SPECTRUM_COUNT; i++)
        worst = fmax(worst, fabs(ours.v[i] - theirs.v[i]));
    printf("%s: %.1f lx, dx %+.5f, dy %+.5f, illuminance %+.3f %%, worst bin %.2g W/m2/nm\n", lamp,
           b.Y, p.x - q.x, p.y - q.y, 100 * (a.Y / b.Y - 1), worst);
    assert_near(p.x, q.x, xy_close);
    assert_near(p.y, q.y, xy_close);
    assert_near(a.Y / b.Y, 1, lux_close);
}

static void real_counts_of_an_incandescent_lamp_become_its_irradiance(void **state)
{
    (void)state;
    check_lamp("Incandescent", "raw_spct");
}

static void real_counts_of_a_white_led_become_its_irradiance(void **state)
{
    (void)state;
    check_lamp("Nichia.OptiSolis.5000K", "raw_mspct");
}

// The calibration tables list the wavelengths to 0.01 nm.
static void a_real_flames_calibration_fits_its_own_axis(void **state)
{
    (void)state;
    const char *const unit_path = FOLDER "FLMS04133.tsv", *const path = FOLDER "cal_FLMS04133.tsv";
    const double rounding = 0.0051;
    if (!there(unit_path) || !there(path))
        skip();
    struct ocean_unit unit = plain_unit();
    static struct ocean_axis axis;
    assert_int_equal(polynomial_of(unit_path, "descriptor.inst.calib.wl.fun", unit.wavelength), 3);
    char *nm = line_of(path, "cal.spct.w.length\t2048\t");
    char *worth = line_of(path, "cal.spct.irrad.mult\t2048\t");
    char *text = malloc(200000), *at = text, *n = nm, *w = worth;
    static double value[2048];
    at += sprintf(at, "nm,W_per_m2_nm_per_count_per_s\n");
    for (int i = 0; i < 2048; i++) {
        double place = strtod(n, &n);
        value[i] = strtod(w, &w);
        assert_near(ocean_wavelength(&unit, i), place, rounding);
        at += sprintf(at, "%.17g,%.17g\n", place, value[i]);
    }
    assert_true(make_axis(&unit, text, &axis, NULL));
    assert_true(axis.edge_nm[axis.used.first] < 361 && axis.edge_nm[axis.used.last] > 829);
    for (int i = axis.used.first; i <= axis.used.last; i++)
        assert_near(axis.worth[i] / value[i], 1, 0.005); // half of its rounding, where it is steep
    free(nm);
    free(worth);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_calibration_says_in_its_header_what_it_is),
        cmocka_unit_test(calibration_uncertainty_is_a_part_of_the_light),
        cmocka_unit_test(a_stored_dark_is_taken_at_its_exposure_and_between_two),
        cmocka_unit_test(a_stored_dark_takes_its_pattern_away_and_follows_the_baseline),
        cmocka_unit_test(bad_darks_are_refused_with_their_place),
        cmocka_unit_test(a_boxcar_keeps_energy_and_lessens_noise),
        cmocka_unit_test(sigma_is_the_scatter_even_through_a_boxcar),
        cmocka_unit_test(stray_light_is_a_part_of_the_mean_signal),
        cmocka_unit_test(linearity_may_be_over_counts_as_read),
        cmocka_unit_test(real_counts_of_an_incandescent_lamp_become_its_irradiance),
        cmocka_unit_test(real_counts_of_a_white_led_become_its_irradiance),
        cmocka_unit_test(a_real_flames_calibration_fits_its_own_axis),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
