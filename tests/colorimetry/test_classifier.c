// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/classifier.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "tests/fakes/near.h"

#define NOISE 0.01       // of each nanometre's power
#define SHIFT_NM 0.5     // a spectrometer warming up
#define DIMMED_K 50.0    // a lamp dimmed a little
#define MIXED 0.15       // share of another lamp, in lux
#define TAUGHT_LUX 1500  // about what the booth gives
#define LIMIT 0.01       // the classifier's own
#define SAME_MOST 0.006  // measured 0.0047 (tri-band tubes)
#define MIXED_LEAST 0.02 // measured 0.023 (FL3.15 with FL8)

enum { LAMP_A, LAMP_FL8, LAMP_FL315, LAMPS };

static const char *const NAMES[LAMPS] = {"A", "FL8", "FL3.15"};
static const double KELVIN[LAMPS] = {2856, 5000, 6500};

static uint64_t chance_state;

static double chance(void)
{
    chance_state = chance_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(chance_state >> 11) / (double)(UINT64_C(1) << 53);
}

// About normal, standard deviation 1.
static double noise(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += chance();
    return sum;
}

static void to_lux(struct spectrum *s, double lux)
{
    spectrum_scale(s, lux / xyz_absolute(s, OBSERVER_1931_2).Y);
}

static struct spectrum lamp(const char *name)
{
    struct spectrum s;
    assert_true(illuminant(name, &s, NULL));
    to_lux(&s, TAUGHT_LUX);
    return s;
}

static struct spectrum mixture(const struct spectrum *a, const struct spectrum *b, double share)
{
    struct spectrum s;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        s.v[i] = (1 - share) * a->v[i] + share * b->v[i];
    return s;
}

// A reading of a lamp: lines moved, hotter or colder, noisy.
static struct spectrum reading(const struct spectrum *s, double shift_nm, double kelvin,
                               double hotter, double noisy)
{
    struct spectrum out, cold, hot;
    planck(kelvin, &cold);
    planck(kelvin + hotter, &hot);
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double at = fmin(fmax(i - shift_nm, 0), SPECTRUM_COUNT - 1.001), part = at - floor(at);
        double v = s->v[(int)at] * (1 - part) + s->v[(int)at + 1] * part;
        out.v[i] = v * hot.v[i] / cold.v[i] * (1 + noisy * noise());
    }
    return out;
}

static struct classifier taught(void)
{
    struct classifier c = {.count = LAMPS};
    for (int i = 0; i < LAMPS; i++) {
        snprintf(c.lamps[i].name, sizeof c.lamps[i].name, "%s", NAMES[i]);
        c.lamps[i].irradiance = lamp(NAMES[i]);
    }
    classifier_reset(&c);
    chance_state = 1;
    return c;
}

static struct lamp_belief after(struct classifier *c, const struct spectrum *s, int readings)
{
    struct lamp_belief b = {0};
    for (int i = 0; i < readings; i++)
        b = classifier_update(c, s);
    return b;
}

static void each_taught_lamp_is_recognised(void **state)
{
    (void)state;
    for (int i = 0; i < LAMPS; i++) {
        struct classifier c = taught();
        struct lamp_belief b = after(&c, &c.lamps[i].irradiance, 2);
        assert_int_equal(b.verdict, LAMP_KNOWN);
        assert_int_equal(b.index, i);
        assert_near(b.level, 1, 1e-12); // the very same spectrum
        assert_near(b.distance, 0, 1e-7);
        assert_near(b.confidence, 1, 1e-4);
    }
}

static void level_does_not_matter_and_is_reported(void **state)
{
    (void)state;
    for (int i = 0; i < LAMPS; i++) {
        struct classifier c = taught();
        for (double level = 1.2; level > 0.01; level *= 0.7) {
            struct spectrum s = lamp(NAMES[i]);
            spectrum_scale(&s, level);
            struct lamp_belief b = after(&c, &s, 2);
            assert_int_equal(b.verdict, LAMP_KNOWN);
            assert_int_equal(b.index, i);
            assert_near(b.level, level, 1e-12);
        }
    }
}

