// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "drivers/irradiance.h"
#include "drivers/spectrometer.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static const double arithmetic = 1e-9; // relative, double rounding
static const double binning = 2e-3;    // relative: a straight line over a curved wavelength axis
static const double noise_share = 0.1; // of sigma, from 400 readings

// The wavelengths and the non-linearity of a real Flame-S.
static const double flame_nm[4] = {189.80809, 0.38583738, -1.9762801e-05, -9.4763608e-10};
static const struct ocean_process simply = {0};
static const char *const flame_bend[8] = {"8.93344e-01",  "7.20663e-06", "-1.33919e-10",
                                          "-2.26498e-15", "8.91163e-20", "4.24693e-25",
                                          "-2.89509e-29", "1.55269e-34"};

enum { PIXELS = 2048, ACTIVE_FIRST = 20 };

typedef uint8_t slots[OCEAN_SLOTS][OCEAN_SLOT_BYTES];

static void put(slots s, int slot, const char *text)
{
    memset(s[slot] + 2, 0x5a, 15); // junk behind the NUL
    size_t n = strlen(text);
    memcpy(s[slot] + 2, text, n < 15 ? n + 1 : 15);
}

static void fill(slots s)
{
    char text[32];
    memset(s, 0, sizeof(slots));
    for (int i = 0; i < OCEAN_SLOTS; i++) {
        s[i][0] = 0x05;
        s[i][1] = (uint8_t)i;
    }
    put(s, 0, "EMU2P00001");
    for (int i = 0; i < 4; i++) {
        snprintf(text, sizeof text, "%.8g", flame_nm[i]);
        put(s, 1 + i, text);
    }
    for (int i = 0; i < 8; i++)
        put(s, 6 + i, flame_bend[i]);
    put(s, 14, "7");
    s[17][6] = 22000 & 255;
    s[17][7] = 22000 >> 8;
}

