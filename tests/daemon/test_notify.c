// SPDX-License-Identifier: Apache-2.0
// What the service manager hears.
#include "tests/fakes/support.h"

#include <unistd.h>

#include "base/clock.h"
#include "daemon/notify.h"
#include "tests/fakes/folder.h"
#include "tests/fakes/manager.h"

enum { PATIENCE_MS = 10000 };

static struct folder here;
static struct manager manager;

static int open_manager(void **state)
{
    (void)state;
    folder_open(&here);
    assert_true(manager_open(&manager, here.path));
    setenv("NOTIFY_SOCKET", manager.path, 1);
    setenv("WATCHDOG_USEC", "4000000", 1);
    unsetenv("WATCHDOG_PID");
    return 0;
}

static int close_manager(void **state)
{
    (void)state;
    manager_close(&manager);
    folder_close(&here);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    return 0;
}

static void ready_and_stopping_are_told(void **state)
{
    (void)state;
    notify_ready();
    notify_stopping();
    assert_true(manager_hears(&manager, "READY=1", PATIENCE_MS));
    assert_true(manager_hears(&manager, "STOPPING=1", PATIENCE_MS));
}

static void a_status_line_is_told_when_it_changes(void **state)
{
    (void)state;
    struct notifier n;
    notify_init(&n);
    for (int i = 0; i < 10; i++)
        notify_line(&n, i < 5 ? "dark" : "D65, chart");
    notify_stopping();
    assert_true(manager_hears(&manager, "STOPPING=1", PATIENCE_MS));
    assert_int_equal(manager_count(&manager, "STATUS=dark"), 1);
    assert_int_equal(manager_count(&manager, "STATUS=D65, chart"), 1);
}

static void signs_of_life_come_twice_within_the_managers_patience(void **state)
{
    (void)state;
    struct notifier n;
    notify_init(&n);
    for (int64_t now_ns = 0; now_ns < 40 * NS_PER_S; now_ns += 20 * NS_PER_MS) {
        notify_alive(&n, now_ns, true);
        manager_hears(&manager, "", 0); // its queue is short
    }
    notify_stopping();
    assert_true(manager_hears(&manager, "STOPPING=1", PATIENCE_MS));
    assert_int_equal(manager_count(&manager, "WATCHDOG=1"), 20);
}

static void no_sign_of_life_comes_once_nothing_could_be_drawn_for_a_while(void **state)
{
    (void)state;
    struct notifier n;
    int before;
    notify_init(&n);
    int64_t now_ns = NS_PER_S;
    for (; now_ns < 11 * NS_PER_S; now_ns += 20 * NS_PER_MS)
        notify_alive(&n, now_ns, now_ns % (3 * NS_PER_S) == 0); // fails, but not for long
    manager_hears(&manager, "", 0);
    before = manager_count(&manager, "WATCHDOG=1");
    assert_true(before >= 5);
    for (; now_ns < 60 * NS_PER_S; now_ns += 20 * NS_PER_MS)
        notify_alive(&n, now_ns, false);
    notify_stopping();
    assert_true(manager_hears(&manager, "STOPPING=1", PATIENCE_MS));
    assert_true(manager_count(&manager, "WATCHDOG=1") <= before + 2); // 5 s of patience
    notify_alive(&n, now_ns, true);
    assert_true(manager_hears(&manager, "WATCHDOG=1", PATIENCE_MS));
}

static void without_a_manager_nothing_happens(void **state)
{
    (void)state;
    struct notifier n;
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    notify_init(&n);
    assert_int_equal(n.every_ns, 0);
    notify_ready();
    notify_line(&n, "x");
    notify_alive(&n, 0, true);
    notify_stopping();
}

static void another_process_watchdog_is_not_ours(void **state)
{
    (void)state;
    struct notifier n;
    setenv("WATCHDOG_PID", "1", 1);
    notify_init(&n);
    assert_int_equal(n.every_ns, 0);
    unsetenv("WATCHDOG_PID");
}

#define MANAGED(test) cmocka_unit_test_setup_teardown(test, open_manager, close_manager)

int main(void)
{
    const struct CMUnitTest tests[] = {
        MANAGED(ready_and_stopping_are_told),
        MANAGED(a_status_line_is_told_when_it_changes),
        MANAGED(signs_of_life_come_twice_within_the_managers_patience),
        MANAGED(no_sign_of_life_comes_once_nothing_could_be_drawn_for_a_while),
        MANAGED(without_a_manager_nothing_happens),
        MANAGED(another_process_watchdog_is_not_ours),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
