// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "simulator/wire_fault.h"

#include <cmocka.h> // last: its fail() is a macro

static struct noise noise;
static uint8_t bytes[16];

static size_t after(enum wire_fault fault)
{
    noise_init(&noise, 1, 'f');
    memset(bytes, 0, sizeof(bytes));
    return fault_on(fault, &noise, bytes, sizeof(bytes));
}

static void a_fine_wire_changes_nothing(void **state)
{
    (void)state;
    static const uint8_t zeros[sizeof(bytes)];
    assert_int_equal(after(WIRE_FINE), sizeof(bytes));
    assert_memory_equal(bytes, zeros, sizeof(bytes));
    assert_int_equal(after(WIRE_STALL), sizeof(bytes));
    assert_memory_equal(bytes, zeros, sizeof(bytes));
}

static void silence_lets_nothing_through(void **state)
{
    (void)state;
    assert_int_equal(after(WIRE_SILENT), 0);
    assert_int_equal(after(WIRE_UNPLUGGED), 0);
}

static void short_is_half(void **state)
{
    (void)state;
    assert_int_equal(after(WIRE_SHORT), sizeof(bytes) / 2);
}

static void garbage_is_as_long_and_the_same_for_the_same_seed(void **state)
{
    (void)state;
    uint8_t first[sizeof(bytes)];
    static const uint8_t zeros[sizeof(bytes)];
    assert_int_equal(after(WIRE_GARBAGE), sizeof(bytes));
    memcpy(first, bytes, sizeof(bytes));
    assert_memory_not_equal(bytes, zeros, sizeof(bytes));
    after(WIRE_GARBAGE);
    assert_memory_equal(bytes, first, sizeof(bytes));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_fine_wire_changes_nothing),
        cmocka_unit_test(silence_lets_nothing_through),
        cmocka_unit_test(short_is_half),
        cmocka_unit_test(garbage_is_as_long_and_the_same_for_the_same_seed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
