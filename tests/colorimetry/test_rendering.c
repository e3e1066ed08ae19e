// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/rendering.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>
#undef fail

#include "colorimetry/illuminant.h"
#include "colorimetry/tables/tables.h"
#include "tests/fakes/near.h"

#define ORACLE_RA 0.02    // the oracle leaves M1 and M2 unrounded
#define ORACLE_SMOOTH 0.1 // the oracle draws straight lines through 5 nm values
#define ORACLE_NARROW 0.3 // the same of a lamp whose lines are narrower than its table's steps
#define PUBLISHED_RA 0.7  // CIE 015 prints whole numbers, summed at 5 nm
#define ROUNDING 1e-9
#define M1_ROUNDED 0.02 // the daylight series is published with M1, M2 of three decimals
#define SODIUM_RA 4     // a real lamp has two lines and a little infrared and gas besides

static void straight(const struct illuminant_table *t, struct spectrum *s)
{
    memset(s, 0, sizeof *s);
    for (int i = 0; i <= TABLE_STEP_NM * ((int)t->count - 1); i++) {
        const double *v = t->values + i / TABLE_STEP_NM;
        double part = (double)(i % TABLE_STEP_NM) / TABLE_STEP_NM;
        s->v[t->first_nm - SPECTRUM_FIRST_NM + i] = part > 0 ? v[0] + part * (v[1] - v[0]) : v[0];
    }
}

static const struct illuminant_table *table_named(const char *name)
{
    for (size_t i = 0; i < ILLUMINANT_TABLE_COUNT; i++)
        if (!strcmp(name, ILLUMINANT_TABLES[i].name))
            return &ILLUMINANT_TABLES[i];
    return NULL;
}

