// SPDX-License-Identifier: Apache-2.0
// Plugs and pulls while other programs begin and cease to listen for devices,
// as each does that looks for a spectrometer. Runs itself again under
// umockdev-wrapper.
#include <setjmp.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include "base/error.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/simulator/instruments_here.h"

extern char **environ;

enum { LISTENERS = 3, ROUNDS = 200 };

static const char *own_path;

static _Noreturn void as_listener(void)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (;;) {
        libusb_context *usb;
        if (libusb_init(&usb) == 0) // two that begin at once may take each other's socket
            libusb_exit(usb);
    }
}

static pid_t start_listener(void)
{
    pid_t pid = -1;
    char *const argv[] = {(char *)(uintptr_t)own_path, (char *)(uintptr_t) "--listener", NULL};
    assert_int_equal(posix_spawn(&pid, own_path, NULL, NULL, argv, environ), 0);
    return pid;
}

static void listeners_that_come_and_go_do_no_harm(void **state)
{
    (void)state;
    pid_t listeners[LISTENERS];
    for (int i = 0; i < LISTENERS; i++)
        listeners[i] = start_listener();
    for (int i = 0; i < ROUNDS; i++) {
        set_fault(WIRE_SPECTROMETER, i % 2 ? WIRE_FINE : WIRE_UNPLUGGED);
        set_fault(WIRE_CAMERA, i % 2 ? WIRE_FINE : WIRE_UNPLUGGED);
    }
    for (int i = 0; i < LISTENERS; i++) {
        int status;
        assert_int_equal(waitpid(listeners[i], &status, WNOHANG), 0); // it lives
        kill(listeners[i], SIGTERM);
        waitpid(listeners[i], &status, 0);
    }
    struct opened o = open_usb();
    expect_good_spectrum(&o);
    close_usb(&o);
}

int main(int argc, char **argv)
{
    own_path = argv[0];
    if (argc > 1)
        as_listener();
    if (under_umockdev(argv[0]))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(listeners_that_come_and_go_do_no_harm),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
