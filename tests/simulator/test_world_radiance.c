// SPDX-License-Identifier: Apache-2.0
// What the control socket tells of the light that the radiometer is aimed at.
#include "simulator/world_control.h"

#include "colorimetry/colour.h"
#include "tests/simulator/cmocka_here.h"

#define EXACT 1e-12 // relative: through the digits of JSON

static void a_request_for_radiance_tells_what_the_radiometer_senses(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    struct spectrum light;
    small_booth(&s);
    struct world *world = world_create(&s, 0, &err);
    assert_non_null(world);
    json_t *request = json_pack("{s: s, s: f, s: f}", "target", "ceiling", "x_m", 0.1, "z_m", 0.02);
    json_decref(world_answer(world, 0, CONTROL_AIM, request, &err));
    json_decref(request);
    json_t *answer = world_answer(world, 0, CONTROL_RADIANCE, NULL, &err);
    const json_t *values = json_object_get(json_object_get(answer, "radiance"), "values");
    struct around around = world_around(world);
    around.radiance(around.context, 0, &light);
    assert_int_equal(json_array_size(values), SPECTRUM_COUNT);
    assert_true(xyz_absolute(&light, OBSERVER_1931_2).Y > 1);
    for (size_t i = 0; i < SPECTRUM_COUNT; i++)
        assert_near(json_number_value(json_array_get(values, i)), light.v[i], EXACT * light.v[i]);
    json_decref(answer);
    world_destroy(world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_request_for_radiance_tells_what_the_radiometer_senses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
