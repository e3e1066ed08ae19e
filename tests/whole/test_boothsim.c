// SPDX-License-Identifier: Apache-2.0
// boothsim as a person runs it.
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/control.h"
#include "files/exr.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/fakes/near.h"

#define NEAR_LUX 15.0 // the lamp is set for the centre point; the spot's mean is within 1 %
#define COLD_LUX 30.0 // less, just after it was switched on

enum { PATIENCE_MS = 20000 }; // bounds a hang, measures nothing

static char folder[] = "/tmp/test_boothsim.XXXXXX";
static char program[512];

static int a_folder(void **state)
{
    const char *build = getenv("BUILD");
    (void)state;
    snprintf(program, sizeof program, "%s/boothsim", build ? build : "build");
    return mkdtemp(folder) ? 0 : -1;
}

static int no_folder(void **state)
{
    char line[128];
    (void)state;
    snprintf(line, sizeof line, "rm -r %s", folder);
    return system(line);
}

// Exit status of boothsim with these arguments; its words go to a file "said".
static int status_of(const char *arguments)
{
    char line[2048];
    snprintf(line, sizeof line, "%s %s >%s/said 2>&1", program, arguments, folder);
    int status = system(line);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static bool said(const char *text)
{
    char path[128], words[32768] = "";
    snprintf(path, sizeof path, "%s/said", folder);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    size_t size = fread(words, 1, sizeof words - 1, file);
    fclose(file);
    words[size] = 0;
    if (!strstr(words, text))
        print_error("\"%s\" does not say \"%s\"\n", words, text);
    return strstr(words, text) != NULL;
}

static const char *booth(const char *rest)
{
    static char arguments[800];
    snprintf(arguments, sizeof arguments,
             "--scenario simulator/scenarios/booth.ini --run %s/run %s", folder, rest);
    return arguments;
}

static void the_command_runs_on_its_own_screen_and_gives_the_exit_status(void **state)
{
    (void)state;
    assert_int_equal(status_of(booth("-- sh -c 'test -S /tmp/.X11-unix/X${DISPLAY#:} && exit 42'")),
                     42);
    assert_int_equal(status_of(booth("--no-xvfb -- sh -c 'test -z \"${DISPLAY+set}\"'")), 0);
    assert_int_equal(status_of(booth("--no-xvfb -- /nowhere/program")), 127);
    assert_int_equal(status_of(booth("--no-xvfb -- sh -c 'kill -9 $$'")), 128 + SIGKILL);
}

static void a_running_booth_leaves_what_the_product_needs(void **state)
{
    (void)state;
    char inside[512];
    snprintf(inside, sizeof inside,
             "--no-xvfb --lamp D50=FL7 --lamp TL84=FL11 -- sh -c 'cd %s/run && test -c inclinometer"
             " && test -c radiometer && test -s spectrometer.cal && test -S boothsim.sock"
             " && test -x spotread'",
             folder);
    assert_int_equal(status_of(booth(inside)), 0);
    static const char *const lamps[] = {"A", "D50", "D65", "TL84"};
    for (int i = 0; i < 4; i++) {
        char path[128];
        struct exr map = {0};
        struct error err = {0};
        double width = 0;
        snprintf(path, sizeof path, "%s/run/ceiling-%s.exr", folder, lamps[i]);
        if (!exr_load(path, &map, &err))
            fail_msg("%s", err.text);
        assert_int_equal(exr_channel(&map, "Y"), 0);
        assert_true(exr_number(&map, "boothd.width_m", &width) && width == 0.90);
        exr_fini(&map);
    }
}

static void its_spotread_measures_without_a_terminal(void **state)
{
    (void)state;
    char inside[400];
    snprintf(inside, sizeof inside,
             "--no-xvfb -- sh -c 'cd %s/run && ./spotread -e -O one.sp log.txt </dev/null && "
             "test -s one.sp && test -s log.txt'",
             folder);
    assert_int_equal(status_of(booth(inside)), 0);
    assert_true(said(" Result is XYZ: "));
    snprintf(inside, sizeof inside, "--no-xvfb -- %s/run/spotread -c 2", folder);
    assert_int_equal(status_of(booth(inside)), 1);
    assert_true(said("No instrument at port 2"));
}

// Run in the booth's folder: the second calibration, the port in place of a line, and the ids
// that the kernel would show of both spectrometers.
static void a_scenario_chooses_the_instruments(void **state)
{
    (void)state;
    char path[128], arguments[900];
    snprintf(path, sizeof path, "%s/other.ini", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("[lamp1]\nname = A\nspectrum = A\n[spectrometer]\nmodel = hr4000\n"
          "[spectrometer2]\nmodel = qe65000\nserial = EMUQE0001\n[inclinometer]\ntcp = yes\n",
          file);
    fclose(file);
    snprintf(arguments, sizeof arguments,
             "--scenario %s --run %s/other --no-xvfb -- sh -c 'cd %s/other && "
             "test -s spectrometer2.cal && test -s inclinometer.port && ! test -e inclinometer && "
             "cat /sys/bus/usb/devices/*/idProduct'",
             path, folder, folder);
    assert_int_equal(status_of(arguments), 0);
    assert_true(said("1012"));
    assert_true(said("1018"));
}

static void bad_input_ends_with_2_and_one_line(void **state)
{
    (void)state;
    assert_int_equal(status_of("--run /tmp"), 2);
    assert_int_equal(status_of(booth("--frob")), 2);
    assert_int_equal(status_of("--scenario /nowhere.ini --run /tmp"), 2);
    assert_true(said("/nowhere.ini"));
    assert_int_equal(status_of(booth("--lamp D50 -- true")), 2);
    assert_true(said("NAME=SPECTRUM"));
    assert_int_equal(status_of(booth("--lamp D50=FL99 -- true")), 2);
    assert_true(said("FL99"));
    assert_int_equal(status_of(booth("--lamp D50=/nowhere.csv -- true")), 2);
    assert_true(said("/nowhere.csv"));
    assert_int_equal(status_of(booth("--script /nowhere -- true")), 2);
    assert_true(said("/nowhere"));
}

static void help_and_version_are_there(void **state)
{
    (void)state;
    assert_int_equal(status_of("--help"), 0);
    assert_true(said("usage: boothsim"));
    assert_int_equal(status_of("--version"), 0);
    assert_int_equal(status_of("--help-scenario"), 0);
    assert_true(said("[panel]"));
}

static pid_t start(void)
{
    char run[128];
    snprintf(run, sizeof run, "%s/run", folder);
    pid_t pid = fork();
    if (pid)
        return pid;
    execl(program, program, "--scenario", "simulator/scenarios/booth.ini", "--run", run,
          "--no-xvfb", (char *)NULL);
    _exit(99);
}

static struct control_client *connect_to(const char *path)
{
    struct error err = {0};
    int64_t deadline = clock_now_ns() + PATIENCE_MS * NS_PER_MS;
    struct control_client *client;
    while (!(client = control_connect(path, &err))) {
        if (clock_now_ns() > deadline)
            fail_msg("%s", err.text);
        usleep(10000);
    }
    return client;
}

static json_t *ask(struct control_client *client, const char *request)
{
    struct error err = {0};
    json_t *answer = control_call(client, json_loads(request, 0, NULL), PATIENCE_MS, &err);
    if (!answer)
        fail_msg("%s: %s", request, err.text);
    return answer;
}

static void a_booth_without_a_command_answers_until_it_is_told_to_stop(void **state)
{
    (void)state;
    char path[128];
    int status;
    struct error err = {0};
    snprintf(path, sizeof path, "%s/run/boothsim.sock", folder);
    pid_t pid = start();
    struct control_client *client = connect_to(path);
    json_decref(ask(client, "{\"do\": \"lamp\", \"name\": \"A\"}"));
    json_decref(
        ask(client, "{\"do\": \"fault\", \"instrument\": \"camera\", \"kind\": \"silent\"}"));
    json_t *answer = ask(client, "{\"do\": \"truth\", \"reflectance\": 0.5}");
    assert_string_equal(json_string_value(json_object_get(answer, "lamp")), "A");
    double lux = json_number_value(json_object_get(answer, "lux"));
    assert_true(lux > 1500 - NEAR_LUX - COLD_LUX && lux < 1500 + NEAR_LUX);
    json_decref(answer);
    assert_null(control_call(client, json_pack("{s:s}", "do", "dance"), PATIENCE_MS, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    control_close(client);
    kill(pid, SIGTERM);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    assert_int_equal(access(path, F_OK), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_command_runs_on_its_own_screen_and_gives_the_exit_status),
        cmocka_unit_test(a_running_booth_leaves_what_the_product_needs),
        cmocka_unit_test(its_spotread_measures_without_a_terminal),
        cmocka_unit_test(a_scenario_chooses_the_instruments),
        cmocka_unit_test(bad_input_ends_with_2_and_one_line),
        cmocka_unit_test(help_and_version_are_there),
        cmocka_unit_test(a_booth_without_a_command_answers_until_it_is_told_to_stop),
    };
    return cmocka_run_group_tests(tests, a_folder, no_folder);
}
