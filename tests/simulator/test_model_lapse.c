// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "simulator/model_lapse.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/fakes/near.h"

#define ROUNDING 1e-12

static struct lapse lapse_of(enum lapse_kind kind)
{
    struct lapse lapse = {.rates = {.drift = 0.02, .misread_every = 2}};
    lapse_set(&lapse, kind);
    return lapse;
}

static void without_a_lapse_every_reading_is_as_it_is(void **state)
{
    (void)state;
    struct lapse lapse = lapse_of(LAPSE_NONE);
    for (int i = 0; i < 10; i++) {
        double factor;
        assert_true(lapse_next(&lapse, &factor));
        assert_near(factor, 1, 0);
    }
}

static void drift_grows_by_its_rate_and_begins_anew(void **state)
{
    (void)state;
    struct lapse lapse = lapse_of(LAPSE_DRIFT);
    double factor, before = 1;
    for (int i = 0; i < 10; i++, before = factor) {
        lapse_set(&lapse, LAPSE_DRIFT); // again: goes on
        assert_true(lapse_next(&lapse, &factor));
        assert_near(factor / before, 1.02, ROUNDING);
    }
    lapse_set(&lapse, LAPSE_NONE);
    lapse_set(&lapse, LAPSE_DRIFT);
    lapse_next(&lapse, &factor);
    assert_near(factor, 1.02, ROUNDING);
}

static void misreadings_take_turns(void **state)
{
    (void)state;
    struct lapse lapse = lapse_of(LAPSE_MISREAD);
    const double expected[] = {1.1, 1, 0, 1, 1000, 1, 1.1, 1, 0}; // 0 = an error
    for (int i = 0; i < 9; i++) {
        double factor;
        bool read = lapse_next(&lapse, &factor);
        assert_int_equal(read, expected[i] > 0);
        if (read)
            assert_near(factor, expected[i], 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_a_lapse_every_reading_is_as_it_is),
        cmocka_unit_test(drift_grows_by_its_rate_and_begins_anew),
        cmocka_unit_test(misreadings_take_turns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
