// SPDX-License-Identifier: Apache-2.0
#include "config/spectra.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "tests/fakes/near.h"

#define ROUNDING 1e-12 // a few operations in double
#define CCT_K 1.0      // how finely the samples are put on the grid moves it by less

static char folder[] = "/tmp/boothd-spectra-XXXXXX";
static char path[128];

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder);
}

static const char *file(const char *name, const char *text)
{
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fputs(text, out);
    fclose(out);
    return path;
}

static struct spectra load(const char *name, const char *text, bool held)
{
    struct spectra s;
    struct error err = {0};
    bool ok = spectra_load(file(name, text), held, &s, &err);
    unlink(path);
    if (!ok)
        print_error("%s\n", err.text);
    assert_true(ok);
    return s;
}

// Refused, with a one-line text that says all of that.
static void refused(const char *name, const char *text, bool held, const char *a, const char *b)
{
    struct spectra s = {.count = 42};
    struct error err = {0};
    assert_false(spectra_load(file(name, text), held, &s, &err));
    unlink(path);
    assert_int_equal(s.count, 42);
    assert_true(err.code == ERROR_DATA || err.code == ERROR_CONFIG);
    assert_null(strchr(err.text, '\n'));
    if (!strstr(err.text, name) || !strstr(err.text, a) || !strstr(err.text, b))
        print_error("\"%s\" lacks \"%s\" or \"%s\"\n", err.text, a, b);
    assert_non_null(strstr(err.text, name));
    assert_non_null(strstr(err.text, a));
    assert_non_null(strstr(err.text, b));
}

static double at(const struct spectra *s, int i, int nm)
{
    return s->spectra[i].v[nm - SPECTRUM_FIRST_NM];
}

static void csv_with_and_without_names_is_read(void **state)
{
    (void)state;
    struct spectra s = load("two.csv",
                            "nm,first one,second\n400,.1,.2\n420,.14,.24\n450,.2,.3\n500,.3,.4\n"
                            "550,.35,.45\n580,.38,.48\n600,.4,.5\n650,.45,.55\n670,.47,.57\n"
                            "700,.5,.6\n",
                            true);
    assert_int_equal(s.count, 2);
    assert_string_equal(s.names[0], "first one");
    assert_string_equal(s.names[1], "second");
    assert_near(at(&s, 0, 450), 0.2, ROUNDING);
    assert_near(at(&s, 1, 600), 0.5, ROUNDING);
    assert_near(at(&s, 1, 830), 0.6, ROUNDING);
    spectra_fini(&s);
    s = load("bare.csv",
             "# a lamp\n400 1 2\n420 1.4 2.4\n450 2 3\n500 3 4\n550 3.5 4.5\n580 3.8 4.8\n"
             "650 4.5 5.5\n660 4.6 5.6\n670 4.7 5.7\n700 5 6\n",
             false);
    assert_int_equal(s.count, 2);
    assert_string_equal(s.names[0], "1");
    assert_string_equal(s.names[1], "2");
    assert_near(at(&s, 1, 600), 5, ROUNDING);
    assert_near(at(&s, 1, 830), 0, 0);
    spectra_fini(&s);
}

static void noise_of_an_instrument_is_kept(void **state)
{
    (void)state;
    struct spectra s = load("noisy.csv",
                            "300,-9\n365,-.1\n400,1\n450,1\n480,1\n500,1\n530,1\n550,3\n600,1\n"
                            "630,1\n660,1\n700,1\n850,-9\n",
                            false);
    assert_near(at(&s, 0, 365), -0.1, ROUNDING);
    spectra_fini(&s);
}