static void a_lamp_stays_itself_with_noise_shift_and_dimming(void **state)
{
    (void)state;
    for (int i = 0; i < LAMPS; i++) {
        struct classifier c = taught();
        for (int k = 0; k < 60; k++) {
            double side = k % 2 ? 1 : -1, hotter = DIMMED_K * (k % 3 - 1);
            struct spectrum s = reading(&c.lamps[i].irradiance, side * SHIFT_NM, KELVIN[i], hotter,
                                        NOISE);
            assert_true(lamp_distance(&c.lamps[i].irradiance, &s) < SAME_MOST);
            struct lamp_belief b = after(&c, &s, 2);
            assert_int_equal(b.verdict, LAMP_KNOWN);
            assert_int_equal(b.index, i);
            assert_true(b.confidence > 0.5);
        }
    }
}

static void another_lamp_or_daylight_mixed_in_is_unknown(void **state)
{
    (void)state;
    const char *const others[] = {"A", "FL8", "FL3.15", "D50", "D65", "D8000K", "FL11", "LED-B3"};
    for (int i = 0; i < LAMPS; i++) {
        for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
            if (!strcmp(NAMES[i], others[k]))
                continue;
            struct classifier c = taught();
            after(&c, &c.lamps[i].irradiance, 2);
            struct spectrum other = lamp(others[k]);
            struct spectrum s = mixture(&c.lamps[i].irradiance, &other, MIXED);
            assert_true(lamp_distance(&c.lamps[i].irradiance, &s) > MIXED_LEAST);
            struct lamp_belief b = after(&c, &s, 2);
            assert_int_equal(b.verdict, LAMP_UNKNOWN);
            assert_int_equal(b.index, -1);
            assert_true(b.level == 0 && b.confidence >= 0.5);
        }
    }
}

static void two_lamps_at_once_are_unknown(void **state)
{
    (void)state;
    for (int i = 0; i < LAMPS; i++) {
        for (int k = 0; k < i; k++) {
            struct classifier c = taught();
            struct spectrum s = mixture(&c.lamps[i].irradiance, &c.lamps[k].irradiance, 0.5);
            assert_int_equal(after(&c, &s, 2).verdict, LAMP_UNKNOWN);
        }
    }
}

static void an_untaught_lamp_is_unknown(void **state)
{
    (void)state;
    for (const char *const *name = illuminant_names(); *name; name++) {
        struct classifier c = taught();
        struct spectrum s = lamp(*name);
        bool known = !strcmp(*name, "A") || !strcmp(*name, "FL8") || !strcmp(*name, "FL3.15");
        assert_int_equal(after(&c, &s, 2).verdict, known ? LAMP_KNOWN : LAMP_UNKNOWN);
    }
}

static void darkness_is_no_lamp(void **state)
{
    (void)state;
    struct classifier c = taught();
    struct spectrum dark = {{0}};
    after(&c, &c.lamps[LAMP_FL8].irradiance, 2);
    struct lamp_belief b = after(&c, &dark, 2);
    assert_int_equal(b.verdict, LAMP_NONE);
    assert_int_equal(b.index, -1);
    assert_near(b.confidence, 1, 0); // nothing at all is the surest darkness
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        dark.v[i] = 1e-6 * noise(); // negative sums as well
    assert_int_equal(after(&c, &dark, 3).verdict, LAMP_NONE);
    assert_true(isfinite(after(&c, &dark, 1).distance));
}

static void a_spectrum_that_is_no_number_is_unknown(void **state)
{
    (void)state;
    struct classifier c = taught();
    struct spectrum s = lamp("A");
    s.v[200] = NAN;
    struct lamp_belief b = after(&c, &s, 2);
    assert_int_equal(b.verdict, LAMP_UNKNOWN);
    assert_true(isfinite(b.distance) && b.distance == 1);
}

static void one_odd_reading_changes_nothing(void **state)
{
    (void)state;
    struct classifier c = taught();
    struct spectrum dark = {{0}};
    after(&c, &c.lamps[LAMP_A].irradiance, 2);
    assert_int_equal(after(&c, &dark, 1).verdict, LAMP_KNOWN);
    assert_int_equal(after(&c, &c.lamps[LAMP_FL8].irradiance, 1).index, LAMP_A);
    assert_int_equal(after(&c, &c.lamps[LAMP_FL315].irradiance, 1).index, LAMP_A);
    struct lamp_belief b = after(&c, &c.lamps[LAMP_A].irradiance, 1);
    assert_int_equal(b.index, LAMP_A);
    assert_int_equal(c.candidate_count, 0);
}

