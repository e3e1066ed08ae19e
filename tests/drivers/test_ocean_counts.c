// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "drivers/ocean_counts.h"
#include "drivers/spectrometer.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static const double arithmetic = 1e-9; // relative, double rounding
static const double binning = 2e-3;    // relative: a straight line over a curved wavelength axis
static const double noise_share = 0.1; // of sigma, from 400 readings

// The wavelengths and the non-linearity of a real Flame-S.
static const double flame_nm[4] = {189.80809, 0.38583738, -1.9762801e-05, -9.4763608e-10};
static const char *const flame_bend[8] = {"8.93344e-01",  "7.20663e-06", "-1.33919e-10",
                                          "-2.26498e-15", "8.91163e-20", "4.24693e-25",
                                          "-2.89509e-29", "1.55269e-34"};

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
    assert_true(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    return unit;
}

static struct ocean_axis axis_of(const struct ocean_unit *unit, const char *csv)
{
    struct table table = {0};
    struct ocean_axis axis;
    assert_true(csv_parse("cal.csv", csv, strlen(csv), &table, NULL));
    assert_true(ocean_axis_make(unit, &table, &axis, NULL));
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

static void a_slot_may_fill_all_fifteen_bytes(void **state)
{
    (void)state;
    slots s;
    struct ocean_unit unit;
    fill(s);
    put(s, 0, "EMU456789012345");
    assert_true(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    assert_string_equal(unit.serial, "EMU456789012345");
}

static void an_unset_saturation_means_full_scale(void **state)
{
    (void)state;
    slots s;
    struct ocean_unit unit;
    fill(s);
    s[17][6] = s[17][7] = 0;
    assert_true(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
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
    assert_false(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
    assert_int_equal(err.code, ERROR_DATA);
    fill(s);
    memset(s[2] + 2, 0xff, 15);
    assert_false(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
    fill(s);
    put(s, 2, "-0.38");
    assert_false(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
    fill(s);
    memset(s[0] + 2, 0xff, 15);
    assert_false(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, &err));
}

static void a_bad_non_linearity_is_not_applied(void **state)
{
    (void)state;
    slots s;
    struct ocean_unit unit;
    fill(s);
    memset(s[9] + 2, 0xff, 15);
    assert_true(ocean_unit_parse((const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    assert_int_equal(unit.order, -1);
    const double zero[8] = {0}, odd[2] = {1, 1e-4}, nan_one[1] = {NAN}, fine[1] = {1};
    assert_false(ocean_nonlinearity_valid(zero, 7));
    assert_false(ocean_nonlinearity_valid(odd, 1));
    assert_false(ocean_nonlinearity_valid(nan_one, 0));
    assert_false(ocean_nonlinearity_valid(fine, 8));
    assert_true(ocean_nonlinearity_valid(fine, 0));
}

static void a_spectrum_needs_its_length_and_its_sync_byte(void **state)
{
    (void)state;
    static uint8_t bytes[OCEAN_SPECTRUM_BYTES];
    uint16_t raw[OCEAN_PIXELS];
    struct error err;
    bytes[2] = 0x34, bytes[3] = 0x12, bytes[4096] = 0x69;
    assert_true(ocean_unpack(bytes, sizeof bytes, raw, &err));
    assert_int_equal(raw[1], 0x1234);
    assert_false(ocean_unpack(bytes, 1000, raw, &err));
    bytes[4096] = 0x68;
    assert_false(ocean_unpack(bytes, sizeof bytes, raw, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

static void a_calibration_that_makes_no_sense_is_refused_with_its_line(void **state)
{
    (void)state;
    const char *const bad[] = {
        "nm,uJ_per_count\n400,1e-5\n400,1e-5\n", "nm,uJ_per_count\n400,1e-5\n500,-1e-5\n",
        "nm,a,b\n400,1,2\n500,1,2\n", "nm,uJ_per_count\n100,1e-5\n150,1e-5\n"};
    struct ocean_unit unit = unit_of();
    for (int i = 0; i < 4; i++) {
        struct table table = {0};
        struct ocean_axis axis;
        struct error err = {0};
        assert_true(csv_parse("cal.csv", bad[i], strlen(bad[i]), &table, NULL));
        assert_false(ocean_axis_make(&unit, &table, &axis, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_non_null(strstr(err.text, i < 2 ? "cal.csv:3" : "cal.csv"));
        table_fini(&table);
    }
}

// One reading with dark raw counts on the black pixels and level on all others.
static struct ocean_reading even(const struct ocean_unit *unit, const struct ocean_axis *axis,
                                 int dark, int level)
{
    static uint16_t raw[OCEAN_PIXELS];
    struct ocean_reading reading = {.integration_us = 100000};
    for (int i = 0; i < OCEAN_PIXELS; i++)
        raw[i] = (uint16_t)(i < OCEAN_ACTIVE_FIRST - 2 ? dark : level);
    ocean_reading_add(unit, axis, raw, &reading);
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
    ocean_irradiance(&unit, &axis, 11.95, &reading, &e, &sigma);
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
    static uint16_t raw[OCEAN_PIXELS];
    struct ocean_reading reading = {.integration_us = 100000};
    int lines[] = {600, 777, 1021, 1400};
    for (int i = 0; i < 4; i++)
        raw[lines[i]] = 20000;
    ocean_reading_add(&unit, &axis, raw, &reading);
    struct spectrum e, sigma;
    ocean_irradiance(&unit, &axis, 11.95, &reading, &e, &sigma);
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
    ocean_irradiance(&unit, &axis, 11.95, &reading, &bent, &sigma);
    ocean_irradiance(&straight, &axis, 11.95, &reading, &plain, &sigma);
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
    ocean_irradiance(&unit, &axis, 11.95, &reading, &e, &sigma);
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
    ocean_irradiance(&unit, &axis, 11.95, &reading, &e, &sigma);
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
        static uint16_t raw[OCEAN_PIXELS];
        struct ocean_reading reading = {.integration_us = 100000};
        for (int i = 0; i < OCEAN_PIXELS; i++) {
            bool active = i >= OCEAN_ACTIVE_FIRST;
            double noise = sqrt(50 * 50 + (active ? shot : 0)) / scale;
            raw[i] = (uint16_t)lrint(1000 + (active ? mean : 0) + noise * chance(&seed));
        }
        ocean_reading_add(&unit, &axis, raw, &reading);
        ocean_irradiance(&unit, &axis, 11.95, &reading, &e, &sigma);
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
    static uint16_t raw[OCEAN_PIXELS];
    struct ocean_reading one = {.integration_us = 100000}, four = one;
    for (int i = OCEAN_ACTIVE_FIRST; i < OCEAN_PIXELS; i++)
        raw[i] = 9000;
    ocean_reading_add(&unit, &axis, raw, &one);
    for (int i = 0; i < 4; i++)
        ocean_reading_add(&unit, &axis, raw, &four);
    struct spectrum e, e4, sigma, sigma4;
    ocean_irradiance(&unit, &axis, 11.95, &one, &e, &sigma);
    ocean_irradiance(&unit, &axis, 11.95, &four, &e4, &sigma4);
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
    assert_int_equal(at.saturated, axis.last - axis.first + 1);
    assert_true(at.peak == 1);
}

static void exposure_goes_to_85_percent_and_stays(void **state)
{
    (void)state;
    int us = ocean_next_exposure(2000, 0.4, 0, 0, 50, 1000000);
    assert_int_equal(us, 4250);
    assert_int_equal(ocean_next_exposure(us, 0.85, 0, 0, 50, 1000000), us);
    assert_int_equal(ocean_next_exposure(us, 0.80, 0, 0, 50, 1000000), us);
}

static void exposure_steps_are_bounded(void **state)
{
    (void)state;
    assert_int_equal(ocean_next_exposure(1000, 0.01, 0.01, 0, 50, 1000000), 8000);
    assert_int_equal(ocean_next_exposure(8000, 1, 0, 1, 50, 1000000), 2000);
    assert_int_equal(ocean_next_exposure(160000, 1, 0, 1500, 50, 1000000), 10000);
    assert_int_equal(ocean_next_exposure(1000, 1, 0, 2048, 50, 1000000), 1000);
    assert_int_equal(ocean_next_exposure(500000, 0.1, 0, 0, 50, 1000000), 1000000);
    assert_int_equal(ocean_next_exposure(500000, 0.85, 0, 0, 50, 200000), 200000);
}

static void exposures_from_half_a_mains_period_on_are_its_multiples(void **state)
{
    (void)state;
    for (double peak = 0.02; peak < 1; peak += 0.007)
        for (int us = 1000; us < 600000; us = us * 3 / 2 / 10 * 10) {
            int next = ocean_next_exposure(us, peak, 0.02, 0, 50, 1000000);
            assert_true(next >= 1000 && next <= 1000000);
            assert_true(next < 10000 || next % 10000 == 0 || next == us);
        }
    assert_int_equal(ocean_round_exposure(30000, 60, 1000000), 25000);
    assert_int_equal(ocean_round_exposure(999999, 60, 1000000), 992000);
}

static void exposure_settles_from_anywhere_without_swinging(void **state)
{
    (void)state;
    for (double rate = 2e-7; rate < 1e-3; rate *= 1.07) { // part of saturation per us
        int us = 100000, steps = 0;
        for (; steps < 20; steps++) {
            double peak = 0.05 + rate * us;
            int next = ocean_next_exposure(us, fmin(peak, 1), 0.05, peak >= 1 ? 1 : 0, 50, 1000000);
            if (next == us)
                break;
            us = next;
        }
        double peak = 0.05 + rate * us;
        assert_true(steps < 8);
        assert_true(peak <= 0.92 || us == 1000);
        assert_true(peak >= 0.45 || us == 1000000);
    }
}

// Light between two allowed exposures, with 1 % of noise on its peak.
static void noise_does_not_make_the_exposure_hunt(void **state)
{
    (void)state;
    for (double rate = 1e-6; rate < 9e-5; rate *= 1.03) {
        int us = 100000, changes = 0;
        for (int reading = 0; reading < 300; reading++) {
            double peak = 0.05 + rate * us * (1 + 0.01 * sin(reading * 12.9898));
            int next = ocean_next_exposure(us, fmin(peak, 1), 0.05, peak >= 1 ? 1 : 0, 50, 1000000);
            changes += reading >= 10 && next != us;
            us = next;
        }
        assert_true(changes <= 1);
    }
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
    assert_int_equal(count, OCEAN_PIXELS);
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
        cmocka_unit_test(exposure_goes_to_85_percent_and_stays),
        cmocka_unit_test(exposure_steps_are_bounded),
        cmocka_unit_test(exposures_from_half_a_mains_period_on_are_its_multiples),
        cmocka_unit_test(exposure_settles_from_anywhere_without_swinging),
        cmocka_unit_test(noise_does_not_make_the_exposure_hunt),
        cmocka_unit_test(a_real_units_pixels_lie_where_its_vendor_says),
        cmocka_unit_test(a_spectrometer_that_is_not_there_is_gone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