static void csv_that_makes_no_sense_is_refused(void **state)
{
    (void)state;
    refused("a.csv", "nm,v\n400,1\n390,1\n700,1\n", false, ":3:", "390");
    refused("b.csv", "nm,v\n400,1\n400,1\n700,1\n", false, ":3:", "rise");
    refused("c.csv", "nm,v\n400,1\n500,nan\n700,1\n", false, ":3:", "nan");
    refused("d.csv", "nm,v\n400,1\n500,-2\n700,1\n", false, ":3:", "-2 at 500 nm");
    refused("e.csv", "nm,v\n0.4,1\n0.5,1\n0.7,1\n", false, "0.4", "nanometres");
    refused("f.csv", "nm\n400\n500\n", false, "column", "nm, value");
    refused("g.csv", "nm,v\n400,1\n", false, "1 line", "2");
    refused("h.csv", "nm,v\n400,50\n500,60\n700,70\n", true, ":2:", "per cent");
    refused("i.csv", "", false, "i.csv", "");
    refused("j.csv", "nm,v\n400,1\n500,1,7\n700,1\n", false, ":3:", "");
    refused("k.csv", "nm,v\n400,1\n500,x\n700,1\n", false, ":3:", "x");
}

static void a_range_that_misses_visible_light_is_refused(void **state)
{
    (void)state;
    const char *tens = "%s430,1\n440,1\n450,1\n460,1\n470,1\n480,1\n490,1\n500,1\n%s";
    static const struct {
        const char *first, *last, *says;
    } bad[] = {
        {"", "680,1\n", "430..680"},
        {"420,1\n", "679,1\n", "420..679"},
        {"380,1\n", "", "380..500"},
        {"421,1\n", "730,1\n", "421..730"},
    };
    char text[256];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        snprintf(text, sizeof text, tens, bad[i].first, bad[i].last);
        refused("part.csv", text, false, bad[i].says, "420 or below to 680 or above");
        refused("part.csv", text, true, bad[i].says, "420 or below to 680 or above");
    }
    snprintf(text, sizeof text, tens, "420,1\n", "680,1\n");
#pragma GCC diagnostic pop
    struct spectra s = load("whole.csv", text, true);
    spectra_fini(&s);
}

static void few_samples_tell_an_even_spectrum_only(void **state)
{
    (void)state;
    refused("few.csv", "400,1\n420,2\n450,1\n500,1\n550,1\n600,1\n650,1\n680.5,1\n", false,
            "6 samples", "at least 8");
    refused("few.csv", "400,.2\n700,.3\n", true, "0 samples", "at least 8");
    struct spectra s = load("even.csv", "400,.2\n700,.2\n", true);
    assert_near(at(&s, 0, 555), 0.2, ROUNDING);
    assert_string_equal(s.warning, "");
    spectra_fini(&s);
}

static void reflectances_have_bounds(void **state)
{
    (void)state;
    struct spectra s = load("noise.csv", "380,-.02\n780,-.02\n", true);
    spectra_fini(&s);
    s = load("noise.csv", "380,1.05\n780,1.05\n", true);
    assert_string_equal(s.warning, "");
    spectra_fini(&s);
    s = load("bright.csv", "nm,paper\n380,1.3\n780,1.3\n", true);
    assert_non_null(strstr(s.warning, "bright.csv:2: paper: 1.3 at 380 nm is above 1.05"));
    spectra_fini(&s);
    refused("high.csv", "380,1.31\n780,1.31\n", true, ":1:", "-0.02..1.3");
    refused("low.csv", "380,-.021\n780,-.021\n", true, ":1:", "-0.02..1.3");
}

static void powers_of_no_unit_are_refused(void **state)
{
    (void)state;
    refused("tiny.csv", "nm,lamp\n380,1e-320\n780,1e-320\n", false, ":2: lamp: 9.99989e-321",
            "1e-30..1e30");
    refused("huge.csv", "nm,lamp\n380,1\n780,1e300\n", false, ":3: lamp: 1e+300", "1e-30..1e30");
    struct spectra s = load("small.csv", "380,1e-30\n780,1e-30\n", false);
    spectra_fini(&s);
}

