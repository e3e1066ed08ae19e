// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration/bands_optimise.h"
#include "calibration/commands.h"
#include "config/bands_file.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

#define DATA "/usr/share/psychtoolbox-3/PsychColorimetricData/PsychColorimetricMatFiles"

// Another compiler may round the last of the digits that ship otherwise.
#define SHIPPED_DIGITS 2e-5
// White petals in Koivisto's set, with their noise.
#define BRIGHTEST 1.02
// Where the search ends in its flat valley, in nm.
#define VALLEY_NM 0.5

static struct reflectances all;
static struct band_training derived;
static double samples[BASIS_VECTORS][BASIS_SAMPLES];

static int load(void **state)
{
    struct error err = {0};
    (void)state;
    if (reflectances_load(DATA, &all, &err) && band_training_derive(&all, &derived, samples, &err))
        return 0;
    fprintf(stderr, "%s\n", err.text);
    return -1;
}

static int unload(void **state)
{
    (void)state;
    reflectances_fini(&all);
    return 0;
}

static void padding_at_the_ends_is_no_reflectance(void **state)
{
    (void)state;
    assert_int_equal(all.count, 462 + 170 + 191 + 219);
    for (int n = 0; n < 462; n++) { // Munsell: zeros below 400 and above 700 nm
        const double *v = all.spectra[n].v;
        assert_true(v[380 - SPECTRUM_FIRST_NM] > 0.01);
        assert_near(v[380 - SPECTRUM_FIRST_NM], v[400 - SPECTRUM_FIRST_NM], 1e-9);
        assert_near(v[780 - SPECTRUM_FIRST_NM], v[700 - SPECTRUM_FIRST_NM], 1e-9);
    }
    for (int n = 0; n < all.count; n++)
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            assert_true(all.spectra[n].v[i] >= 0 && all.spectra[n].v[i] <= BRIGHTEST);
}

static void the_basis_is_orthonormal_and_the_one_that_ships(void **state)
{
    (void)state;
    struct band_training shipped;
    band_training_shipped(&shipped);
    for (int a = 0; a < BASIS_VECTORS; a++)
        for (int b = 0; b <= a; b++) {
            double product = 0;
            for (int i = 0; i < BASIS_SAMPLES; i++)
                product += samples[a][i] * samples[b][i];
            assert_near(product, a == b, 1e-5); // seven decimals are kept
        }
    for (int v = 0; v < BASIS_VECTORS; v++)
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            assert_near(derived.basis[v].v[i], shipped.basis[v].v[i], SHIPPED_DIGITS);
    for (int row = 0; row < TRAINING_ROWS; row++)
        for (int v = 0; v < BASIS_VECTORS; v++)
            assert_near(derived.coefficients[row][v], shipped.coefficients[row][v], SHIPPED_DIGITS);
}

static void the_search_finds_the_shipped_six_bands(void **state)
{
    (void)state;
    struct band_set found, shipped;
    struct error err = {0};
    double rms;
    assert_true(band_set_optimise(&derived, 6, &found, &rms, &err));
    assert_true(band_set_shipped(6, &shipped, &err));
    for (int j = 0; j < 6; j++) {
        assert_near(found.centre_nm[j], shipped.centre_nm[j], VALLEY_NM);
        assert_near(found.width_nm[j], shipped.width_nm[j], VALLEY_NM);
    }
    assert_true(rms > 0.01 && rms < 0.1);
}

static void more_bands_leave_less(void **state)
{
    (void)state;
    struct band_set set;
    double three, four;
    assert_true(band_set_optimise(&derived, 3, &set, &three, NULL));
    assert_true(band_set_optimise(&derived, 4, &set, &four, NULL));
    assert_true(four < 0.7 * three);
    for (int j = 1; j < 4; j++)
        assert_true(set.centre_nm[j] >= set.centre_nm[j - 1]);
}

