// SPDX-License-Identifier: Apache-2.0
#include "config/bands_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "tests/fakes/near.h"

#define PRINTED 1e-7 // ten significant digits of some hundred nanometres

static char folder[] = "/tmp/boothd-bands-XXXXXX";
static char path[128];

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(path, sizeof path, "%s/bands.ini", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder);
}

static void write_file(const char *text)
{
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fputs(text, out);
    fclose(out);
}

static void every_shipped_set_survives_its_file(void **state)
{
    (void)state;
    for (int count = BANDS_LEAST; count <= BANDS_MOST; count++) {
        struct band_set made, read;
        assert_true(band_set_shipped(count, &made, NULL));
        assert_true(bands_save(path, &made, NULL));
        assert_true(bands_named(path, &read, NULL));
        assert_int_equal(read.count, count);
        for (int j = 0; j < count; j++) {
            assert_near(read.centre_nm[j], made.centre_nm[j], PRINTED);
            assert_near(read.width_nm[j], made.width_nm[j], PRINTED);
        }
    }
}

static void a_number_names_the_shipped_set(void **state)
{
    (void)state;
    struct band_set named, shipped;
    assert_true(bands_named("6", &named, NULL));
    assert_true(band_set_shipped(6, &shipped, NULL));
    assert_memory_equal(named.centre_nm, shipped.centre_nm, sizeof shipped.centre_nm);
    struct error err;
    assert_false(bands_named("17", &named, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_false(bands_named("/nowhere/six.ini", &named, &err));
    assert_non_null(strstr(err.text, "/nowhere/six.ini"));
}

static void files_that_contradict_themselves_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"[bands]\ncount = 3\ncentre_nm = 450 550\nwidth_nm = 30 30 30\n", "centre_nm"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 620 700\nwidth_nm = 30 30 30\n", "centre_nm"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 x\nwidth_nm = 30 30 30\n", "centre_nm"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 0x26c\nwidth_nm = 30 30 30\n", "centre_nm"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 nan\nwidth_nm = 30 30 30\n", "centre_nm"},
        {"[bands]\ncount = 3\ncentre_nm = 450,550,620\nwidth_nm = 30 30 30\n", "centre_nm"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 620\nwidth_nm = 30 0 30\n", "0"},
        {"[bands]\ncount = 2\ncentre_nm = 450 550\nwidth_nm = 30 30\n", "3..16"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 620\n", "width_nm"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 620\nwidth_nm = 3 3 3\ncolour = 1\n", "colour"},
        {"[bands]\ncount = 3\ncentre_nm = 450 550 450.3\nwidth_nm = 30 30 30\n",
         "bands 1 and 3 (450 and 450.3 nm"},
        {"", "bands.ini"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct band_set set = {.count = 42};
        struct error err = {0};
        write_file(bad[i].text);
        assert_false(bands_load(path, &set, &err));
        assert_int_equal(set.count, 42);
        assert_non_null(strstr(err.text, "bands.ini"));
        if (!strstr(err.text, bad[i].says))
            print_error("\"%s\" lacks \"%s\"\n", err.text, bad[i].says);
        assert_non_null(strstr(err.text, bad[i].says));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_shipped_set_survives_its_file),
        cmocka_unit_test(a_number_names_the_shipped_set),
        cmocka_unit_test(files_that_contradict_themselves_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