#define SP(bands, start, end, norm, fields, sets, data)                                            \
    "SPECT\n\nDESCRIPTOR \"a lamp\"\nKEYWORD \"SPECTRAL_BANDS\"\nSPECTRAL_BANDS \"" bands          \
    "\"\nKEYWORD \"SPECTRAL_START_NM\"\nSPECTRAL_START_NM \"" start                                \
    "\"\nKEYWORD \"SPECTRAL_END_NM\"\nSPECTRAL_END_NM \"" end                                      \
    "\"\nKEYWORD \"SPECTRAL_NORM\"\nSPECTRAL_NORM \"" norm                                         \
    "\"\nBEGIN_DATA_FORMAT\n" fields                                                               \
    "\nEND_DATA_FORMAT\nNUMBER_OF_SETS " sets "\nBEGIN_DATA\n" data "\nEND_DATA\n"

#define FIELDS "SPEC_400 SPEC_500 SPEC_600 SPEC_700"
#define ELEVEN                                                                                     \
    "SPEC_400 SPEC_430 SPEC_460 SPEC_490 SPEC_520 SPEC_550 SPEC_580 SPEC_610 SPEC_640 SPEC_670 "   \
    "SPEC_700"

static void sp_is_read_and_divided_by_its_norm(void **state)
{
    (void)state;
    struct spectra s =
        load("lamp.sp",
             SP("11", "400.0", "700.0", "50.0", ELEVEN, "1", "10 13 16 19 22 25 28 31 34 37 40"),
             false);
    assert_int_equal(s.count, 1);
    assert_string_equal(s.names[0], "1");
    assert_near(at(&s, 0, 400), 0.2, ROUNDING);
    assert_near(at(&s, 0, 650), 0.7, ROUNDING);
    assert_near(at(&s, 0, 399), 0, 0);
    spectra_fini(&s);
}

static void sp_carries_several_named_spectra(void **state)
{
    (void)state;
    struct spectra s = load("chart.sp",
                            SP("11", "400.0", "700.0", "1", "SAMPLE_ID " ELEVEN, "2",
                               "A1 0 .1 .1 .1 .1 .1 .1 .1 .1 .1 .1\n"
                               "B2 0 .4 .4 .4 .5 .5 .5 .5 .5 .5 .6"),
                            true);
    assert_int_equal(s.count, 2);
    assert_string_equal(s.names[0], "A1");
    assert_string_equal(s.names[1], "B2");
    assert_near(at(&s, 1, 550), 0.5, ROUNDING);
    assert_near(at(&s, 1, 830), 0.6, ROUNDING);
    spectra_fini(&s);
}

// Instruments of 3.33 nm print SPEC_403 for 403.33 nm.
static void sp_wavelengths_come_from_the_header(void **state)
{
    (void)state;
    char text[4096];
    size_t used = (size_t)sprintf(text, "SPECT\nSPECTRAL_BANDS 91\nSPECTRAL_START_NM 400.0\n"
                                        "SPECTRAL_END_NM 700.0\nSPECTRAL_NORM 1\n"
                                        "BEGIN_DATA_FORMAT\n");
    for (int i = 0; i <= 90; i++)
        used += (size_t)sprintf(text + used, "SPEC_%.0f ", 400 + i / 0.3);
    used += (size_t)sprintf(text + used, "\nEND_DATA_FORMAT\nBEGIN_DATA\n");
    for (int i = 0; i <= 90; i++)
        used += (size_t)sprintf(text + used, "%d ", i);
    strcpy(text + used, "\nEND_DATA\n");
    struct spectra s = load("third.sp", text, false);
    assert_near(at(&s, 0, 402), 0.6, 1e-9); // on the straight line, through cubics
    spectra_fini(&s);
}

