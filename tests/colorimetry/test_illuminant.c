// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/illuminant.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "colorimetry/colour.h"
#include "colorimetry/tables/tables.h"
#include "tests/fakes/near.h"

#define PUBLISHED_XY 1e-4   // CIE prints four decimals and sums at 5 nm
#define ORACLE_TABLE 4e-5   // both linear; the oracle holds the ends below 380 nm
#define ORACLE_SMOOTH 3e-4  // the oracle draws straight lines through the 5 nm values
#define ORACLE_LINEAR 1.5e-5 // A by formula, D linear here too
#define TABLE_DIGITS 1e-3   // daylight tables carry three or four decimals

static struct xy chromaticity(const struct spectrum *s)
{
    return xy_of(xyz_relative(s, NULL, OBSERVER_1931_2));
}

// CIE 015:2018.
static const struct {
    const char *name;
    double x, y;
} PUBLISHED[] = {
    {"A", 0.44758, 0.40745},    {"D50", 0.34567, 0.35851},  {"D55", 0.33243, 0.34744},
    {"D65", 0.31272, 0.32903},  {"D75", 0.29903, 0.31488},  {"FL1", 0.3131, 0.3371},
    {"FL2", 0.3721, 0.3751},    {"FL3", 0.4091, 0.3941},    {"FL4", 0.4402, 0.4031},
    {"FL5", 0.3138, 0.3452},    {"FL6", 0.3779, 0.3882},    {"FL7", 0.3129, 0.3292},
    {"FL8", 0.3458, 0.3586},    {"FL9", 0.3741, 0.3727},    {"FL10", 0.3458, 0.3588},
    {"FL11", 0.3805, 0.3769},   {"FL12", 0.4370, 0.4042},   {"LED-B1", 0.4560, 0.4078},
    {"LED-B2", 0.4357, 0.4012}, {"LED-B3", 0.3756, 0.3723}, {"LED-B4", 0.3422, 0.3502},
    {"LED-B5", 0.3118, 0.3236}, {"LED-BH1", 0.4474, 0.4066}, {"LED-RGB1", 0.4557, 0.4211},
    {"LED-V1", 0.4548, 0.4044}, {"LED-V2", 0.3781, 0.3775},
};

static void illuminants_have_their_published_chromaticities(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof PUBLISHED / sizeof *PUBLISHED; i++) {
        struct spectrum s;
        assert_true(illuminant(PUBLISHED[i].name, &s, NULL));
        struct xy c = chromaticity(&s);
        // FL12 undershoots between its lines; what is cut there moves it a little.
        double slack = strcmp(PUBLISHED[i].name, "FL12") ? PUBLISHED_XY : 1.5 * PUBLISHED_XY;
        assert_near(c.x, PUBLISHED[i].x, slack);
        assert_near(c.y, PUBLISHED[i].y, slack);
    }
}

// The values alone, on straight lines.
static struct xy chromaticity_of_table(const struct illuminant_table *t)
{
    struct spectrum s = {{0}};
    int start = t->first_nm - SPECTRUM_FIRST_NM;
    for (int i = 0; i <= TABLE_STEP_NM * ((int)t->count - 1); i++) {
        const double *v = t->values + i / TABLE_STEP_NM;
        double part = (double)(i % TABLE_STEP_NM) / TABLE_STEP_NM;
        s.v[start + i] = part > 0 ? v[0] + part * (v[1] - v[0]) : v[0];
    }
    return chromaticity(&s);
}

static const struct illuminant_table *table_named(const char *name)
{
    for (size_t i = 0; i < ILLUMINANT_TABLE_COUNT; i++)
        if (!strcmp(name, ILLUMINANT_TABLES[i].name))
            return &ILLUMINANT_TABLES[i];
    return NULL;
}

static void tables_agree_with_the_oracle(void **state)
{
    (void)state;
    FILE *in = fopen("tests/data/illuminants.txt", "r");
    char line[256], name[32];
    int seen = 0;
    assert_non_null(in);
    while (fgets(line, sizeof line, in)) {
        double x, y;
        struct spectrum s;
        if (sscanf(line, "%31s %lf %lf", name, &x, &y) != 3 || !illuminant(name, &s, NULL))
            continue;
        const struct illuminant_table *t = table_named(name);
        bool linear = !t || t->linear;
        struct xy smooth = chromaticity(&s), exact = t ? chromaticity_of_table(t) : smooth;
        assert_near(exact.x, x, ORACLE_TABLE);
        assert_near(exact.y, y, ORACLE_TABLE);
        assert_near(smooth.x, x, linear ? ORACLE_LINEAR : ORACLE_SMOOTH);
        assert_near(smooth.y, y, linear ? ORACLE_LINEAR : ORACLE_SMOOTH);
        seen++;
    }
    fclose(in);
    assert_int_equal(seen, 27);
}

static void every_listed_name_gives_light_without_negative_power(void **state)
{
    (void)state;
    int count = 0;
    for (const char *const *name = illuminant_names(); *name; name++, count++) {
        struct spectrum s;
        assert_true(illuminant(*name, &s, NULL));
        assert_true(spectrum_sum(&s) > 0);
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            assert_true(s.v[i] >= 0);
    }
    assert_int_equal(count, 28);
}

static void tables_are_met_at_every_published_wavelength(void **state)
{
    (void)state;
    for (size_t k = 0; k < ILLUMINANT_TABLE_COUNT; k++) {
        const struct illuminant_table *t = &ILLUMINANT_TABLES[k];
        struct spectrum s;
        assert_true(illuminant(t->name, &s, NULL));
        for (size_t i = 0; i < t->count; i++) {
            size_t at = (size_t)(t->first_nm - SPECTRUM_FIRST_NM) + TABLE_STEP_NM * i;
            assert_near(s.v[at], t->values[i], 0);
        }
    }
}