static void an_odd_reading_lowers_the_confidence(void **state)
{
    (void)state;
    struct classifier c = taught();
    after(&c, &c.lamps[LAMP_A].irradiance, 2);
    struct lamp_belief b = after(&c, &c.lamps[LAMP_FL8].irradiance, 1);
    assert_int_equal(b.index, LAMP_A);
    assert_true(b.confidence < 0.5);
}

static void the_number_of_confirmations_is_kept(void **state)
{
    (void)state;
    for (int wanted = 1; wanted <= 5; wanted++) {
        struct classifier c = taught();
        c.confirmations = wanted;
        int readings = 0;
        while (classifier_update(&c, &c.lamps[LAMP_A].irradiance).verdict != LAMP_KNOWN)
            readings++;
        assert_int_equal(readings + 1, wanted);
    }
}

static int switches(struct classifier *c, const struct spectrum *from, const struct spectrum *to,
                    int steps, double noisy)
{
    int changes = 0;
    enum lamp_verdict verdict = c->verdict;
    int index = c->index;
    for (int k = 0; k <= steps; k++) {
        struct spectrum s = mixture(from, to, (double)k / steps);
        s = reading(&s, 0, 5000, 0, noisy);
        struct lamp_belief b = classifier_update(c, &s);
        changes += b.verdict != verdict || b.index != index;
        verdict = b.verdict;
        index = b.index;
    }
    return changes;
}

static void noise_at_a_limit_does_not_flicker(void **state)
{
    (void)state;
    struct classifier c = taught();
    struct spectrum daylight = lamp("D65");
    const struct spectrum *fl8 = &c.lamps[LAMP_FL8].irradiance;
    after(&c, fl8, 2);
    // a share of daylight that stands on the limit itself
    double low = 0, high = MIXED;
    for (int k = 0; k < 40; k++) {
        struct spectrum s = mixture(fl8, &daylight, (low + high) / 2);
        *(lamp_distance(fl8, &s) < LIMIT ? &low : &high) = (low + high) / 2;
    }
    struct spectrum edge = mixture(fl8, &daylight, low);
    assert_true(switches(&c, &edge, &edge, 500, NOISE) <= 1);
}

static void a_slow_change_of_lamp_switches_once_to_unknown_and_once_to_the_other(void **state)
{
    (void)state;
    for (int i = 0; i < LAMPS; i++) {
        for (int k = 0; k < LAMPS; k++) {
            struct classifier c = taught();
            const struct spectrum *from = &c.lamps[i].irradiance, *to = &c.lamps[k].irradiance;
            after(&c, from, 2);
            assert_int_equal(switches(&c, from, to, 400, NOISE), i == k ? 0 : 2);
            after(&c, to, 2);
            assert_int_equal(c.index, k);
        }
    }
}

static void a_lamp_fading_out_goes_from_known_to_none(void **state)
{
    (void)state;
    struct classifier c = taught();
    struct spectrum dark = {{0}};
    after(&c, &c.lamps[LAMP_A].irradiance, 2);
    assert_int_equal(switches(&c, &c.lamps[LAMP_A].irradiance, &dark, 5000, NOISE), 1);
    assert_int_equal(c.verdict, LAMP_NONE);
}

static void a_noisily_taught_lamp_is_given_more_room(void **state)
{
    (void)state;
    struct classifier c = taught();
    struct spectrum s = reading(&c.lamps[LAMP_A].irradiance, 0, 2856, 0, 0.10);
    assert_int_equal(after(&c, &s, 2).verdict, LAMP_UNKNOWN);
    c.lamps[LAMP_A].spread = 0.10;
    assert_int_equal(after(&c, &s, 2).verdict, LAMP_KNOWN);
}

static void without_taught_lamps_light_is_unknown(void **state)
{
    (void)state;
    struct classifier c = {0};
    classifier_reset(&c);
    struct spectrum s = lamp("A");
    struct lamp_belief b = after(&c, &s, 2);
    assert_int_equal(b.verdict, LAMP_UNKNOWN);
    assert_near(b.confidence, 1, 0);
}