static void sp_that_contradicts_itself_is_refused(void **state)
{
    (void)state;
    refused("a.sp", SP("5", "400", "700", "1", FIELDS, "1", "10 20 30 40"), false, ":5:",
            "SPECTRAL_BANDS is 5");
    refused("b.sp", SP("4", "380", "700", "1", FIELDS, "1", "10 20 30 40"), false, ":7:",
            "SPECTRAL_START_NM is 380");
    refused("c.sp", SP("4", "400", "730", "1", FIELDS, "1", "10 20 30 40"), false, ":9:",
            "SPECTRAL_END_NM is 730");
    refused("d.sp", SP("4", "400", "700", "0", FIELDS, "1", "10 20 30 40"), false, ":11:",
            "SPECTRAL_NORM is 0");
    refused("e.sp", SP("4", "400", "700", "x", FIELDS, "1", "10 20 30 40"), false, ":11:",
            "SPECTRAL_NORM");
    refused("f.sp", SP("4", "400", "700", "1", "SPEC_400 SPEC_500 SPEC_550 SPEC_700", "1",
                       "10 20 30 40"),
            false, "SPEC_550", "600 nm");
    refused("g.sp", SP("4", "400", "700", "1", FIELDS, "2", "10 20 30 40"), false, "g.sp",
            "NUMBER_OF_SETS");
    refused("h.sp", SP("4", "400", "700", "1", FIELDS, "1", "10 20 -30 40"), false, "-30",
            "600 nm");
    refused("i.sp", SP("4", "400", "700", "1", "SPEC_400 SPEC_500 SPEC_x SPEC_700", "1",
                       "10 20 30 40"),
            false, "SPEC_x", "wavelength");
    refused("l.sp", SP("4", "400", "700", "1", "SPEC_400 SPEC_nan SPEC_600 SPEC_700", "1",
                       "10 20 30 40"),
            false, "SPEC_nan", "whole nanometres");
    refused("m.sp", SP("4", "400", "700", "1", "SPEC_0x190 SPEC_500 SPEC_600 SPEC_700", "1",
                       "10 20 30 40"),
            false, "SPEC_0x190", "whole nanometres");
    refused("j.sp", SP("0", "400", "700", "1", "A B C D", "1", "10 20 30 40"), false, "0 SPEC_",
            "at least 2");
    refused("k.sp", SP("4", "400", "700", "1", FIELDS, "1", "10 20 nan 40"), false, "k.sp", "nan");
}

static void a_missing_file_is_named(void **state)
{
    (void)state;
    struct spectra s;
    struct error err = {0};
    assert_false(spectra_load("/nowhere/lamp.sp", false, &s, &err));
    assert_non_null(strstr(err.text, "/nowhere/lamp.sp"));
    assert_false(spectra_load("/nowhere/lamp.csv", false, &s, &err));
    assert_non_null(strstr(err.text, "/nowhere/lamp.csv"));
}

