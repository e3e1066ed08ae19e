// SPDX-License-Identifier: Apache-2.0
// What boothd and boothctl make of files and outputs that are no good: one
// line that names the place, the right exit status, and nobody hangs.
#include "tests/fakes/support.h"

#include <sys/resource.h>

#include "tests/fakes/folder.h"
#include "tests/whole/running.h"

static struct folder here;
static pid_t daemon_pid;

static const char *settings_text(const char *more)
{
    static char text[4096];
    char materials[512];
    assert_non_null(realpath("config/materials", materials));
    snprintf(text, sizeof text,
             "[booth]\nname = test booth\n"
             "[screen]\nwidth_m = 0.52\nheight_m = 0.325\nwidth_px = 64\nheight_px = 40\n"
             "[stand]\ncentre_from_hinge_m = 0 0 0.2\n"
             "[ceiling]\ncentre_m = 0 0.75 0\nwidth_m = 0.9\ndepth_m = 0.6\n"
             "[accelerometer]\ndriver = none\n[tracker]\ndriver = none\n"
             "[radiometer]\ndriver = none\n"
             "[display]\noutput = offscreen\nmodel = display.ini\n"
             "[materials]\nfolder = %s\n[spectrometer]\ndriver = none\n"
             "[control]\nsocket = boothd.sock\n%s",
             materials, more);
    return text;
}

static const char *words(void)
{
    static char text[16384];
    return read_words(folder_at(&here, "words"), text, sizeof text);
}

static int open_here(void **state)
{
    (void)state;
    unsetenv("NOTIFY_SOCKET");
    folder_open(&here);
    folder_put(&here, "b.conf", settings_text(""));
    return 0;
}

static int close_here(void **state)
{
    (void)state;
    if (daemon_pid > 0) {
        kill(daemon_pid, SIGKILL);
        await_program(daemon_pid);
        daemon_pid = 0;
    }
    folder_close(&here);
    return 0;
}

static void begin(void)
{
    const char *argv[] = {program_path("boothd"), "--config", folder_at(&here, "b.conf"), NULL};
    daemon_pid = start_program(argv, folder_at(&here, "log"));
    struct control_client *client = connect_to(folder_at(&here, "boothd.sock"), daemon_pid);
    assert_non_null(client);
    control_close(client);
}

static void end(void)
{
    kill(daemon_pid, SIGTERM);
    assert_int_equal(await_program(daemon_pid), 0);
    daemon_pid = 0;
}

static int check(const char *config)
{
    const char *argv[] = {program_path("boothd"), "--check", "--config", config, NULL};
    return run_program(argv, folder_at(&here, "words"));
}

static int check_with(const char *set)
{
    const char *argv[] = {program_path("boothd"),
                          "--check",
                          "--config",
                          folder_at(&here, "b.conf"),
                          "--set",
                          set,
                          NULL};
    return run_program(argv, folder_at(&here, "words"));
}

static int ctl(const char *command, const char *a, const char *b, const char *c)
{
    const char *argv[] = {program_path("boothctl"),
                          "--socket",
                          folder_at(&here, "boothd.sock"),
                          command,
                          a,
                          b,
                          c,
                          NULL};
    return run_program(argv, folder_at(&here, "words"));
}

static void assert_one_line_with(const char *part)
{
    const char *text = words();
    assert_holds(text, part);
    assert_ptr_equal(strchr(text, '\n'), text + strlen(text) - 1);
}

static void settings_that_cannot_be_read_end_with_2(void **state)
{
    (void)state;
    assert_int_equal(check(folder_at(&here, "none.conf")), 2);
    assert_one_line_with("none.conf: cannot be read");
    assert_int_equal(check(here.path), 2);
    assert_one_line_with("Is a directory");
    assert_int_equal(mkfifo(folder_at(&here, "pipe.conf"), 0600), 0);
    assert_int_equal(check(folder_at(&here, "pipe.conf")), 2);
    assert_one_line_with("no regular file");
}