static double ra_of(const struct spectrum *s)
{
    struct rendering r;
    struct error err = {0};
    if (!rendering_of(s, &r, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    return r.general;
}

static bool narrow(const char *name)
{
    return !strcmp(name, "FL3") || !strcmp(name, "FL4") || !strcmp(name, "LED-RGB1");
}

static void ra_agrees_with_the_oracle_for_27_illuminants(void **state)
{
    (void)state;
    FILE *in = fopen("tests/data/illuminants.txt", "r");
    char line[256], name[32];
    int seen = 0;
    assert_non_null(in);
    while (fgets(line, sizeof line, in)) {
        double ra;
        struct spectrum smooth, lines;
        if (sscanf(line, "%31s %*f %*f %*f %*f %lf", name, &ra) != 2 ||
            !illuminant(name, &smooth, NULL))
            continue;
        const struct illuminant_table *t = table_named(name);
        lines = smooth;
        if (t)
            straight(t, &lines);
        assert_near(ra_of(&lines), ra, ORACLE_RA);
        assert_near(ra_of(&smooth), ra, narrow(name) ? ORACLE_NARROW : ORACLE_SMOOTH);
        seen++;
    }
    fclose(in);
    assert_int_equal(seen, 27);
}

// CIE 015:2018, table T.6.
static void fluorescent_lamps_have_their_published_ra(void **state)
{
    (void)state;
    static const double published[] = {76, 64, 57, 51, 72, 59, 90, 95, 90, 81, 83, 83};
    for (int i = 0; i < 12; i++) {
        char name[8];
        struct spectrum s;
        snprintf(name, sizeof name, "FL%d", i + 1);
        assert_true(illuminant(name, &s, NULL));
        assert_near(ra_of(&s), published[i], PUBLISHED_RA);
    }
}

// Low-pressure sodium: a single line, whose published Ra is about -44.
static void a_single_yellow_line_renders_colours_worse_than_not_at_all(void **state)
{
    (void)state;
    struct spectrum s = {{0}};
    s.v[589 - SPECTRUM_FIRST_NM] = 1;
    assert_near(ra_of(&s), -44, SODIUM_RA);
}

static void a_lamp_that_is_its_own_reference_gets_100_throughout(void **state)
{
    (void)state;
    struct rendering r;
    struct spectrum s;
    for (double kelvin = 2000; kelvin < 5000; kelvin += 370) {
        planck(kelvin, &s);
        assert_true(rendering_of(&s, &r, NULL));
        assert_false(r.daylight);
        for (int i = 0; i < TEST_COLOURS; i++)
            assert_near(r.special[i], 100, 1e-4); // CCT is found within a hundredth of a kelvin
    }
    for (double kelvin = 5100; kelvin < 20000; kelvin += 1790) {
        assert_true(daylight(kelvin, &s, NULL));
        assert_true(rendering_of(&s, &r, NULL));
        assert_true(r.daylight);
        assert_near(r.kelvin / (kelvin * DAYLIGHT_SCALE), 1, 1e-3);
        assert_near(r.general, 100, M1_ROUNDED);
    }
}

static void ra_does_not_depend_on_the_level(void **state)
{
    (void)state;
    struct spectrum s;
    assert_true(illuminant("FL11", &s, NULL));
    double before = ra_of(&s);
    spectrum_scale(&s, 1e-4);
    assert_near(ra_of(&s), before, ROUNDING);
}

static void ra_is_the_mean_of_the_first_eight(void **state)
{
    (void)state;
    struct spectrum s;
    struct rendering r;
    double sum = 0;
    assert_true(illuminant("LED-B4", &s, NULL));
    assert_true(rendering_of(&s, &r, NULL));
    for (int i = 0; i < TEST_COLOURS_OF_RA; i++)
        sum += r.special[i];
    assert_near(r.general, sum / 8, ROUNDING);
}

static void darkness_and_far_colours_are_refused(void **state)
{
    (void)state;
    struct spectrum s = {{0}};
    struct rendering r;
    struct error err = {0};
    assert_false(rendering_of(&s, &r, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    s.v[520 - SPECTRUM_FIRST_NM] = 1;
    assert_false(rendering_of(&s, &r, &err));
    assert_int_equal(err.code, ERROR_RANGE);
}

// ---- metamerism ----------------------------------------------------------------

static void two_lamps(struct spectrum *a, struct spectrum *d65)
{
    assert_true(illuminant("A", a, NULL));
    assert_true(illuminant("D65", d65, NULL));
}

static void alike_samples_are_no_metamers(void **state)
{
    (void)state;
    struct spectrum a, d65, sample, darker;
    struct metamerism m;
    two_lamps(&a, &d65);
    for (int i = 0; i < TEST_COLOURS; i++) {
        test_colour(i, &sample);
        assert_true(metamerism_of(&sample, &sample, &d65, &a, OBSERVER_1931_2, &m, NULL));
        assert_near(m.match_ab, 0, ROUNDING);
        assert_near(m.index_ab, 0, ROUNDING);
        darker = sample;
        spectrum_scale(&darker, 0.9);
        assert_true(metamerism_of(&sample, &darker, &d65, &a, OBSERVER_1931_2, &m, NULL));
        assert_true(m.match_ab > 1);
        assert_near(m.index_ab, 0, ROUNDING); // a scaled sample is corrected away
        assert_near(m.index_2000, 0, ROUNDING);
    }
}

// Adds to a grey the part of a ripple that the observer does not see under D65.
static void metameric_pair(const struct spectrum *d65, struct spectrum *grey, struct spectrum *b)
{
    const struct spectrum *cmf = observer_cmf(OBSERVER_1931_2);
    struct spectrum hump[4];
    struct mat3 seen, inverse;
    struct vec3 ripple = {0};
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < SPECTRUM_COUNT; i++) {
            double u = (SPECTRUM_FIRST_NM + i - (450 + 50.0 * k)) / 20;
            hump[k].v[i] = exp(-u * u);
        }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 4; k++) {
            double sum = 0;
            for (int i = 0; i < SPECTRUM_COUNT; i++)
                sum += cmf[c].v[i] * d65->v[i] * hump[k].v[i];
            if (k < 3)
                seen.m[c][k] = sum;
            else
                *(c == 0 ? &ripple.x : c == 1 ? &ripple.y : &ripple.z) = sum;
        }
    assert_true(mat3_invert(seen, &inverse));
    struct vec3 k = mat3_apply(inverse, ripple);
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        grey->v[i] = 0.4;
        b->v[i] = 0.4 + 0.15 * (hump[3].v[i] - k.x * hump[0].v[i] - k.y * hump[1].v[i] -
                                k.z * hump[2].v[i]);
    }
}

static void a_metameric_pair_matches_under_one_lamp_only(void **state)
{
    (void)state;
    struct spectrum a, d65, grey, other;
    struct metamerism m;
    two_lamps(&a, &d65);
    metameric_pair(&d65, &grey, &other);
    assert_true(metamerism_of(&grey, &other, &d65, &a, OBSERVER_1931_2, &m, NULL));
    assert_near(m.match_ab, 0, ROUNDING);
    assert_true(m.index_ab > 1);
    assert_true(m.index_2000 > 1);
    double index = m.index_ab;
    spectrum_scale(&other, 0.97); // what scaling the pair adds is corrected away
    assert_true(metamerism_of(&grey, &other, &d65, &a, OBSERVER_1931_2, &m, NULL));
    assert_near(m.index_ab, index, ROUNDING);
    assert_true(metamerism_of(&grey, &other, &d65, &d65, OBSERVER_1931_2, &m, NULL));
    assert_near(m.index_ab, 0, ROUNDING);
}

static void black_samples_and_dark_lamps_have_no_index(void **state)
{
    (void)state;
    struct spectrum a, d65, dark = {{0}}, sample;
    struct metamerism m;
    struct error err = {0};
    two_lamps(&a, &d65);
    test_colour(0, &sample);
    assert_false(metamerism_of(&sample, &dark, &d65, &a, OBSERVER_1931_2, &m, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_false(metamerism_of(&sample, &sample, &d65, &dark, OBSERVER_1931_2, &m, &err));
    assert_int_equal(err.code, ERROR_RANGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ra_agrees_with_the_oracle_for_27_illuminants),
        cmocka_unit_test(fluorescent_lamps_have_their_published_ra),
        cmocka_unit_test(a_single_yellow_line_renders_colours_worse_than_not_at_all),
        cmocka_unit_test(a_lamp_that_is_its_own_reference_gets_100_throughout),
        cmocka_unit_test(ra_does_not_depend_on_the_level),
        cmocka_unit_test(ra_is_the_mean_of_the_first_eight),
        cmocka_unit_test(darkness_and_far_colours_are_refused),
        cmocka_unit_test(alike_samples_are_no_metamers),
        cmocka_unit_test(a_metameric_pair_matches_under_one_lamp_only),
        cmocka_unit_test(black_samples_and_dark_lamps_have_no_index),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