static void a_lamp_is_a_cie_name_or_a_file(void **state)
{
    (void)state;
    struct spectrum lamp, cie;
    struct error err;
    assert_true(lamp_spectrum("FL3.15", &lamp, NULL));
    assert_true(illuminant("FL3.15", &cie, NULL));
    assert_memory_equal(&lamp, &cie, sizeof cie);
    assert_true(lamp_spectrum(file("x.csv", "400,2\n700,2\n"), &lamp, NULL));
    assert_near(lamp.v[500 - 360], 2, ROUNDING);
    assert_false(lamp_spectrum(file("x.csv", "400,0\n700,0\n"), &lamp, &err));
    unlink(path);
    assert_non_null(strstr(err.text, "no light"));
    assert_near(lamp.v[500 - 360], 2, ROUNDING);
    assert_false(lamp_spectrum("no-such-lamp", &lamp, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_true(spectra_is_path("./A") && spectra_is_path("lamp.CSV") && spectra_is_path("l.sp"));
    assert_false(spectra_is_path("FL3.15") || spectra_is_path("D65"));
}

static void a_file_in_the_current_folder_needs_no_path(void **state)
{
    (void)state;
    struct spectrum lamp, cie;
    struct error err = {0};
    char *before = getcwd(NULL, 0);
    file("lamp.txt", "400 2\n700 2\n");
    assert_int_equal(chdir(folder), 0);
    assert_true(spectra_is_path("lamp.txt"));
    assert_true(lamp_spectrum("lamp.txt", &lamp, &err));
    assert_near(lamp.v[500 - 360], 2, ROUNDING);
    assert_int_equal(rename("lamp.txt", "D65"), 0); // a CIE name stays one
    assert_true(lamp_spectrum("D65", &lamp, NULL) && illuminant("D65", &cie, NULL));
    assert_memory_equal(&lamp, &cie, sizeof cie);
    unlink("D65");
    assert_false(lamp_spectrum("lamp.txt", &lamp, &err));
    assert_non_null(strstr(err.text, "./lamp.txt"));
    assert_int_equal(chdir(before), 0);
    free(before);
}

// ---- real lamps --------------------------------------------------------------

static void booth_lamps_that_contradict_themselves_are_refused_a_sound_one_loads(void **state)
{
    (void)state;
    static const struct {
        const char *path, *says;
    } bad[] = {
        {"../shared/data/lamps/GTIPlus.sp", "SPECTRAL_BANDS is 80 but"},
        {"../shared/data/lamps/Office.sp", "SPECTRAL_START_NM is 380 but"},
        {"../shared/data/lamps/Trulux.sp", "SPECTRAL_START_NM is 380 but"},
    };
    struct spectra s = {0};
    struct error err;
    if (access(bad[0].path, R_OK) != 0) {
        print_message("skipped: no measured lamps beside the tree\n");
        skip();
    }
    for (int i = 0; i < 3; i++) {
        assert_false(spectra_load(bad[i].path, false, &s, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_non_null(strstr(err.text, bad[i].says));
    }
    assert_true(spectra_load("../shared/data/lamps/TruluxPlus.sp", false, &s, &err));
    assert_int_equal(s.count, 1);
    assert_near(at(&s, 0, 545), 1.394193, ROUNDING); // 139.4193 of norm 100
    spectra_fini(&s);
}

// Found again from the same files by a search along Planck's law of our own.
static void real_lamps_have_their_temperatures(void **state)
{
    (void)state;
    static const struct {
        const char *path;
        double kelvin;
    } lamps[] = {
        {"../shared/data/lamps/Philips.FT.TLL.36W.950.csv", 4463.9},
        {"../shared/data/lamps/Philips.FT.TLD.36W.965.csv", 5859.4},
        {"../shared/data/lamps/Philips.LED.T8.10W.4000K.csv", 4065.9},
        {"../shared/data/lamps/Philips.Inc.50W.spot.halogen.csv", 2667.3},
        {"../shared/data/lamps/TruluxPlus.sp", 4739.8},
    };
    if (access(lamps[0].path, R_OK) != 0) {
        print_message("skipped: no measured lamps beside the tree\n");
        skip();
    }
    for (size_t i = 0; i < sizeof lamps / sizeof *lamps; i++) {
        struct spectrum s;
        assert_true(lamp_spectrum(lamps[i].path, &s, NULL));
        struct cct cct = cct_of(xy_of(xyz_relative(&s, NULL, OBSERVER_1931_2)));
        assert_true(cct.valid);
        assert_near(cct.kelvin, lamps[i].kelvin, CCT_K);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(csv_with_and_without_names_is_read),
        cmocka_unit_test(noise_of_an_instrument_is_kept),
        cmocka_unit_test(csv_that_makes_no_sense_is_refused),
        cmocka_unit_test(a_range_that_misses_visible_light_is_refused),
        cmocka_unit_test(few_samples_tell_an_even_spectrum_only),
        cmocka_unit_test(reflectances_have_bounds),
        cmocka_unit_test(powers_of_no_unit_are_refused),
        cmocka_unit_test(sp_is_read_and_divided_by_its_norm),
        cmocka_unit_test(sp_carries_several_named_spectra),
        cmocka_unit_test(sp_wavelengths_come_from_the_header),
        cmocka_unit_test(sp_that_contradicts_itself_is_refused),
        cmocka_unit_test(a_missing_file_is_named),
        cmocka_unit_test(a_lamp_is_a_cie_name_or_a_file),
        cmocka_unit_test(a_file_in_the_current_folder_needs_no_path),
        cmocka_unit_test(booth_lamps_that_contradict_themselves_are_refused_a_sound_one_loads),
        cmocka_unit_test(real_lamps_have_their_temperatures),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