static void distance_is_between_0_and_1_and_independent_of_scale(void **state)
{
    (void)state;
    struct spectrum dark = {{0}}, line = {{0}};
    line.v[100] = 1;
    for (const char *const *a = illuminant_names(); *a; a++) {
        struct spectrum s = lamp(*a), dim = s;
        assert_near(lamp_distance(&s, &s), 0, 1e-7);
        assert_true(lamp_distance(&s, &dark) == 1 && lamp_distance(&dark, &s) == 1);
        assert_true(lamp_distance(&s, &line) <= 1 && lamp_distance(&line, &s) <= 1);
        spectrum_scale(&dim, 1e-9);
        struct spectrum other = lamp("FL11");
        assert_near(lamp_distance(&other, &s), lamp_distance(&other, &dim), 1e-9);
    }
}

// ---- measured lamps ----------------------------------------------------------

// "nm,E" lines onto the grid; false when the file is not there.
static bool measured(const char *name, struct spectrum *out)
{
    static double nm[2000], values[2000];
    char path[256], line[256];
    size_t count = 0;
    snprintf(path, sizeof path, "../shared/data/lamps/%s.csv", name);
    FILE *in = fopen(path, "r");
    if (!in)
        return false;
    while (fgets(line, sizeof line, in) && count < 2000)
        count += sscanf(line, "%lf,%lf", &nm[count], &values[count]) == 2;
    fclose(in);
    assert_true(spectrum_from_samples(nm, values, count, false, out, NULL));
    to_lux(out, TAUGHT_LUX);
    return true;
}

static void real_tubes_halogen_and_led_are_told_apart(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double kelvin;
    } real[] = {
        {"Philips.FT.TLL.36W.950", 5000},
        {"Philips.FT.TLD.36W.965", 6500},
        {"Philips.Inc.50W.spot.halogen", 2900},
        {"Philips.LED.T8.10W.4000K", 4000},
    };
    struct classifier c = {.count = 4};
    for (int i = 0; i < 4; i++) {
        if (!measured(real[i].name, &c.lamps[i].irradiance)) {
            print_message("skipped: no measured lamps beside the tree\n");
            skip();
        }
    }
    struct spectrum daylight = lamp("D65");
    for (int i = 0; i < 4; i++) {
        classifier_reset(&c);
        chance_state = 1;
        const struct spectrum *me = &c.lamps[i].irradiance;
        for (int k = 0; k < 40; k++) {
            struct spectrum s = reading(me, k % 2 ? SHIFT_NM : -SHIFT_NM, real[i].kelvin,
                                        DIMMED_K * (k % 3 - 1), NOISE);
            assert_true(lamp_distance(me, &s) < SAME_MOST);
            assert_int_equal(after(&c, &s, 2).index, i);
        }
        for (int k = 0; k < 5; k++) {
            const struct spectrum *other = k < 4 ? &c.lamps[k].irradiance : &daylight;
            if (k == i)
                continue;
            struct spectrum s = mixture(me, other, MIXED);
            assert_true(lamp_distance(me, &s) > MIXED_LEAST);
            assert_int_equal(after(&c, &s, 2).verdict, LAMP_UNKNOWN);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_taught_lamp_is_recognised),
        cmocka_unit_test(level_does_not_matter_and_is_reported),
        cmocka_unit_test(a_lamp_stays_itself_with_noise_shift_and_dimming),
        cmocka_unit_test(another_lamp_or_daylight_mixed_in_is_unknown),
        cmocka_unit_test(two_lamps_at_once_are_unknown),
        cmocka_unit_test(an_untaught_lamp_is_unknown),
        cmocka_unit_test(darkness_is_no_lamp),
        cmocka_unit_test(a_spectrum_that_is_no_number_is_unknown),
        cmocka_unit_test(one_odd_reading_changes_nothing),
        cmocka_unit_test(an_odd_reading_lowers_the_confidence),
        cmocka_unit_test(the_number_of_confirmations_is_kept),
        cmocka_unit_test(noise_at_a_limit_does_not_flicker),
        cmocka_unit_test(a_slow_change_of_lamp_switches_once_to_unknown_and_once_to_the_other),
        cmocka_unit_test(a_lamp_fading_out_goes_from_known_to_none),
        cmocka_unit_test(a_noisily_taught_lamp_is_given_more_room),
        cmocka_unit_test(without_taught_lamps_light_is_unknown),
        cmocka_unit_test(distance_is_between_0_and_1_and_independent_of_scale),
        cmocka_unit_test(real_tubes_halogen_and_led_are_told_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
