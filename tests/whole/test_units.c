// SPDX-License-Identifier: Apache-2.0
// What `make install` puts in place, as systemd reads it.
#include "tests/fakes/support.h"

#include <dirent.h>

#include "tests/fakes/folder.h"
#include "tests/whole/running.h"

// systemd-analyze's exposure times ten; see the unit for what must stay open.
#define EXPOSURE_MOST "25"

static struct folder here;
static char words[65536];

static int run(const char *const argv[])
{
    int status = run_program(argv, folder_at(&here, "words"));
    read_words(folder_at(&here, "words"), words, sizeof words);
    return status;
}

static const char *installed(const char *name)
{
    static char paths[4][320];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof *paths, "%s/root/usr/local/%s", here.path, name);
    return path;
}

// Copies what $BUILD holds; nothing is built here.
static int install(void **state)
{
    char build[256], destination[256];
    (void)state;
    const char *given = getenv("BUILD");
    folder_open(&here);
    setenv("XDG_RUNTIME_DIR", here.path, 1);
    snprintf(build, sizeof build, "BUILD=%s", given ? given : "build");
    snprintf(destination, sizeof destination, "DESTDIR=%s/root", here.path);
    const char *argv[] = {"/usr/bin/make", "-s", "--no-print-directory", build, destination,
                          "install-only",  NULL};
    unsetenv("MAKEFLAGS");
    unsetenv("MAKELEVEL");
    int status = run(argv);
    if (status)
        print_error("%s\n", words);
    return status;
}

static int clean_up(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

// The unit with the program where it is now, so that it can be verified here.
static const char *unit_here(void)
{
    char text[16384], program[512];
    read_words(installed("lib/systemd/user/boothd.service"), text, sizeof text);
    assert_holds(text, "\nExecStart=/");
    assert_null(strstr(text, "@bindir"));
    snprintf(program, sizeof program, "%s", installed("bin"));
    const char *path = folder_put(&here, "units/boothd.service", "");
    FILE *out = fopen(path, "w");
    for (char *line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
        char *key = strstr(line, "=/"), *at = strstr(line, "/bin/boothd");
        at = at ? at : strstr(line, "/bin/boothctl");
        if (key && at)
            fprintf(out, "%.*s=%s/%s\n", (int)(key - line), line, program, at + strlen("/bin/"));
        else
            fprintf(out, "%s\n", line);
    }
    fclose(out);
    return path;
}

static void the_unit_is_verified_without_a_word(void **state)
{
    (void)state;
    const char *argv[] = {
        "/usr/bin/systemd-analyze", "--user", "verify", "--man=no", unit_here(), NULL};
    assert_int_equal(run(argv), 0);
    assert_string_equal(words, ""); // an unknown key is only a warning
}

static void the_unit_is_hardened_as_far_as_instruments_and_mesa_allow(void **state)
{
    (void)state;
    const char *argv[] = {"/usr/bin/systemd-analyze",   "--user",     "security",  "--offline=true",
                          "--threshold=" EXPOSURE_MOST, "--no-pager", unit_here(), NULL};
    int status = run(argv);
    if (status)
        print_error("%s\n", words);
    assert_int_equal(status, 0);
    char unit[16384];
    read_words(installed("lib/systemd/user/boothd.service"), unit, sizeof unit);
    assert_holds(unit, "\nType=notify\n");
    assert_holds(unit, "\nWatchdogSec=");
    assert_holds(unit, "\nPartOf=graphical-session.target\n");
    assert_null(strstr(unit, "\nMemoryDenyWriteExecute")); // llvmpipe compiles in process
    assert_null(strstr(unit, "\nPrivateDevices"));
}

static void the_group_and_the_shared_folders_are_understood(void **state)
{
    (void)state;
    const char *group[] = {"/usr/bin/systemd-sysusers", "--dry-run",
                           installed("lib/sysusers.d/boothd.conf"), NULL};
    assert_int_equal(run(group), 0);
    assert_holds(words, "boothd");
    char text[4096];
    read_words(installed("lib/tmpfiles.d/boothd.conf"), text, sizeof text);
    assert_holds(text, "d /var/lib/boothd ");
    assert_holds(text, " root boothd ");
}

static void the_rules_name_every_instrument_and_the_group(void **state)
{
    (void)state;
    read_words(installed("lib/udev/rules.d/70-boothd.rules"), words, sizeof words);
    assert_holds(words, "GROUP=\"boothd\"");
    assert_holds(words, "TAG+=\"uaccess\"");
    assert_holds(words, "2457");
    assert_holds(words, "057E");
}

static void the_default_settings_and_their_manual_page_come_from_the_same_rows(void **state)
{
    (void)state;
    static char page[131072];
    read_words(installed("share/boothd/boothd.conf"), words, sizeof words);
    read_words(installed("share/man/man5/boothd.conf.5"), page, sizeof page);
    static const char *const some[] = {"width_m", "integration_us", "lamp_hold_s", "socket"};
    for (size_t i = 0; i < sizeof some / sizeof *some; i++) {
        assert_holds(words, some[i]);
        assert_holds(page, some[i]);
    }
    assert_null(strstr(page, "@settings@"));
}

static void every_installed_program_has_a_manual_page(void **state)
{
    (void)state;
    static const char *const pages[] = {"man8/boothd.8", "man1/boothctl.1", "man1/boothcal.1",
                                        "man1/boothsim.1", "man5/boothd.conf.5"};
    for (size_t i = 0; i < sizeof pages / sizeof *pages; i++) {
        char name[64];
        snprintf(name, sizeof name, "share/man/%s", pages[i]);
        read_words(installed(name), words, sizeof words);
        assert_holds(words, "\n.SH NAME\n");
    }
}

static int count_files(const char *path)
{
    int count = 0;
    DIR *folder = opendir(path);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        char below[1024];
        if (*entry->d_name == '.')
            continue;
        snprintf(below, sizeof below, "%s/%s", path, entry->d_name);
        count += entry->d_type == DT_DIR ? count_files(below) : 1;
    }
    if (folder)
        closedir(folder);
    return count;
}

// Last, since it takes everything away.
static void uninstalling_leaves_nothing_behind(void **state)
{
    (void)state;
    char build[256], destination[256];
    const char *given = getenv("BUILD");
    snprintf(build, sizeof build, "BUILD=%s", given ? given : "build");
    snprintf(destination, sizeof destination, "DESTDIR=%s/root", here.path);
    const char *argv[] = {"/usr/bin/make", "-s", "--no-print-directory", build, destination,
                          "uninstall",     NULL};
    assert_true(count_files(installed("")) > 15);
    assert_int_equal(run(argv), 0);
    assert_int_equal(count_files(installed("")), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_unit_is_verified_without_a_word),
        cmocka_unit_test(the_unit_is_hardened_as_far_as_instruments_and_mesa_allow),
        cmocka_unit_test(the_group_and_the_shared_folders_are_understood),
        cmocka_unit_test(the_rules_name_every_instrument_and_the_group),
        cmocka_unit_test(the_default_settings_and_their_manual_page_come_from_the_same_rows),
        cmocka_unit_test(every_installed_program_has_a_manual_page),
        cmocka_unit_test(uninstalling_leaves_nothing_behind),
    };
    return cmocka_run_group_tests(tests, install, clean_up);
}
