// SPDX-License-Identifier: Apache-2.0
// Raw columns of Jaz files: emulated ones with known light, and a real one.
#include "tests/fakes/support.h"

#include <unistd.h>

#include "drivers/jaz.h"
#include "drivers/replay.h"
#include "tests/fakes/folder.h"

enum { PIXELS = 2048, US = 24000 };

#define REAL "../shared/data/spectrometer/jazspec.jaz"

static const double EDGES = 0.01;   // noisy pixels shared out between bins in two ways
static const double BINNED = 2e-3;  // a slope over the bins' edges
static const double SCATTER = 0.25; // of sigma, from 60 files

static struct folder here;
static const double JAZ_NM[4] = {190.853500, 0.378434, -1.66e-05, -1.15e-09};

static double nm_of(int i)
{
    return JAZ_NM[0] + i * (JAZ_NM[1] + i * (JAZ_NM[2] + i * JAZ_NM[3]));
}

// Counts of the light E = 2e-4 W m-2 nm-1 and of a reference three times as bright,
// with baselines that drift by 40 and 60 counts.
static double counts_of(int i, double share)
{
    double nm = nm_of(i), bend = (nm - 560) / 250;
    return i < 20 ? 0 : share * 45000 * exp(-bend * bend);
}

static double gauss(unsigned *dice)
{
    double sum = -6;
    for (int i = 0; i < 12; i++) {
        *dice = *dice * 1664525 + 1013904223;
        sum += *dice / 4294967296.0;
    }
    return sum;
}

static const char *put(const char *name, double noise, unsigned *dice, bool irradiance)
{
    const char *path = folder_put(&here, name, "");
    FILE *out = fopen(path, "w");
    fprintf(out,
            "Jaz Data File\nSpectrometers: EMUJAZ1\nIntegration Time (usec): %d (EMUJAZ1)\n"
            "Spectra Averaged: 1 (EMUJAZ1)\nNumber of Pixels in Processed Spectrum: %d\n"
            ">>>>>Begin Processed Spectral Data<<<<<\nW\tD\tR\tS\tP\n",
            US, PIXELS);
    for (int i = 0; i < PIXELS; i++) {
        double dark = 1100 + i % 5, r = dark + 40 + counts_of(i, 1);
        double s = dark - 60 + counts_of(i, 1 / 3.0) + (dice ? noise * gauss(dice) : 0);
        double p = irradiance ? 0.02 : 100 * (s - dark) / (r - dark);
        fprintf(out, "%.6f\t%.6f\t%.6f\t%.6f\t%.6f\n", nm_of(i), dark, r, s, p);
    }
    fprintf(out, ">>>>>End Processed Spectral Data<<<<<\n");
    fclose(out);
    return path;
}

// uJ per count such that the sample's counts are 2e-4 W m-2 nm-1 on 10 mm2.
static const char *put_calibration(void)
{
    const char *path = folder_put(&here, "jaz.cal", "");
    FILE *out = fopen(path, "w");
    fprintf(out, "nm,uJ_per_count\n");
    for (int i = 30; i < PIXELS - 1; i++) {
        double width = (nm_of(i + 1) - nm_of(i - 1)) / 2;
        fprintf(out, "%.6f,%.9g\n", nm_of(i),
                2e-4 * 10 * width * US * 1e-6 / counts_of(i, 1 / 3.0));
    }
    fclose(out);
    return path;
}

static const char *put_reference(void)
{
    return folder_put(&here, "reference.csv", "nm,uW\n300,0.06\n900,0.06\n"); // 6e-4 W m-2 nm-1
}

static struct spectrometer *open_with(const char *file, const char *calibration,
                                      const char *reference, struct error *err)
{
    struct spectrometer_options o;
    settings_preset(spectrometer_settings, &o);
    snprintf(o.file, sizeof o.file, "%s", file);
    snprintf(o.calibration, sizeof o.calibration, "%s", calibration);
    snprintf(o.reference, sizeof o.reference, "%s", reference);
    o.collector_mm2 = 10;
    return replay_driver.open(&o, clock_now_ns() + NS_PER_S, err);
}

