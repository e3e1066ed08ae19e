// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "colorimetry/colour.h"
#include "drivers/replay.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

#define FOLDER "../shared/data/spectrometer/"

static const double digits = 1e-9; // what stands in the text, as a double

static const char suite[] = "SpectraSuite Data File\n"
                            "Date: Mon Jan 14 17:36:35 GMT 2008\n"
                            "Spectrometers: EMU1\n"
                            "Integration Time (usec): 20000 (EMU1)\n"
                            "Spectra Averaged: 50 (EMU1)\n"
                            "Number of Pixels in Processed Spectrum: 3\n"
                            ">>>>>Begin Processed Spectral Data<<<<<\n"
                            "400.00\t1.5\n"
                            "500.00\t2.5\n"
                            "600.00\t-3.5\n"
                            ">>>>>End Processed Spectral Data<<<<<\n";

static char *changed(const char *from, const char *what, const char *by)
{
    char *text = calloc(1, strlen(from) + strlen(by) + 1);
    const char *at = strstr(from, what);
    assert_non_null(at);
    sprintf(text, "%.*s%s%s", (int)(at - from), from, by, at + strlen(what));
    return text;
}

static void the_header_tells_exposure_and_averages(void **state)
{
    (void)state;
    struct vendor_file f;
    assert_true(vendor_file_parse("f", suite, sizeof suite - 1, &f, NULL));
    assert_int_equal(f.format, VENDOR_SPECTRASUITE);
    assert_string_equal(f.serial, "EMU1");
    assert_string_equal(f.date, "Mon Jan 14 17:36:35 GMT 2008");
    assert_int_equal(f.integration_us, 20000);
    assert_int_equal(f.averaged, 50);
    assert_int_equal(f.count, 3);
    assert_near(f.nm[1], 500, digits);
    assert_near(f.values[2], -3.5, digits);
    vendor_file_fini(&f);
}

static void decimal_commas_read_as_points(void **state)
{
    (void)state;
    static const char text[] = "Data from x Node\r\n"
                               "Integration Time (sec): 2,000000E-2\n\r"
                               ">>>>>Begin Spectral Data<<<<<\r"
                               "400,25\t1,5\r\n500,75\t2E1\r";
    struct vendor_file f;
    assert_true(vendor_file_parse("f", text, sizeof text - 1, &f, NULL));
    assert_int_equal(f.format, VENDOR_OCEANVIEW);
    assert_int_equal(f.integration_us, 20000);
    assert_near(f.nm[0], 400.25, digits);
    assert_near(f.values[0], 1.5, digits);
    assert_near(f.values[1], 20, digits);
    vendor_file_fini(&f);
}

static void jaz_files_bring_their_counts(void **state)
{
    (void)state;
    static const char text[] = "Jaz Data File\nNumber of Pixels in Processed Spectrum: 2\n"
                               ">>>>>Begin Processed Spectral Data<<<<<\nW\tD\tR\tS\tP\n"
                               "400 1 2 3 4\n401 5 6 7 8\n>>>>>End Processed Spectral Data<<<<<\n";
    struct vendor_file f;
    assert_true(vendor_file_parse("f", text, sizeof text - 1, &f, NULL));
    assert_near(f.dark[1], 5, digits);
    assert_near(f.sample[1], 7, digits);
    assert_near(f.values[1], 8, digits);
    vendor_file_fini(&f);
}