static void check_names_file_and_key_of_what_is_not_there(void **state)
{
    (void)state;
    static const struct {
        const char *set, *part;
    } bad[] = {
        {"lamps.declared=moon", "b.conf: [lamps] declared = moon"},
        {"materials.show=cheese", "b.conf: [materials] show: no material \"cheese\""},
        {"materials.folder=/nowhere/m", "b.conf: [materials] folder = /nowhere/m"},
        {"control.socket=/nowhere/s", "b.conf: [control] socket = /nowhere/s: /nowhere: No such"},
        {"quality.observer=1964-10", "b.conf: [quality] observer = 1964-10"},
        {"quality.bands=/nowhere/b.ini", "b.conf: [quality] bands = /nowhere/b.ini"},
        {"screen.width_m=520 mm", "\"520 mm\" is not one number"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(check_with(bad[i].set), 2);
        assert_holds(words(), bad[i].part);
    }
    folder_put(&here, "b.conf", settings_text(""));
    assert_int_equal(check(folder_at(&here, "b.conf")), 3); // no display model, no lamps
}

static void check_names_a_calibration_that_is_not_there(void **state)
{
    (void)state;
    char text[4096];
    snprintf(text, sizeof text, "%s", settings_text(""));
    char *none = strstr(text, "[spectrometer]\ndriver = none") + strlen("[spectrometer]\n");
    memcpy(none, "calibration=c", strlen("driver = none"));
    folder_put(&here, "b.conf", text);
    assert_int_equal(check(folder_at(&here, "b.conf")), 2);
    assert_holds(words(), "b.conf: [spectrometer] calibration = ");
}

static void a_lamp_without_its_spectrum_ends_with_2(void **state)
{
    (void)state;
    folder_put(&here, "lamps/A.ini", "[lamp]\nname = A\nspectrum = A.sp\ntaught_lux = 100\n");
    assert_int_equal(check(folder_at(&here, "b.conf")), 2);
    assert_one_line_with("A.sp: cannot be read");
}

static void a_pipe_where_a_file_should_be_hangs_nobody(void **state)
{
    (void)state;
    begin();
    assert_int_equal(mkfifo(folder_at(&here, "pipe.ini"), 0600), 0);
    assert_int_equal(ctl("show", folder_at(&here, "pipe.ini"), NULL, NULL), 2);
    assert_one_line_with("pipe.ini: is no regular file");
    assert_int_equal(mkfifo(folder_at(&here, "pipe.csv"), 0600), 0);
    folder_put(&here, "m.ini", "[material]\nname = m\nkind = flat\nsource = pipe.csv\n");
    assert_int_equal(ctl("show", folder_at(&here, "m.ini"), NULL, NULL), 2);
    assert_one_line_with("pipe.csv: is no regular file");
    assert_int_equal(mkfifo(folder_at(&here, "pipe.exr"), 0600), 0);
    folder_put(&here, "e.ini", "[material]\nname = e\nkind = bands\nsource = pipe.exr\n");
    assert_int_equal(ctl("show", folder_at(&here, "e.ini"), NULL, NULL), 2);
    assert_one_line_with("pipe.exr: is no regular file");
    assert_int_equal(mkfifo(folder_at(&here, "display.ini"), 0600), 0);
    assert_int_equal(ctl("reload", NULL, NULL, NULL), 2);
    assert_one_line_with("display.ini: is no regular file");
    end();
}

static void broken_files_of_a_request_end_boothctl_with_2(void **state)
{
    (void)state;
    begin();
    folder_put(&here, "e.ini", "[material]\nname = e\nkind = bands\nsource = e.exr\n");
    folder_put(&here, "e.exr", "no picture");
    assert_int_equal(ctl("show", folder_at(&here, "e.ini"), NULL, NULL), 2);
    assert_holds(words(), "e.exr");
    assert_int_equal(ctl("show", folder_at(&here, "none.ini"), NULL, NULL), 2);
    assert_int_equal(unlink(folder_at(&here, "b.conf")), 0);
    assert_int_equal(ctl("reload", NULL, NULL, NULL), 2);
    assert_one_line_with("b.conf: cannot be read");
    assert_int_equal(ctl("status", NULL, NULL, NULL), 3); // and all goes on
    end();
}

static void a_name_with_control_characters_is_shown_without_them(void **state)
{
    (void)state;
    begin();
    assert_int_equal(ctl("show", "a\nb\x1b[31mc", NULL, NULL), 2);
    assert_one_line_with("\"a b?[31mc\"");
    assert_int_equal(ctl("patch", "-0.1", "0", "0"), 2);
    assert_one_line_with("R: \"-0.1\" is not a number in 0..1");
    end();
}

static void a_full_disk_behind_standard_output_is_a_failure(void **state)
{
    (void)state;
    static const char *const modes[] = {"--version", "--help", "--describe", "--udev"};
    if (access("/dev/full", W_OK)) {
        print_message("skipped: there is no /dev/full\n");
        skip();
    }
    for (int i = 0; i < 4; i++) {
        const char *argv[] = {program_path("boothd"), modes[i], NULL};
        assert_int_equal(run_program(argv, "/dev/full"), 1);
    }
    begin();
    char command[1024];
    snprintf(command, sizeof command, "%s --socket %s status >/dev/full", program_path("boothctl"),
             folder_at(&here, "boothd.sock"));
    const char *shell[] = {"/bin/sh", "-c", command, NULL};
    assert_int_equal(run_program(shell, folder_at(&here, "words")), 1);
    assert_one_line_with("standard output cannot be written");
    end();
}

// poll(2) refuses more descriptors than a process may have.
static void a_daemon_that_nobody_can_reach_any_more_ends_with_1(void **state)
{
    (void)state;
    struct rlimit few = {8, 8};
    begin();
    assert_int_equal(prlimit(daemon_pid, RLIMIT_NOFILE, &few, NULL), 0);
    assert_int_equal(await_program(daemon_pid), 1);
    daemon_pid = 0;
    char log[8192];
    assert_holds(read_words(folder_at(&here, "log"), log, sizeof log), "control socket: ");
}

#define HERE(test) cmocka_unit_test_setup_teardown(test, open_here, close_here)

int main(void)
{
    const struct CMUnitTest tests[] = {
        HERE(settings_that_cannot_be_read_end_with_2),
        HERE(check_names_file_and_key_of_what_is_not_there),
        HERE(check_names_a_calibration_that_is_not_there),
        HERE(a_lamp_without_its_spectrum_ends_with_2),
        HERE(a_pipe_where_a_file_should_be_hangs_nobody),
        HERE(broken_files_of_a_request_end_boothctl_with_2),
        HERE(a_name_with_control_characters_is_shown_without_them),
        HERE(a_full_disk_behind_standard_output_is_a_failure),
        HERE(a_daemon_that_nobody_can_reach_any_more_ends_with_1),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