static struct ocean_unit unit_of(void)
{
    slots s;
    struct ocean_unit unit;
    fill(s);
    assert_true(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    return unit;
}

static struct ocean_axis axis_of(const struct ocean_unit *unit, const char *csv)
{
    struct table table = {0};
    struct ocean_axis axis;
    assert_true(csv_parse("cal.csv", csv, strlen(csv), &table, NULL));
    assert_true(ocean_axis_make(unit, &table, 11.95, &axis, NULL));
    table_fini(&table);
    return axis;
}

static const char flat_csv[] = "nm,uJ_per_count\n300,1e-5\n1000,1e-5\n";

static void slots_tell_serial_wavelengths_and_saturation(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    assert_string_equal(unit.serial, "EMU2P00001");
    assert_near(unit.wavelength[0], 189.80809, 1e-5);
    assert_near(unit.saturation, 22000, 0);
    assert_int_equal(unit.order, 7);
}

static void a_refit_replaces_the_units_wavelengths_but_not_what_it_says(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    const double refit[4] = {191, 0.385, -1.9e-5, -9e-10}, falling[4] = {900, -0.3, 0, 0};
    assert_false(ocean_unit_rewave(&unit, falling));
    assert_true(ocean_unit_rewave(&unit, refit));
    struct detector d = ocean_detector(&unit);
    assert_int_equal(d.pixels, PIXELS);
    assert_int_equal(d.active.first, ACTIVE_FIRST);
    assert_int_equal(d.black[0].last, 17);
    assert_int_equal(d.order, 7);
    for (int i = 0; i < 4; i++) {
        assert_near(d.wavelength[i], refit[i], 0);
        assert_near(d.own_wavelength[i], unit_of().wavelength[i], 0);
    }
}

static void a_slot_may_fill_all_fifteen_bytes(void **state)
{
    (void)state;
    slots s;
    struct ocean_unit unit;
    fill(s);
    put(s, 0, "EMU456789012345");
    assert_true(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    assert_string_equal(unit.serial, "EMU456789012345");
}

static void an_unset_saturation_means_full_scale(void **state)
{
    (void)state;
    slots s;
    struct ocean_unit unit;
    fill(s);
    s[17][6] = s[17][7] = 0;
    assert_true(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    assert_near(unit.saturation, 65535, 0);
}

static void slots_that_answer_for_another_or_hold_junk_are_refused(void **state)
{
    (void)state;
    slots s;
    struct ocean_unit unit;
    struct error err;
    fill(s);
    s[3][1] = 9;
    assert_false(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
    assert_int_equal(err.code, ERROR_DATA);
    fill(s);
    memset(s[2] + 2, 0xff, 15);
    assert_false(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
    fill(s);
    put(s, 2, "-0.38");
    assert_false(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
    fill(s);
    memset(s[0] + 2, 0xff, 15);
    assert_false(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
}

static void a_bad_non_linearity_is_not_applied(void **state)
{
    (void)state;
    slots s;
    struct ocean_unit unit;
    fill(s);
    memset(s[9] + 2, 0xff, 15);
    assert_true(
        ocean_unit_parse(ocean_model(0x101e), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    assert_int_equal(unit.order, -1);
    const double zero[8] = {0}, odd[2] = {1, 1e-4}, nan_one[1] = {NAN}, fine[1] = {1};
    assert_false(ocean_nonlinearity_valid(zero, 7, 65535));
    assert_false(ocean_nonlinearity_valid(odd, 1, 65535));
    assert_false(ocean_nonlinearity_valid(nan_one, 0, 65535));
    assert_false(ocean_nonlinearity_valid(fine, 8, 65535));
    assert_true(ocean_nonlinearity_valid(fine, 0, 65535));
}

static void a_spectrum_needs_its_length_and_its_sync_byte(void **state)
{
    (void)state;
    static uint8_t bytes[(2 * PIXELS + 1)];
    uint16_t raw[OCEAN_PIXELS_MOST];
    struct error err;
    bytes[2] = 0x34, bytes[3] = 0x12, bytes[4096] = 0x69;
    assert_true(ocean_unpack(ocean_model(0x101e), bytes, sizeof bytes, raw, &err));
    assert_int_equal(raw[1], 0x1234);
    assert_false(ocean_unpack(ocean_model(0x101e), bytes, 1000, raw, &err));
    bytes[4096] = 0x68;
    assert_false(ocean_unpack(ocean_model(0x101e), bytes, sizeof bytes, raw, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

static void a_calibration_that_makes_no_sense_is_refused_with_its_line(void **state)
{
    (void)state;
    const char *const bad[] = {"nm,uJ_per_count\n400,1e-5\n400,1e-5\n",
                               "nm,uJ_per_count\n400,1e-5\n500,-1e-5\n",
                               "nm,a,b\n400,1,2\n500,1,2\n", "nm,a\n400,1\n500,1\n",
                               "nm,uJ_per_count\n100,1e-5\n150,1e-5\n"};
    struct ocean_unit unit = unit_of();
    for (int i = 0; i < 5; i++) {
        struct table table = {0};
        struct ocean_axis axis;
        struct error err = {0};
        assert_true(csv_parse("cal.csv", bad[i], strlen(bad[i]), &table, NULL));
        assert_false(ocean_axis_make(&unit, &table, 11.95, &axis, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_non_null(strstr(err.text, i < 2 ? "cal.csv:3" : "cal.csv"));
        table_fini(&table);
    }
}

// One reading with dark raw counts on the black pixels and level on all others.
static struct ocean_reading even(const struct ocean_unit *unit, const struct ocean_axis *axis,
                                 int dark, int level)
{
    static uint16_t raw[OCEAN_PIXELS_MOST];
    struct ocean_reading reading = {.integration_us = 100000};
    for (int i = 0; i < PIXELS; i++)
        raw[i] = (uint16_t)(i < ACTIVE_FIRST - 2 ? dark : level);
    ocean_reading_add(unit, axis->used, raw, &reading);
    return reading;
}

static void counts_become_the_irradiance_of_the_textbook(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    unit.order = -1;
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    struct ocean_reading reading = even(&unit, &axis, 1000, 11000);
    struct spectrum e, sigma;
    ocean_irradiance(&unit, &axis, &simply, &reading, &e, &sigma, NULL);
    double counts = 10000 * 65535.0 / 22000;
    for (int nm = 400; nm <= 800; nm += 50) {
        double pixel = 0;
        for (int i = 0; i < 30; i++) // where the wavelength polynomial gives nm
            pixel -= (flame_nm[0] +
                      pixel * (flame_nm[1] + pixel * (flame_nm[2] + pixel * flame_nm[3])) - nm) /
                     (flame_nm[1] + pixel * (2 * flame_nm[2] + 3 * pixel * flame_nm[3]));
        double width = flame_nm[1] + 2 * flame_nm[2] * pixel + 3 * flame_nm[3] * pixel * pixel;
        double wanted = 1e-5 * counts / (11.95 * 0.1 * width);
        assert_near(e.v[nm - SPECTRUM_FIRST_NM], wanted, binning * wanted);
    }
}

static void binning_keeps_the_energy(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    unit.order = -1;
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    static uint16_t raw[OCEAN_PIXELS_MOST];
    struct ocean_reading reading = {.integration_us = 100000};
    int lines[] = {600, 777, 1021, 1400};
    for (int i = 0; i < 4; i++)
        raw[lines[i]] = 20000;
    ocean_reading_add(&unit, axis.used, raw, &reading);
    struct spectrum e, sigma;
    ocean_irradiance(&unit, &axis, &simply, &reading, &e, &sigma, NULL);
    double wanted = 4 * 20000 * (65535.0 / 22000) * 1e-5 / (11.95 * 0.1);
    assert_near(spectrum_sum(&e), wanted, arithmetic * wanted);
}

static void non_linearity_divides_the_scaled_count_above_dark(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of(), straight = unit;
    straight.order = -1;
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    struct ocean_reading reading = even(&unit, &axis, 1000, 11000);
    struct spectrum bent, plain, sigma;
    ocean_irradiance(&unit, &axis, &simply, &reading, &bent, &sigma, NULL);
    ocean_irradiance(&straight, &axis, &simply, &reading, &plain, &sigma, NULL);
    double s = 10000 * 65535.0 / 22000, divisor = 0;
    for (int i = 7; i >= 0; i--)
        divisor = divisor * s + unit.nonlinearity[i];
    assert_true(divisor > 0.9 && divisor < 1.1 && divisor != 1);
    assert_near(plain.v[200] / bent.v[200], divisor, arithmetic);
}

static void no_light_is_no_irradiance(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    struct ocean_reading reading = even(&unit, &axis, 1000, 1000);
    struct spectrum e, sigma;
    ocean_irradiance(&unit, &axis, &simply, &reading, &e, &sigma, NULL);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        assert_true(fabs(e.v[i]) < 1e-12);
    assert_true(sigma.v[200] > 0);
}

static void beyond_the_calibration_there_is_nothing(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    struct ocean_axis axis = axis_of(&unit, "400,1e-5\n700,1e-5\n");
    struct ocean_reading reading = even(&unit, &axis, 1000, 11000);
    struct spectrum e, sigma;
    ocean_irradiance(&unit, &axis, &simply, &reading, &e, &sigma, NULL);
    assert_true(e.v[390 - 360] == 0 && sigma.v[390 - 360] == 0);
    assert_true(e.v[450 - 360] > 0 && e.v[690 - 360] > 0);
    assert_true(e.v[710 - 360] == 0);
}

static double chance(uint64_t *seed) // roughly normal, of deviation 1
{
    double sum = 0;
    for (int i = 0; i < 12; i++) {
        *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        sum += (double)(*seed >> 11) / (double)(UINT64_C(1) << 53);
    }
    return sum - 6;
}

static void sigma_is_the_scatter_of_noisy_readings(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    unit.order = -1;
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    enum { READINGS = 400, BIN = 200 };
    const double scale = 65535.0 / 22000, mean = 9000;
    const double shot = mean * scale * 65535 / 160000;
    uint64_t seed = 1;
    double sum = 0, squares = 0;
    struct spectrum e, sigma;
    for (int n = 0; n < READINGS; n++) {
        static uint16_t raw[OCEAN_PIXELS_MOST];
        struct ocean_reading reading = {.integration_us = 100000};
        for (int i = 0; i < PIXELS; i++) {
            bool active = i >= ACTIVE_FIRST;
            double noise = sqrt(50 * 50 + (active ? shot : 0)) / scale;
            raw[i] = (uint16_t)lrint(1000 + (active ? mean : 0) + noise * chance(&seed));
        }
        ocean_reading_add(&unit, axis.used, raw, &reading);
        ocean_irradiance(&unit, &axis, &simply, &reading, &e, &sigma, NULL);
        sum += e.v[BIN];
        squares += e.v[BIN] * e.v[BIN];
    }
    double scatter = sqrt(squares / READINGS - sum * sum / READINGS / READINGS);
    assert_near(sigma.v[BIN] / scatter, 1, noise_share);
}

static void averaging_four_readings_halves_sigma(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    static uint16_t raw[OCEAN_PIXELS_MOST];
    struct ocean_reading one = {.integration_us = 100000}, four = one;
    for (int i = ACTIVE_FIRST; i < PIXELS; i++)
        raw[i] = 9000;
    ocean_reading_add(&unit, axis.used, raw, &one);
    for (int i = 0; i < 4; i++)
        ocean_reading_add(&unit, axis.used, raw, &four);
    struct spectrum e, e4, sigma, sigma4;
    ocean_irradiance(&unit, &axis, &simply, &one, &e, &sigma, NULL);
    ocean_irradiance(&unit, &axis, &simply, &four, &e4, &sigma4, NULL);
    assert_near(e4.v[200] / e.v[200], 1, arithmetic);
    assert_near(sigma4.v[200] / sigma.v[200], 0.5, arithmetic);
}

static void saturation_is_told_from_raw_counts(void **state)
{
    (void)state;
    struct ocean_unit unit = unit_of();
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    struct ocean_reading below = even(&unit, &axis, 1000, 21999);
    struct ocean_reading at = even(&unit, &axis, 1000, 22000);
    assert_int_equal(below.saturated, 0);
    assert_true(below.peak < 1);
    assert_int_equal(at.saturated, axis.used.last - axis.used.first + 1);
    assert_true(at.peak == 1);
}

static const char real_unit[] = "../shared/data/spectrometer/FLMS04133.tsv";
static const double file_digits = 1e-4; // nm; the vendor's coefficients are rounded

static void a_real_units_pixels_lie_where_its_vendor_says(void **state)
{
    (void)state;
    FILE *in = fopen(real_unit, "r");
    if (!in) {
        printf("skipped: %s is not there\n", real_unit);
        skip();
    }
    struct ocean_unit unit = unit_of();
    struct ocean_axis axis = axis_of(&unit, flat_csv);
    char name[64];
    int count;
    while (fscanf(in, "%63s %d", name, &count) == 2 && strcmp(name, "descriptor.wavelengths") != 0)
        assert_true(fscanf(in, "%*[^\n]") == 0);
    assert_int_equal(count, PIXELS);
    for (int i = 0; i < count; i++) {
        double nm;
        assert_int_equal(fscanf(in, "%lf", &nm), 1);
        assert_near((axis.edge_nm[i] + axis.edge_nm[i + 1]) / 2, nm, file_digits);
    }
    fclose(in);
}

static void a_spectrometer_that_is_not_there_is_gone(void **state)
{
    (void)state;
    struct spectrometer_options options;
    struct error err = {0};
    memset(&options, 0, sizeof options);
    settings_preset(spectrometer_settings, &options);
    strcpy(options.serial, "no such unit");
    strcpy(options.calibration, "/nowhere.csv");
    assert_null(spectrometer_drivers[0]->open(&options, clock_now_ns() + NS_PER_S, &err));
    assert_int_equal(err.code, ERROR_GONE);
    spectrometer_drivers[0]->close(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slots_tell_serial_wavelengths_and_saturation),
        cmocka_unit_test(a_refit_replaces_the_units_wavelengths_but_not_what_it_says),
        cmocka_unit_test(a_slot_may_fill_all_fifteen_bytes),
        cmocka_unit_test(an_unset_saturation_means_full_scale),
        cmocka_unit_test(slots_that_answer_for_another_or_hold_junk_are_refused),
        cmocka_unit_test(a_bad_non_linearity_is_not_applied),
        cmocka_unit_test(a_spectrum_needs_its_length_and_its_sync_byte),
        cmocka_unit_test(a_calibration_that_makes_no_sense_is_refused_with_its_line),
        cmocka_unit_test(counts_become_the_irradiance_of_the_textbook),
        cmocka_unit_test(binning_keeps_the_energy),
        cmocka_unit_test(non_linearity_divides_the_scaled_count_above_dark),
        cmocka_unit_test(no_light_is_no_irradiance),
        cmocka_unit_test(beyond_the_calibration_there_is_nothing),
        cmocka_unit_test(sigma_is_the_scatter_of_noisy_readings),
        cmocka_unit_test(averaging_four_readings_halves_sigma),
        cmocka_unit_test(saturation_is_told_from_raw_counts),
        cmocka_unit_test(a_real_units_pixels_lie_where_its_vendor_says),
        cmocka_unit_test(a_spectrometer_that_is_not_there_is_gone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