static void a_and_daylight_are_100_at_560_nm(void **state)
{
    (void)state;
    const char *const names[] = {"A", "D50", "D55", "D65", "D75", "D4321K", "D25000K"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct spectrum s;
        assert_true(illuminant(names[i], &s, NULL));
        assert_near(s.v[560 - 360], 100, 1e-9); // a formula, or a table's own 100
    }
}

// ISO/CIE 11664-2, table of A.
static void a_has_its_tabulated_powers(void **state)
{
    (void)state;
    struct spectrum s;
    assert_true(illuminant("A", &s, NULL));
    assert_near(s.v[380 - 360], 9.79510, 5e-6); // printed with six digits
    assert_near(s.v[500 - 360], 59.8611, 5e-5);
    assert_near(s.v[780 - 360], 241.675, 5e-4);
}

static void daylight_from_its_components_is_the_tabulated_one(void **state)
{
    (void)state;
    const struct {
        const char *name;
        double kelvin;
    } pairs[] = {{"D50", 5000}, {"D55", 5500}, {"D65", 6500}, {"D75", 7500}};
    for (size_t k = 0; k < 4; k++) {
        struct spectrum made, table;
        assert_true(daylight(pairs[k].kelvin, &made, NULL));
        assert_true(illuminant(pairs[k].name, &table, NULL));
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            assert_near(made.v[i], table.v[i], TABLE_DIGITS);
    }
}

static void daylight_has_the_temperature_it_is_named_by(void **state)
{
    (void)state;
    for (double kelvin = 4000; kelvin <= 25000; kelvin += 1500) {
        struct spectrum s;
        assert_true(daylight(kelvin, &s, NULL));
        struct cct cct = cct_of(chromaticity(&s));
        assert_near(cct.kelvin / kelvin, 1, 0.015); // CIE's own polynomial is no better at 25000 K
        assert_near(cct.duv, 0.003, 0.0015);        // daylight lies above the Planckian locus
    }
}

static void daylight_outside_its_range_is_refused(void **state)
{
    (void)state;
    struct spectrum s = {{7}};
    struct error err;
    const double bad[] = {3999, 25001, 0, -1, NAN, INFINITY};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_false(daylight(bad[i], &s, &err));
        assert_int_equal(err.code, ERROR_RANGE);
        assert_true(s.v[0] == 7);
    }
}

static void planck_is_1_at_560_nm_and_finite_when_cold_or_hot(void **state)
{
    (void)state;
    for (double kelvin = 100; kelvin <= 1e6; kelvin *= 10) {
        struct spectrum s;
        planck(kelvin, &s);
        assert_near(s.v[560 - 360], 1, 1e-12); // normalised there
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            assert_true(isfinite(s.v[i]) && s.v[i] >= 0);
    }
}

// Wien: the peak of 5000 K lies at 2.8978e-3 m K / 5000 K = 579.6 nm.
static void planck_peaks_where_wien_says(void **state)
{
    (void)state;
    struct spectrum s;
    planck(5000, &s);
    int peak = 0;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        if (s.v[i] > s.v[peak])
            peak = i;
    assert_near(SPECTRUM_FIRST_NM + peak, 579.6, 0.51); // the grid's half step
}

static void an_unknown_name_is_refused_with_the_list(void **state)
{
    (void)state;
    const char *const bad[] = {"", "D", "d65", "FL13", "FL3.16", "D65K", "DK", "P", "P0K", "PnanK",
                               "D1e4", "A ", "P2856", "E1"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spectrum s = {{7}};
        struct error err = {0};
        assert_false(illuminant(bad[i], &s, &err));
        assert_true(err.code == ERROR_CONFIG || err.code == ERROR_RANGE);
        assert_true(s.v[0] == 7);
        if (err.code == ERROR_CONFIG)
            assert_non_null(strstr(err.text, "FL3.15"));
    }
}

static void temperatures_in_names_are_read(void **state)
{
    (void)state;
    struct spectrum named, made;
    assert_true(illuminant("P2856K", &named, NULL));
    planck(2856, &made);
    assert_memory_equal(&named, &made, sizeof made);
    assert_true(illuminant("D5500.5K", &named, NULL));
    assert_true(daylight(5500.5, &made, NULL));
    assert_memory_equal(&named, &made, sizeof made);
    assert_false(illuminant("D0x1500K", &named, NULL)); // decimal only
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(illuminants_have_their_published_chromaticities),
        cmocka_unit_test(tables_agree_with_the_oracle),
        cmocka_unit_test(every_listed_name_gives_light_without_negative_power),
        cmocka_unit_test(tables_are_met_at_every_published_wavelength),
        cmocka_unit_test(a_and_daylight_are_100_at_560_nm),
        cmocka_unit_test(a_has_its_tabulated_powers),
        cmocka_unit_test(daylight_from_its_components_is_the_tabulated_one),
        cmocka_unit_test(daylight_has_the_temperature_it_is_named_by),
        cmocka_unit_test(daylight_outside_its_range_is_refused),
        cmocka_unit_test(planck_is_1_at_560_nm_and_finite_when_cold_or_hot),
        cmocka_unit_test(planck_peaks_where_wien_says),
        cmocka_unit_test(an_unknown_name_is_refused_with_the_list),
        cmocka_unit_test(temperatures_in_names_are_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