static void missing_data_is_named(void **state)
{
    (void)state;
    struct reflectances r = {.count = -7};
    struct error err = {0};
    assert_false(reflectances_load("/nowhere", &r, &err));
    assert_int_equal(r.count, -7);
    assert_non_null(strstr(err.text, "/nowhere/sur_nickerson.mat"));
    struct reflectances few = {.count = 5};
    assert_false(band_training_derive(&few, &derived, samples, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

static void the_command_writes_a_set_that_loads(void **state)
{
    (void)state;
    char path[] = "/tmp/boothd-bands-XXXXXX.ini";
    int fd = mkstemps(path, 4);
    assert_true(fd >= 0);
    close(fd);
    char *good[] = {"bands", "optimise", "--count", "3", "-o", path, NULL};
    char *bad[] = {"bands", "optimise", "--count", "17", "-o", path, NULL};
    struct band_set set;
    assert_int_equal(command_bands(6, bad), COMMAND_USAGE);
    assert_int_equal(command_bands(6, good), COMMAND_FINE);
    assert_true(bands_load(path, &set, NULL));
    assert_int_equal(set.count, 3);
    unlink(path);
}

static void the_command_checks_a_chart(void **state)
{
    (void)state;
    char *good[] = {"bands", "check", "config/materials/colorchecker24.csv", "6", NULL};
    char *bad[] = {"bands", "check", "/nowhere.csv", NULL};
    assert_int_equal(command_bands(4, good), COMMAND_FINE);
    assert_int_equal(command_bands(3, bad), COMMAND_USAGE);
}

static void what_cannot_be_written_is_refused_before_the_work(void **state)
{
    (void)state;
    char *both[] = {"bands", "optimise", "--count", "6", "-o", "/tmp/x.c", NULL};
    char *nowhere[] = {"bands", "optimise", "-o", "/nowhere/x.ini", NULL};
    char *folder[] = {"bands", "optimise", "-o", "/tmp", NULL};
    char *basis[] = {"bands", "optimise", "--basis", "/nowhere/b.c", "-o", "/tmp/boothd-none.ini",
                     NULL};
    assert_int_equal(command_bands(6, both), COMMAND_USAGE);
    assert_int_equal(command_bands(4, nowhere), COMMAND_USAGE);
    assert_int_equal(command_bands(4, folder), COMMAND_USAGE);
    assert_int_equal(command_bands(6, basis), COMMAND_USAGE);
    assert_int_equal(access("/tmp/boothd-none.ini", F_OK), -1);
}

static void a_check_that_fails_prints_nothing(void **state)
{
    (void)state;
    char *bad[] = {"bands", "check",        "config/materials/colorchecker24.csv",
                   "6",     "/nowhere.ini", NULL};
    char *help[] = {"bands", "check", "--help", NULL};
    FILE *seen = tmpfile();
    fflush(stdout);
    int kept = dup(1);
    dup2(fileno(seen), 1);
    int code = command_bands(5, bad);
    fflush(stdout);
    long printed = lseek(fileno(seen), 0, SEEK_END);
    int helped = command_bands(3, help);
    fflush(stdout);
    dup2(kept, 1);
    close(kept);
    fclose(seen);
    assert_int_equal(code, COMMAND_USAGE);
    assert_int_equal(printed, 0);
    assert_int_equal(helped, COMMAND_FINE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(padding_at_the_ends_is_no_reflectance),
        cmocka_unit_test(the_basis_is_orthonormal_and_the_one_that_ships),
        cmocka_unit_test(the_search_finds_the_shipped_six_bands),
        cmocka_unit_test(more_bands_leave_less),
        cmocka_unit_test(the_command_writes_a_set_that_loads),
        cmocka_unit_test(the_command_checks_a_chart),
        cmocka_unit_test(what_cannot_be_written_is_refused_before_the_work),
        cmocka_unit_test(a_check_that_fails_prints_nothing),
        cmocka_unit_test(missing_data_is_named),
    };
    return cmocka_run_group_tests(tests, load, unload);
}
