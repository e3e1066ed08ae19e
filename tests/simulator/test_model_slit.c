// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "simulator/model_slit.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/fakes/near.h"

#define ROUNDING 1e-12

static struct spectrum light;

static void even_light_stays_as_it_is(void **state)
{
    (void)state;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        light.v[i] = 0.25;
    assert_near(slit_mean(&light, 550, 8), 0.25, ROUNDING);
    assert_near(slit_mean(&light, 550.3, 3.4), 0.25, ROUNDING);
}

// The area of the triangle of height 1/8 and base 16 nm is 1.
static void a_line_shows_as_a_triangle(void **state)
{
    (void)state;
    memset(&light, 0, sizeof light);
    light.v[550 - SPECTRUM_FIRST_NM] = 1;
    double sum = 0;
    for (int nm = 530; nm <= 570; nm++)
        sum += slit_mean(&light, nm, 8);
    assert_near(sum, 1, ROUNDING);
    assert_near(slit_mean(&light, 550, 8), 1 / 8.0, ROUNDING);
    assert_near(slit_mean(&light, 554, 8), 1 / 16.0, ROUNDING);
    assert_near(slit_mean(&light, 558, 8), 0, ROUNDING);
}

static void beyond_the_grid_it_is_dark(void **state)
{
    (void)state;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        light.v[i] = 1;
    assert_near(slit_mean(&light, SPECTRUM_FIRST_NM - 20, 8), 0, 0);
    double half = slit_mean(&light, SPECTRUM_FIRST_NM, 8); // the centre itself is inside
    assert_true(half > 0.5 && half < 0.6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_light_stays_as_it_is),
        cmocka_unit_test(a_line_shows_as_a_triangle),
        cmocka_unit_test(beyond_the_grid_it_is_dark),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
