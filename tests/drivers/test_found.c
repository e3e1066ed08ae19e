// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "drivers/found.h"

#include <cmocka.h>
#undef fail // ours is a function

enum { NOBODY = 65534 };

static void texts_of_devices_become_printable(void **state)
{
    (void)state;
    char text[16];
    found_text(text, sizeof text, "  FT232R\x1b[31m  \n");
    assert_string_equal(text, "FT232R?[31m");
    found_text(text, sizeof text, "a very long name indeed");
    assert_string_equal(text, "a very long nam");
    found_text(text, sizeof text, NULL);
    assert_string_equal(text, "");
    found_text(text, sizeof text, " \t ");
    assert_string_equal(text, "");
}

static void a_list_that_is_full_takes_no_more(void **state)
{
    (void)state;
    static struct found_list list;
    for (int i = 0; i < FOUND_MOST; i++)
        assert_non_null(found_add(&list, "tracker", "wiimote", "/dev/null"));
    assert_null(found_add(&list, "tracker", "wiimote", "/dev/null"));
    assert_int_equal(list.count, FOUND_MOST);
}

// Root may open everything, so the question is asked as nobody.
static void a_node_that_may_not_be_opened_is_refused_and_the_rules_are_named(void **state)
{
    (void)state;
    char path[] = "/tmp/boothd-found-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    assert_int_equal(chmod(path, 0), 0);
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        struct found_list list = {0};
        if (getuid() == 0 && setuid(NOBODY) != 0)
            _exit(77);
        struct found *f = found_add(&list, "serial line", "", path);
        _exit(f->access == FOUND_REFUSED && strstr(f->note, "70-boothd.rules") ? 0 : 1);
    }
    int status = -1;
    assert_int_equal(waitpid(child, &status, 0), child);
    unlink(path);
    assert_true(WIFEXITED(status));
    if (WEXITSTATUS(status) == 77) {
        print_message("skipped: this system gives no other user to ask as\n");
        return;
    }
    assert_int_equal(WEXITSTATUS(status), 0);
}

static void an_error_tells_refused_from_in_use_and_faulty(void **state)
{
    (void)state;
    struct found f = {.access = FOUND_USABLE};
    struct error err = {0};
    fail(&err, ERROR_SYSTEM, "/dev/ttyUSB0: no permission; install the udev rules 70-boothd.rules");
    found_blame(&f, &err);
    assert_int_equal(f.access, FOUND_REFUSED);
    assert_string_equal(f.note, err.text);
    fail(&err, ERROR_SYSTEM, "/dev/ttyUSB0: another program uses the line");
    found_blame(&f, &err);
    assert_int_equal(f.access, FOUND_IN_USE);
    fail(&err, ERROR_GONE, "no answer");
    found_blame(&f, &err);
    assert_int_equal(f.access, FOUND_FAULTY);
}

static void every_access_has_a_name(void **state)
{
    (void)state;
    assert_string_equal(found_access_name(FOUND_USABLE), "usable");
    assert_string_equal(found_access_name(FOUND_REFUSED), "refused");
    assert_string_equal(found_access_name(FOUND_IN_USE), "in use");
    assert_string_equal(found_access_name(FOUND_FAULTY), "faulty");
}

static void what_is_plugged_in_here_has_a_kind_and_a_place(void **state)
{
    (void)state;
    static struct found_list list;
    found_all(&list, clock_now_ns()); // no time: nothing is asked
    for (int i = 0; i < list.count; i++) {
        assert_true(*list.of[i].kind);
        assert_int_equal(list.of[i].place[0], '/');
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texts_of_devices_become_printable),
        cmocka_unit_test(a_list_that_is_full_takes_no_more),
        cmocka_unit_test(a_node_that_may_not_be_opened_is_refused_and_the_rules_are_named),
        cmocka_unit_test(an_error_tells_refused_from_in_use_and_faulty),
        cmocka_unit_test(every_access_has_a_name),
        cmocka_unit_test(what_is_plugged_in_here_has_a_kind_and_a_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