static void what_is_bad_is_refused_with_file_and_line(void **state)
{
    (void)state;
    const struct {
        const char *what, *by, *line;
    } bad[] = {
        {"SpectraSuite", "Another", "f:1:"},
        {"500.00\t2.5", "500.00\t2,5", "f:9:"},
        {"500.00\t2.5", "500.00\tnan", "f:9:"},
        {"500.00\t2.5", "500.00\t2.5\t3", "f:9:"},
        {"500.00\t2.5", "500.00", "f:9:"},
        {"500.00\t2.5", "400.00\t2.5", "f:9:"},
        {"usec): 20000", "usec): soon", "f:4:"},
        {"Spectrum: 3", "Spectrum: 4", "f:11:"},
        {"Spectrum: 3", "Spectrum: 2", "f:11:"},
        {">>>>>End Processed Spectral Data<<<<<\n", "", "f:10:"},
        {">>>>>Begin", "Begin", "f:11:"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct vendor_file f;
        struct error err = {0};
        char *text = changed(suite, bad[i].what, bad[i].by);
        bool ok = vendor_file_parse("f", text, strlen(text), &f, &err);
        if (ok || err.code != ERROR_DATA || !strstr(err.text, bad[i].line))
            print_error("%zu: %s\n", i, ok ? "taken" : err.text);
        assert_false(ok);
        assert_int_equal(err.code, ERROR_DATA);
        assert_non_null(strstr(err.text, bad[i].line));
        free(text);
    }
}

static void any_cut_of_a_file_is_refused_not_read_past(void **state)
{
    (void)state;
    for (size_t size = 0; size < sizeof suite - 40; size++) {
        struct vendor_file f;
        char *exact = malloc(size + 1); // so that a sanitizer sees a step too far
        memcpy(exact, suite, size);
        assert_false(vendor_file_parse("f", exact, size, &f, NULL));
        free(exact);
    }
}

static void a_unit_is_a_factor(void **state)
{
    (void)state;
    static const char text[] = "nm,value\n380,100\n580,100\n780,100\n";
    struct vendor_file f;
    struct spectrum micro, milli, plain;
    assert_true(vendor_file_parse("f", text, sizeof text - 1, &f, NULL));
    assert_true(replay_irradiance(&f, FILE_UW_CM2, &micro, NULL));
    assert_true(replay_irradiance(&f, FILE_MW_M2, &milli, NULL));
    assert_true(replay_irradiance(&f, FILE_W_M2, &plain, NULL));
    assert_near(micro.v[200], 1, digits);
    assert_near(milli.v[200], 0.1, digits);
    assert_near(plain.v[200], 100, digits);
    vendor_file_fini(&f);
}

static void write_text(const char *path, const char *text)
{
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fputs(text, out);
    fclose(out);
}

static void the_driver_follows_its_file(void **state)
{
    (void)state;
    char path[] = "/tmp/replayXXXXXX";
    close(mkstemp(path));
    struct spectrometer_options options;
    struct spectrum_sample sample;
    struct instrument_identity who;
    struct error err = {0};
    settings_preset(spectrometer_settings, &options);
    snprintf(options.file, sizeof options.file, "%s", path);
    write_text(path, suite);
    struct spectrometer *s = replay_driver.open(&options, clock_now_ns() + NS_PER_S, &err);
    assert_non_null(s);
    replay_driver.identify(s, &who);
    assert_string_equal(who.serial, "EMU1");
    assert_true(who.emulated);
    assert_true(replay_driver.read(s, clock_now_ns() + 2 * NS_PER_S, &sample, &err));
    assert_near(sample.irradiance.v[140], 0.025, digits);
    assert_true(sample.taken.latest_ns - sample.taken.earliest_ns == NS_PER_S); // 50 x 20 ms
    write_text(path, "SPECTRA\n");
    assert_false(replay_driver.read(s, clock_now_ns() + NS_PER_S / 20, &sample, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    char *brighter = changed(suite, "2.5", "5.0");
    write_text(path, brighter);
    free(brighter);
    assert_true(replay_driver.read(s, clock_now_ns() + NS_PER_S / 20, &sample, &err));
    assert_near(sample.irradiance.v[140], 0.05, digits);
    unlink(path);
    assert_false(replay_driver.read(s, clock_now_ns() + NS_PER_S / 20, &sample, &err));
    assert_int_equal(err.code, ERROR_GONE);
    replay_driver.close(s);
}

static void the_driver_says_what_it_lacks(void **state)
{
    (void)state;
    struct spectrometer_options options;
    struct error err = {0};
    settings_preset(spectrometer_settings, &options);
    assert_null(replay_driver.open(&options, clock_now_ns(), &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    snprintf(options.file, sizeof options.file, "/nowhere/spectrum.txt");
    assert_null(replay_driver.open(&options, clock_now_ns(), &err));
    assert_int_equal(err.code, ERROR_GONE);
}

static void a_real_file_of_each_kind_reads(void **state)
{
    (void)state;
    const struct {
        const char *name;
        enum vendor_format format;
        size_t rows;
        int us, averaged;
        double first_nm, last_nm, last;
        const char *serial;
    } files[] = {
        {"OO_comma.txt", VENDOR_SPECTRASUITE, 2048, 70000, 15, 178.23, 884.34, 25.222,
         "USB2+H11150"},
        {"OOusb4000.txt", VENDOR_SPECTRASUITE, 3648, 20000, 50, 178.65, 888.37, -12.792,
         "USB4A00428"},
        {"OceanView.txt", VENDOR_OCEANVIEW, 2389, 20000, 10, 187.92, 2116.5, 4.6991, "USB2+H09794"},
        {"jazspec.jaz", VENDOR_JAZ, 2048, 24000, 1, 190.8535, 886.439331, 13.679238, "JAZA1479"},
        {"Incandescent.spct__Incandescent.spct.result.csv", VENDOR_COLUMNS, 1421, 0, 0, 251.16,
         898.81, 0.206386676754046, ""},
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char path[256];
        snprintf(path, sizeof path, FOLDER "%s", files[i].name);
        if (access(path, R_OK) != 0) {
            printf("skipped: %s is not there\n", path);
            skip();
        }
        struct vendor_file f;
        struct spectrum s;
        struct error err = {0};
        bool ok = vendor_file_load(path, &f, &err);
        if (!ok)
            print_error("%s\n", err.text);
        assert_true(ok);
        assert_int_equal(f.format, files[i].format);
        assert_int_equal(f.count, files[i].rows);
        assert_int_equal(f.integration_us, files[i].us);
        assert_int_equal(f.averaged, files[i].averaged);
        assert_string_equal(f.serial, files[i].serial);
        assert_near(f.nm[0], files[i].first_nm, digits);
        assert_near(f.nm[f.count - 1], files[i].last_nm, digits);
        assert_near(f.values[f.count - 1], files[i].last, digits);
        assert_true(replay_irradiance(&f, FILE_UW_CM2, &s, NULL));
        vendor_file_fini(&f);
    }
}

static void a_sound_sp_reads_and_one_that_contradicts_itself_does_not(void **state)
{
    (void)state;
    const char *const path = "../shared/data/lamps/TruluxPlus.sp";
    if (access(path, R_OK) != 0) {
        printf("skipped: %s is not there\n", path);
        skip();
    }
    struct vendor_file f;
    struct error err = {0};
    assert_true(vendor_file_load(path, &f, &err));
    assert_int_equal(f.format, VENDOR_SP);
    vendor_file_fini(&f);
    assert_false(vendor_file_load("../shared/data/lamps/GTIPlus.sp", &f, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "GTIPlus.sp:"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_header_tells_exposure_and_averages),
        cmocka_unit_test(decimal_commas_read_as_points),
        cmocka_unit_test(jaz_files_bring_their_counts),
        cmocka_unit_test(what_is_bad_is_refused_with_file_and_line),
        cmocka_unit_test(any_cut_of_a_file_is_refused_not_read_past),
        cmocka_unit_test(a_unit_is_a_factor),
        cmocka_unit_test(the_driver_follows_its_file),
        cmocka_unit_test(the_driver_says_what_it_lacks),
        cmocka_unit_test(a_real_file_of_each_kind_reads),
        cmocka_unit_test(a_sound_sp_reads_and_one_that_contradicts_itself_does_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
