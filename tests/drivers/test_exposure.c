// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/exposure.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static const struct exposure_limits usual = {50, 1000, 1000000, 1};
static const double black = 0.05; // of saturation

static int once(int us, double peak, double dark, int saturated, int longest_us)
{
    struct exposure e = {0};
    const struct exposure_limits limits = {50, 1000, longest_us, 1};
    return exposure_next(&e, &(struct exposure_seen){us, peak, dark, saturated}, &limits);
}

static void exposure_goes_to_85_percent_and_stays(void **state)
{
    (void)state;
    int us = once(2000, 0.4, 0, 0, 1000000);
    assert_int_equal(us, 4250);
    assert_int_equal(once(us, 0.85, 0, 0, 1000000), us);
    assert_int_equal(once(us, 0.80, 0, 0, 1000000), us);
}

static void exposure_steps_are_bounded(void **state)
{
    (void)state;
    assert_int_equal(once(1000, 0.01, 0.01, 0, 1000000), 8000);
    assert_int_equal(once(8000, 1, 0, 1, 1000000), 2000);
    assert_int_equal(once(160000, 1, 0, 1500, 1000000), 10000);
    assert_int_equal(once(1000, 1, 0, 2048, 1000000), 1000);
    assert_int_equal(once(500000, 0.1, 0, 0, 1000000), 1000000);
    assert_int_equal(once(500000, 0.85, 0, 0, 200000), 200000);
}

static void exposures_from_half_a_mains_period_on_are_its_multiples(void **state)
{
    (void)state;
    for (double peak = 0.02; peak < 1; peak += 0.007)
        for (int us = 1000; us < 600000; us = us * 3 / 2 / 10 * 10) {
            int next = once(us, peak, 0.02, 0, 1000000);
            assert_true(next >= 1000 && next <= 1000000);
            assert_true(next < 10000 || next % 10000 == 0 || next == us);
        }
    const struct exposure_limits american = {60, 1000, 1000000, 1};
    assert_int_equal(exposure_round(30000, &american), 25000);
    assert_int_equal(exposure_round(999999, &american), 992000);
}

static void an_instrument_of_whole_milliseconds_gets_whole_periods_too(void **state)
{
    (void)state;
    const struct exposure_limits qe = {60, 8000, 1000000, 1000};
    assert_int_equal(exposure_round(30000, &qe), 25000);
    assert_int_equal(exposure_round(999999, &qe), 975000);
    assert_int_equal(exposure_round(12345, &qe), 12000);
    assert_int_equal(exposure_round(1, &qe), 8000);
}

static void any_exposure_that_the_instrument_knows_can_be_held(void **state)
{
    (void)state;
    const struct exposure_limits qe = {60, 8000, 1000000, 1000};
    assert_int_equal(exposure_hold(12346, &usual), 12350);
    assert_int_equal(exposure_hold(700499, &usual), 700000);
    assert_int_equal(exposure_hold(5, &usual), 1000);
    assert_int_equal(exposure_hold(2e9, &usual), 1000000);
    assert_int_equal(exposure_hold(12346, &qe), 12000);
}

struct scene {
    struct exposure e;
    int us, changes;
};

// One reading of light at rate (saturation per us).
static bool look(struct scene *s, double rate)
{
    double peak = black + rate * s->us;
    const struct exposure_seen seen = {s->us, peak < 1 ? peak : 1, black,
                                       peak < 1   ? 0
                                       : peak < 2 ? 1
                                                  : 500};
    int next = exposure_next(&s->e, &seen, &usual);
    bool rests = next == s->us;
    s->changes += !rests;
    s->us = next;
    return rests;
}

static void exposure_settles_from_anywhere_without_swinging(void **state)
{
    (void)state;
    for (double rate = 2e-7; rate < 1e-3; rate *= 1.07) {
        struct scene s = {.us = 100000};
        while (!look(&s, rate) && s.changes < 20)
            ;
        double peak = black + rate * s.us;
        assert_true(s.changes < 8);
        assert_true(peak <= 0.92 || s.us == 1000);
        assert_true(peak >= 0.45 || s.us == 1000000);
    }
}

static void after_any_step_of_light_it_comes_to_rest_and_stays(void **state)
{
    (void)state;
    for (double from = 3e-7; from < 5e-2; from *= 1.9)
        for (double to = 3e-7; to < 5e-2; to *= 1.9) {
            struct scene s = {.us = 100000};
            for (int i = 0; i < 30; i++)
                look(&s, from);
            s.changes = 0;
            for (int i = 0; i < 30; i++)
                look(&s, to);
            assert_true(s.changes <= EXPOSURE_CHANGES_MOST);
            int so_far = s.changes;
            for (int i = 0; i < 100; i++)
                assert_true(look(&s, to));
            assert_int_equal(s.changes, so_far);
            assert_true(black + to * s.us < 1 || s.us == 1000);
            assert_true(black + to * s.us > 0.45 || s.us == 1000000);
        }
}

// Between readings the lamp jumps by up to 15 %, more than the band of rest.
static void unsteady_light_is_not_hunted(void **state)
{
    (void)state;
    uint32_t seed = 7;
    for (double rate = 1e-6; rate < 1e-4; rate *= 3) {
        struct scene s = {.us = 100000};
        for (int i = 0; i < 2000; i++) {
            seed = seed * 1664525u + 1013904223u;
            look(&s, rate * (1 + 0.15 * ((seed >> 8) / 8388608.0 - 1)));
        }
        assert_true(s.changes <= EXPOSURE_CHANGES_MOST + 3); // downwards it may, for saturation
        assert_true(black + 1.15 * rate * s.us < 1);
        assert_true(black + rate * s.us > 0.15);
    }
}

static void a_lamp_that_warms_up_is_followed(void **state)
{
    (void)state;
    struct scene s = {.us = 100000};
    for (double rate = 1e-6; rate < 2e-5; rate *= 1.002)
        look(&s, rate);
    double peak = black + 2e-5 * s.us;
    assert_true(peak > 0.7 && peak <= 0.93);
}

// Light between two allowed exposures, with 1 % of noise on its peak.
static void noise_does_not_make_the_exposure_hunt(void **state)
{
    (void)state;
    for (double rate = 1e-6; rate < 9e-5; rate *= 1.03) {
        struct scene s = {.us = 100000};
        for (int reading = 0; reading < 300; reading++) {
            look(&s, rate * (1 + 0.01 * sin(reading * 12.9898)));
            s.changes = reading < 10 ? 0 : s.changes;
        }
        assert_true(s.changes <= 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exposure_goes_to_85_percent_and_stays),
        cmocka_unit_test(exposure_steps_are_bounded),
        cmocka_unit_test(exposures_from_half_a_mains_period_on_are_its_multiples),
        cmocka_unit_test(an_instrument_of_whole_milliseconds_gets_whole_periods_too),
        cmocka_unit_test(any_exposure_that_the_instrument_knows_can_be_held),
        cmocka_unit_test(exposure_settles_from_anywhere_without_swinging),
        cmocka_unit_test(after_any_step_of_light_it_comes_to_rest_and_stays),
        cmocka_unit_test(unsteady_light_is_not_hunted),
        cmocka_unit_test(noise_does_not_make_the_exposure_hunt),
        cmocka_unit_test(a_lamp_that_warms_up_is_followed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
