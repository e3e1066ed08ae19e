// SPDX-License-Identifier: Apache-2.0
#include "calibration/seal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#undef fail

#include "files/write.h"
#include "tests/fakes/folder.h"

static void a_sealed_text_is_found_unchanged(void **state)
{
    (void)state;
    char text[] = "mean 0.31\n" SEAL_BLANK "\nmore behind it\n";
    struct sha256 seal;
    assert_true(seal_fill(text, sizeof text - 1, NULL));
    assert_null(strstr(text, SEAL_ZEROS));
    assert_true(seal_check(text, sizeof text - 1, &seal, NULL));
    assert_non_null(strstr(text, seal.hex));
}

// The digest that sha256sum gives of the text with its zeros.
static void the_seal_is_the_digest_of_the_text_with_zeros(void **state)
{
    (void)state;
    char text[] = "a" SEAL_BLANK "b";
    struct sha256 plain, seal;
    assert_true(sha256_of_bytes(text, sizeof text - 1, &plain, NULL));
    assert_true(seal_fill(text, sizeof text - 1, NULL));
    assert_true(seal_check(text, sizeof text - 1, &seal, NULL));
    assert_string_equal(seal.hex, plain.hex);
}

static void every_changed_byte_breaks_the_seal(void **state)
{
    (void)state;
    char text[] = "dE00 0.42\n" SEAL_BLANK "\nend";
    size_t size = sizeof text - 1;
    assert_true(seal_fill(text, size, NULL));
    for (size_t i = 0; i < size; i++) {
        struct error err = {0};
        text[i] ^= 1;
        assert_false(seal_check(text, size, NULL, &err));
        assert_int_equal(err.code, ERROR_DATA);
        text[i] ^= 1;
    }
    assert_true(seal_check(text, size, NULL, NULL));
    assert_false(seal_check(text, size - 1, NULL, NULL));
}

static void no_seal_two_seals_and_half_a_seal_are_refused(void **state)
{
    (void)state;
    char none[] = "nothing", two[] = SEAL_BLANK SEAL_BLANK, half[] = SEAL_MARK "00ff";
    char done[] = SEAL_BLANK;
    assert_false(seal_fill(none, sizeof none - 1, NULL));
    assert_false(seal_fill(two, sizeof two - 1, NULL));
    assert_false(seal_fill(half, sizeof half - 1, NULL));
    assert_false(seal_check(two, sizeof two - 1, NULL, NULL));
    assert_true(seal_fill(done, sizeof done - 1, NULL));
    assert_false(seal_fill(done, sizeof done - 1, NULL)); // sealed already
}

static void bytes_of_any_kind_can_be_sealed(void **state)
{
    (void)state;
    char bytes[256 + sizeof SEAL_BLANK];
    for (int i = 0; i < 256; i++)
        bytes[i] = (char)i;
    memcpy(bytes + 256, SEAL_BLANK, sizeof SEAL_BLANK - 1);
    assert_true(seal_fill(bytes, sizeof bytes - 1, NULL));
    assert_true(seal_check(bytes, sizeof bytes - 1, NULL, NULL));
}

static void a_written_file_carries_its_seal(void **state)
{
    (void)state;
    struct folder folder;
    folder_open(&folder);
    char text[] = "{}" SEAL_BLANK;
    size_t size;
    assert_true(seal_write(folder_at(&folder, "report"), text, sizeof text - 1, NULL));
    char *back = file_read(folder_at(&folder, "report"), 1000, &size, NULL);
    assert_non_null(back);
    assert_true(seal_check(back, size, NULL, NULL));
    free(back);
    folder_close(&folder);
}

static void inputs_are_listed_once_with_their_digests(void **state)
{
    (void)state;
    struct folder folder;
    struct sealed_inputs *inputs = calloc(1, sizeof *inputs);
    struct error err = {0};
    folder_open(&folder);
    const char *path = folder_put(&folder, "in", "abc");
    assert_true(sealed_inputs_add(inputs, path, NULL));
    assert_true(sealed_inputs_add(inputs, path, NULL));
    assert_int_equal(inputs->count, 1);
    // FIPS 180-4, "abc"
    assert_string_equal(inputs->of[0].digest.hex,
                        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_false(sealed_inputs_add(inputs, folder_at(&folder, "missing"), &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    json_t *list = sealed_inputs_json(inputs);
    assert_int_equal(json_array_size(list), 1);
    json_decref(list);
    free(inputs);
    folder_close(&folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sealed_text_is_found_unchanged),
        cmocka_unit_test(the_seal_is_the_digest_of_the_text_with_zeros),
        cmocka_unit_test(every_changed_byte_breaks_the_seal),
        cmocka_unit_test(no_seal_two_seals_and_half_a_seal_are_refused),
        cmocka_unit_test(bytes_of_any_kind_can_be_sealed),
        cmocka_unit_test(a_written_file_carries_its_seal),
        cmocka_unit_test(inputs_are_listed_once_with_their_digests),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