static void raw_counts_become_irradiance_by_calibration_or_reference(void **state)
{
    (void)state;
    const char *file = put("light.jaz", 0, NULL, false);
    for (int way = 0; way < 2; way++) {
        struct error err = {0};
        struct spectrum_sample sample;
        struct spectrometer *s =
            open_with(file, way ? "" : put_calibration(), way ? put_reference() : "", &err);
        if (!s)
            print_error("%s\n", err.text);
        assert_non_null(s);
        assert_true(replay_driver.read(s, clock_now_ns() + NS_PER_S, &sample, &err));
        replay_driver.close(s);
        assert_int_equal(sample.status, SPECTROMETER_GOOD);
        assert_int_equal(sample.integration_us, US);
        assert_near(sample.peak, (1100 - 60 + 15000) / 65535.0, 1e-3);
        for (int nm = 400; nm <= 700; nm++) {
            assert_near(sample.irradiance.v[nm - SPECTRUM_FIRST_NM] / 2e-4, 1, BINNED);
            assert_true(sample.sigma.v[nm - SPECTRUM_FIRST_NM] > 0);
        }
    }
}

static void a_ratio_is_not_taken_for_irradiance(void **state)
{
    (void)state;
    struct error err = {0};
    assert_null(open_with(put("ratio.jaz", 0, NULL, false), "", "", &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_holds(err.text, "per cent of its reference");
    struct spectrometer *s = open_with(put("finished.jaz", 0, NULL, true), "", "", &err);
    struct spectrum_sample sample;
    assert_non_null(s);
    assert_true(replay_driver.read(s, clock_now_ns() + NS_PER_S, &sample, &err));
    assert_near(sample.irradiance.v[200], 2e-4, 1e-9);
    replay_driver.close(s);
}

static void sigma_is_the_scatter_of_noisy_files(void **state)
{
    (void)state;
    enum { FILES = 60 };
    struct table table = {0};
    struct error err = {0};
    double sum[3] = {0}, squares[3] = {0}, sigma[3] = {0};
    unsigned dice = 4;
    assert_true(csv_load(put_calibration(), &table, &err));
    const struct jaz_worth worth = {.calibration = &table, .collector_mm2 = 10};
    for (int k = 0; k < FILES; k++) {
        struct vendor_file file;
        struct jaz_light light;
        // Read noise and shot noise of the detector at 5000 to 15000 counts: about 90.
        const char *path = put("noisy.jaz", 90, &dice, false);
        assert_true(vendor_file_load(path, &file, &err));
        assert_true(jaz_irradiance(&file, &worth, 0, &light, &err));
        vendor_file_fini(&file);
        for (int i = 0; i < 3; i++) {
            double v = light.irradiance.v[150 + 40 * i];
            sum[i] += v;
            squares[i] += v * v;
            sigma[i] = light.sigma.v[150 + 40 * i];
        }
    }
    table_fini(&table);
    for (int i = 0; i < 3; i++) {
        double mean = sum[i] / FILES, scatter = sqrt(squares[i] / FILES - mean * mean);
        assert_near(scatter / sigma[i], 1, SCATTER);
    }
}

static void saturated_counts_say_so(void **state)
{
    (void)state;
    struct vendor_file file;
    struct jaz_light light;
    struct table table = {0};
    assert_true(csv_load(put_calibration(), &table, NULL));
    const struct jaz_worth worth = {.calibration = &table, .collector_mm2 = 10};
    assert_true(vendor_file_load(put("bright.jaz", 0, NULL, false), &file, NULL));
    file.sample[1000] = 65535;
    assert_true(jaz_irradiance(&file, &worth, 0, &light, NULL));
    assert_true(light.saturated);
    vendor_file_fini(&file);
    table_fini(&table);
}

static void files_without_what_it_takes_are_refused(void **state)
{
    (void)state;
    struct error err = {0};
    struct jaz_light light;
    struct vendor_file file, short_one;
    const char text[] = "Jaz Data File\nNumber of Pixels in Processed Spectrum: 2\n"
                        "Integration Time (usec): 1000 (X)\n"
                        ">>>>>Begin Processed Spectral Data<<<<<\nW\tD\tR\tS\tP\n"
                        "400 1 2 3 4\n401 5 6 7 8\n>>>>>End Processed Spectral Data<<<<<\n";
    struct table table = {0};
    assert_true(csv_load(put_calibration(), &table, NULL));
    const struct jaz_worth worth = {.calibration = &table, .collector_mm2 = 10};
    assert_true(vendor_file_parse("two.jaz", text, sizeof text - 1, &short_one, &err));
    assert_false(jaz_irradiance(&short_one, &worth, 0, &light, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_holds(err.text, "2 pixels");
    vendor_file_fini(&short_one);
    assert_true(vendor_file_load(put("odd.jaz", 0, NULL, false), &file, NULL));
    file.nm[1000] += 0.2;
    assert_false(jaz_irradiance(&file, &worth, 0, &light, &err));
    assert_holds(err.text, "no cubic");
    file.nm[1000] -= 0.2;
    file.integration_us = 0;
    assert_false(jaz_irradiance(&file, &worth, 0, &light, &err));
    vendor_file_fini(&file);
    table_fini(&table);
}

// Its P is 100 (S - D) / (R - D), its sample's baseline 45 counts below its
// dark's: following the black pixels changes P by up to five per cent.
static void a_real_jaz_file_gives_its_ratio_times_its_reference(void **state)
{
    (void)state;
    if (access(REAL, R_OK) != 0) {
        printf("skipped: %s is not there\n", REAL);
        skip();
    }
    struct vendor_file file, flat;
    struct jaz_light light;
    struct spectrum ratio;
    struct error err = {0};
    assert_true(vendor_file_load(REAL, &file, &err));
    assert_true(jaz_is_ratio(&file));
    assert_true(vendor_file_load(put_reference(), &flat, &err));
    const struct jaz_worth worth = {.reference = &flat, .reference_scale = 1e-2};
    bool fine = jaz_irradiance(&file, &worth, 0, &light, &err);
    if (!fine)
        print_error("%s\n", err.text);
    assert_true(fine);
    const struct ocean_model *m = ocean_model(0x101e);
    double s = ocean_black_mean(m, file.sample), d = ocean_black_mean(m, file.dark),
           r = ocean_black_mean(m, file.reference), worst = 0, moved = 0;
    double *bare = calloc(file.count, sizeof *bare);
    for (size_t i = 0; i < file.count; i++)
        bare[i] = (file.sample[i] - file.dark[i] - (s - d)) /
                  fmax(file.reference[i] - file.dark[i] - (r - d), 1);
    assert_true(spectrum_from_samples(file.nm, bare, file.count, false, &ratio, &err));
    for (int nm = 400; nm <= 700; nm++) {
        double e = light.irradiance.v[nm - SPECTRUM_FIRST_NM] / 6e-4;
        worst = fmax(worst, fabs(e / ratio.v[nm - SPECTRUM_FIRST_NM] - 1));
    }
    for (size_t i = 0; i < file.count; i++)
        if (file.nm[i] >= 400 && file.nm[i] <= 700)
            moved = fmax(moved, fabs(100 * bare[i] / file.values[i] - 1));
    print_message("Jaz: baselines of S and R %+.0f and %+.0f counts off the dark's; against the "
                  "ratio so corrected %.2g, which moves P by %.1f %% at most\n",
                  s - d, r - d, worst, 100 * moved);
    assert_true(worst < EDGES);
    free(bare);
    vendor_file_fini(&file);
    vendor_file_fini(&flat);
}

static int open_folder(void **state)
{
    (void)state;
    folder_open(&here);
    return 0;
}

static int close_folder(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(raw_counts_become_irradiance_by_calibration_or_reference),
        cmocka_unit_test(a_ratio_is_not_taken_for_irradiance),
        cmocka_unit_test(sigma_is_the_scatter_of_noisy_files),
        cmocka_unit_test(saturated_counts_say_so),
        cmocka_unit_test(files_without_what_it_takes_are_refused),
        cmocka_unit_test(a_real_jaz_file_gives_its_ratio_times_its_reference),
    };
    return cmocka_run_group_tests(tests, open_folder, close_folder);
}
