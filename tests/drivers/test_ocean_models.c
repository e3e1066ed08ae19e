// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/ocean_counts.h"
#include "drivers/udev.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static void every_model_is_in_the_id_table_and_no_other(void **state)
{
    (void)state;
    int ids = 0, models = 0;
    for (const struct device_id *id = ocean_ids; id->name; id++, ids++) {
        const struct ocean_model *m = ocean_model(id->product);
        assert_non_null(m);
        assert_int_equal(id->vendor, OCEAN_VENDOR);
        assert_non_null(strstr(id->name, m->name));
    }
    while (ocean_models[models].name)
        models++;
    assert_int_equal(ids, models);
    assert_null(ocean_model(0x1234));
}

static void the_table_says_what_comes_over_the_wire(void **state)
{
    (void)state;
    const struct {
        unsigned product;
        size_t bytes;
        unsigned flip;
        int split, base_us;
        double full_counts;
    } wire[] = {
        {0x101e, 4097, 0, 0, 1, 65535},      {0x1022, 7681, 0, 2048, 1, 65535},
        {0x1016, 4097, 0x2000, 0, 1, 16383}, {0x1012, 7681, 0x2000, 2048, 1, 16383},
        {0x102a, 4609, 0, 0, 1, 64000},      {0x1018, 2561, 0x8000, 0, 1000, 65535},
    };
    for (size_t i = 0; i < sizeof wire / sizeof *wire; i++) {
        const struct ocean_model *m = ocean_model(wire[i].product);
        assert_non_null(m);
        assert_int_equal(ocean_bytes(m), wire[i].bytes);
        assert_int_equal(m->flip, wire[i].flip);
        assert_int_equal(m->split_bytes, wire[i].split);
        assert_int_equal(m->base_us, wire[i].base_us);
        assert_near(m->full_counts, wire[i].full_counts, 0);
    }
}

static bool within(struct pixel_range r, int pixel)
{
    return pixel >= r.first && pixel <= r.last;
}

static void black_pixels_see_no_light_and_all_lie_on_the_detector(void **state)
{
    (void)state;
    for (const struct ocean_model *m = ocean_models; m->name; m++) {
        int black = 0;
        assert_true(m->pixels <= m->raw_pixels && m->raw_pixels <= OCEAN_PIXELS_MOST);
        assert_true(m->active.first >= 0 && m->active.last < m->pixels);
        assert_true(m->least_us < m->most_us && m->least_us >= m->base_us);
        for (int i = 0; i < m->pixels; i++) {
            bool is_black = within(m->black[0], i) || within(m->black[1], i);
            black += is_black;
            assert_false(is_black && within(m->active, i));
        }
        assert_true(black >= 8);
    }
}

static void each_model_unpacks_its_own_bytes_and_refuses_all_others(void **state)
{
    (void)state;
    for (const struct ocean_model *m = ocean_models; m->name; m++) {
        const size_t count = ocean_bytes(m);
        uint8_t *bytes = calloc(1, count + 1);
        static uint16_t raw[OCEAN_PIXELS_MOST];
        struct error err = {0};
        for (int i = 0; i < m->raw_pixels; i++) {
            unsigned word = (unsigned)(i * 4) ^ m->flip;
            bytes[2 * i] = word & 255;
            bytes[2 * i + 1] = (word >> 8) & 255;
        }
        bytes[count - 1] = 0x69;
        assert_true(ocean_unpack(m, bytes, count, raw, &err));
        for (int i = 0; i < m->raw_pixels; i++)
            assert_int_equal(raw[i], (i * 4) & 0xffff);
        assert_false(ocean_unpack(m, bytes, count - 1, raw, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_false(ocean_unpack(m, bytes, count + 1, raw, &err));
        bytes[count - 1] = 0x96;
        assert_false(ocean_unpack(m, bytes, count, raw, &err));
        assert_int_equal(err.code, ERROR_DATA);
        free(bytes);
    }
}

static void exposures_are_told_in_the_models_own_unit(void **state)
{
    (void)state;
    uint8_t c[5];
    ocean_integration_command(ocean_model(0x101e), 100000, c);
    assert_memory_equal(c, ((uint8_t[]){0x02, 0xa0, 0x86, 0x01, 0x00}), 5);
    ocean_integration_command(ocean_model(0x101e), 65535000, c);
    assert_memory_equal(c, ((uint8_t[]){0x02, 0x18, 0xfc, 0xe7, 0x03}), 5);
    ocean_integration_command(ocean_model(0x1018), 100000, c);
    assert_memory_equal(c, ((uint8_t[]){0x02, 100, 0, 0, 0}), 5);
}

typedef uint8_t slots[OCEAN_SLOTS][OCEAN_SLOT_BYTES];

static struct ocean_unit unit_of(unsigned product, const uint8_t saturation[6])
{
    static const char *const texts[] = {"EMU1", "190", "0.3", "0", "0", "0"};
    slots s;
    struct ocean_unit unit;
    memset(s, 0xff, sizeof s);
    for (int i = 0; i < OCEAN_SLOTS; i++) {
        s[i][0] = 5;
        s[i][1] = (uint8_t)i;
        if (i < 6)
            strcpy((char *)s[i] + 2, texts[i]);
    }
    memcpy(s[17] + 2, saturation, 6);
    assert_true(
        ocean_unit_parse(ocean_model(product), (const uint8_t(*)[OCEAN_SLOT_BYTES])s, &unit, NULL));
    return unit;
}

static void saturation_stands_where_each_model_keeps_it(void **state)
{
    (void)state;
    const uint8_t slot[6] = {0x40, 0x9c, 0, 0, 0xf0, 0x55}; // 40000 at 0, 22000 at 4
    const uint8_t unset[6] = {0x00, 0x80, 0, 0, 0, 0};      // 32768 at 0, 0 at 4
    const struct {
        unsigned product;
        double set, unset;
    } levels[] = {
        {0x101e, 22000, 65535}, {0x1022, 22000, 65535}, {0x1016, 16383, 16383},
        {0x1012, 16383, 16383}, {0x102a, 40000, 64000}, {0x1018, 65535, 65535},
    };
    for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
        assert_near(unit_of(levels[i].product, slot).saturation, levels[i].set, 0);
        assert_near(unit_of(levels[i].product, unset).saturation, levels[i].unset, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_model_is_in_the_id_table_and_no_other),
        cmocka_unit_test(the_table_says_what_comes_over_the_wire),
        cmocka_unit_test(black_pixels_see_no_light_and_all_lie_on_the_detector),
        cmocka_unit_test(each_model_unpacks_its_own_bytes_and_refuses_all_others),
        cmocka_unit_test(exposures_are_told_in_the_models_own_unit),
        cmocka_unit_test(saturation_stands_where_each_model_keeps_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
