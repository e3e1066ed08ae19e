// SPDX-License-Identifier: Apache-2.0
// boothcal list as a person runs it, in the emulated booth.
#include <jansson.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h> // last: its fail() is a macro

static char folder[] = "/tmp/test_list.XXXXXX";

static int a_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int no_folder(void **state)
{
    char line[64];
    (void)state;
    snprintf(line, sizeof line, "rm -r %s", folder);
    return system(line);
}

// Exit status of a shell line that may name $BUILD and $D, the test's folder.
static int status_of(const char *line)
{
    setenv("D", folder, 1);
    setenv("BUILD", "build", 0);
    int status = system(line);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static const json_t *of_kind(const json_t *all, const char *kind)
{
    size_t i;
    json_t *one;
    json_array_foreach(all, i, one)
    {
        if (!strcmp(json_string_value(json_object_get(one, "kind")), kind))
            return one;
    }
    print_error("no %s is listed\n", kind);
    return NULL;
}

static void the_emulated_instruments_are_listed_by_serial_number(void **state)
{
    (void)state;
    char path[128];
    assert_int_equal(
        status_of("$BUILD/boothsim --scenario simulator/scenarios/booth.ini --run $D --no-xvfb -- "
                  "sh -c 'cp config/booths/emulated.conf $D && $BUILD/boothcal list --json "
                  "--config $D/emulated.conf >$D/list.json'"),
        0);
    snprintf(path, sizeof path, "%s/list.json", folder);
    json_t *all = json_load_file(path, 0, NULL);
    assert_non_null(all);
    static const char *const kinds[] = {"spectrometer", "tracker", "accelerometer", "radiometer"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        const json_t *one = of_kind(all, kinds[i]);
        assert_non_null(one);
        assert_int_equal(strncmp(json_string_value(json_object_get(one, "serial")), "EMU", 3), 0);
        assert_true(json_is_true(json_object_get(one, "emulated")));
        assert_string_equal(json_string_value(json_object_get(one, "access")), "usable");
    }
    json_decref(all);
}

static void udev_rules_are_those_of_boothd(void **state)
{
    (void)state;
    assert_int_equal(status_of("$BUILD/boothcal list --udev >$D/a && $BUILD/boothd --udev >$D/b && "
                               "cmp $D/a $D/b && grep -q 2457 $D/a"),
                     0);
}

static void wrong_usage_ends_with_2(void **state)
{
    (void)state;
    assert_int_equal(status_of("$BUILD/boothcal list --frob 2>$D/said"), 2);
    assert_int_equal(status_of("$BUILD/boothcal list --udev --json 2>$D/said"), 2);
    assert_int_equal(status_of("$BUILD/boothcal list extra 2>$D/said"), 2);
    assert_int_equal(status_of("$BUILD/boothcal list --config /nowhere.conf 2>$D/said"), 2);
    assert_int_equal(status_of("grep -q /nowhere.conf $D/said"), 0);
    assert_int_equal(status_of("$BUILD/boothcal list --help | grep -q usage"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_emulated_instruments_are_listed_by_serial_number),
        cmocka_unit_test(udev_rules_are_those_of_boothd),
        cmocka_unit_test(wrong_usage_ends_with_2),
    };
    return cmocka_run_group_tests(tests, a_folder, no_folder);
}
