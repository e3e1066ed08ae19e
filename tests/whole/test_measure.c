// SPDX-License-Identifier: Apache-2.0
// boothcal display measure in the emulated booth: interrupted again and again,
// it loses no reading and takes none twice.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include "colorimetry/colour.h"
#include "files/cgats.h"
#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

static struct booth_here booth;

static pid_t measure(const char *seed)
{
    static char line[1536];
    const char *folder = booth.folder.path;
    snprintf(
        line, sizeof line,
        "exec %s display measure --config %s/run/boothd.conf --socket %s/run/boothd.sock --booth "
        "%s/run/boothsim.sock --steps 4 --near-black 2 --random 4 --verify 3 --white-every 10 "
        "--warm-up 0 --settle 0 --seed %s -o %s/out",
        program_path("boothcal"), folder, folder, folder, seed, folder);
    const char *argv[] = {"/bin/sh", "-c", line, NULL};
    return start_program(argv, folder_at(&booth.folder, "words"));
}

static int lines_in_journal(void)
{
    static char text[1 << 20];
    int lines = 0;
    read_words(folder_at(&booth.folder, "out/display.journal"), text, sizeof text);
    for (const char *c = text; *c; c++)
        lines += *c == '\n';
    return lines;
}

static bool wait_for_lines(int lines, pid_t pid)
{
    while (lines_in_journal() < lines && program_lives(pid))
        clock_sleep_until_ns(clock_now_ns() + 5 * NS_PER_MS);
    return lines_in_journal() >= lines;
}

static void whoever_is_killed_goes_on_where_he_was(void **state)
{
    (void)state;
    enum { KILLS = 3, EACH = 5 };
    assert_true(booth_open(&booth, "", ""));
    int before = 0;
    for (int i = 0; i < KILLS; i++) {
        pid_t pid = measure("4");
        bool further = wait_for_lines(before + EACH + i, pid);
        kill(pid, SIGKILL);
        await_program(pid);
        assert_true(further);
        assert_true(lines_in_journal() >= before + EACH);
        before = lines_in_journal();
    }
    assert_int_equal(await_program(measure("4")), 0);
    struct cgats fit, verify;
    struct error err;
    assert_true(cgats_load_as(folder_at(&booth.folder, "out/display.ti3"), "CTI3", &fit, &err));
    assert_true(cgats_load_as(folder_at(&booth.folder, "out/verify.ti3"), "CTI3", &verify, &err));
    // One line of the plan, one for each patch: none lost, none read twice.
    assert_int_equal(lines_in_journal(), 1 + fit.table.rows + verify.table.rows);
    assert_int_equal(verify.table.rows, 3);
    cgats_fini(&fit);
    cgats_fini(&verify);
}

// X, Y, Z in the file are those that its own spectra give (CIE 1931, 2 degrees).
static void the_file_holds_spectra_that_agree_with_its_colours(void **state)
{
    (void)state;
    static const double SAME = 0.002; // relative: steps of 4 nm against the inner 1 nm
    struct cgats file;
    struct error err;
    double white[3];
    assert_true(cgats_load_as(folder_at(&booth.folder, "out/display.ti3"), "CTI3", &file, &err));
    assert_true(cgats_numbers(&file, "LUMINANCE_XYZ_CDM2", white, 3, &err));
    double bands, first, last;
    assert_true(cgats_numbers(&file, "SPECTRAL_BANDS", &bands, 1, &err) &&
                cgats_numbers(&file, "SPECTRAL_START_NM", &first, 1, &err) &&
                cgats_numbers(&file, "SPECTRAL_END_NM", &last, 1, &err));
    int column = table_column(&file.table, "SPEC_380");
    assert_true(column > 0 && first == 380);
    assert_int_equal(file.table.columns, (size_t)column + (size_t)bands);
    double nm[401], mw[401];
    for (size_t i = 0; i < (size_t)bands; i++)
        nm[i] = first + (last - first) / (bands - 1) * (double)i;
    for (size_t i = 0; i < (size_t)bands; i++)
        mw[i] = table_at(&file.table, 0, (size_t)column + i);
    struct spectrum s;
    assert_true(spectrum_from_samples(nm, mw, (size_t)bands, false, &s, &err));
    assert_float_equal(xyz_absolute(&s, OBSERVER_1931_2).Y / 1000, white[1], SAME * white[1]);
    cgats_fini(&file);
}

static void another_plan_is_refused_and_nothing_is_touched(void **state)
{
    (void)state;
    char words[1024];
    int before = lines_in_journal();
    assert_int_equal(await_program(measure("5")), 2);
    read_words(folder_at(&booth.folder, "words"), words, sizeof words);
    assert_non_null(strstr(words, "plan"));
    assert_int_equal(lines_in_journal(), before);
}

static int close_booth(void **state)
{
    (void)state;
    booth_close(&booth);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whoever_is_killed_goes_on_where_he_was),
        cmocka_unit_test(the_file_holds_spectra_that_agree_with_its_colours),
        cmocka_unit_test(another_plan_is_refused_and_nothing_is_touched),
    };
    return cmocka_run_group_tests_name("measure", tests, NULL, close_booth);
}
