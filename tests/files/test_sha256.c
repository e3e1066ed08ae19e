// SPDX-License-Identifier: Apache-2.0
// Digests against the examples of FIPS 180-4 and of NIST's CAVP, from memory
// and from files.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <string.h>

#include "files/sha256.h"
#include "files/write.h"
#include "tests/files/place.h"

static const struct {
    const char *text, *hex;
} known[] = {
    {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
    {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
    {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
     "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
};

static void the_published_examples_come_out(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        struct sha256 digest;
        struct error err;
        assert_true(sha256_of_bytes(known[i].text, strlen(known[i].text), &digest, &err));
        assert_string_equal(digest.hex, known[i].hex);
    }
}

static void a_file_has_the_digest_of_its_bytes(void **state)
{
    (void)state;
    enum { SIZE = 1000000 }; // longer than any buffer: NIST's million of 'a'
    const char *path = at("million");
    static char million[SIZE];
    memset(million, 'a', SIZE);
    struct sha256 digest;
    struct error err;
    assert_true(whole_file_write(path, million, SIZE, &err));
    assert_true(sha256_of_file(path, &digest, &err));
    assert_string_equal(digest.hex,
                        "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

static void what_is_no_file_is_refused_by_name(void **state)
{
    (void)state;
    struct sha256 digest = {"untouched"};
    struct error err;
    assert_false(sha256_of_file("/dev/null", &digest, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "/dev/null"));
    assert_false(sha256_of_file("/nowhere/at/all", &digest, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "/nowhere/at/all"));
    assert_string_equal(digest.hex, "untouched");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_published_examples_come_out),
        cmocka_unit_test(a_file_has_the_digest_of_its_bytes),
        cmocka_unit_test(what_is_no_file_is_refused_by_name),
    };
    return cmocka_run_group_tests_name("sha256", tests, open_place, close_place);
}
