// SPDX-License-Identifier: Apache-2.0
// What boothcal spectrometer makes of raw counts: darks, linearity, files.
#include "tests/fakes/support.h"

#include <unistd.h>

#include "calibration/spectrometer.h"
#include "drivers/vendor_files.h"
#include "files/table.h"
#include "tests/fakes/folder.h"

enum { PIXELS = 2048, READINGS = 20, US = 100000 };

static const double NOISE = 20;     // raw counts
static const double EXACT = 1e-9;   // double rounding
static const double WRITTEN = 1e-6; // relative, of nine digits
static const double LINEAR = 5e-4;  // rms of counts per time: noise of the black pixels
static const double FLAME_NM[4] = {189.80809, 0.38583738, -1.9762801e-05, -9.4763608e-10};

static struct folder here;
static struct raw_counts light[LINEARITY_MOST], dark[LINEARITY_MOST];

static double gauss(uint64_t *seed)
{
    double sum = -6;
    for (int i = 0; i < 12; i++) {
        *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        sum += (double)(*seed >> 11) / (double)(UINT64_C(1) << 53);
    }
    return sum;
}

static void begin(struct raw_counts *r, int us)
{
    memset(r, 0, sizeof *r);
    snprintf(r->instrument, sizeof r->instrument, "Flame-S EMU1");
    r->integration_us = us;
    r->detector = (struct detector){.pixels = PIXELS,
                                    .active = {20, 2047},
                                    .black = {{6, 17}, {0, -1}},
                                    .saturation = 26000,
                                    .full_counts = 65535,
                                    .order = -1};
    memcpy(r->detector.wavelength, FLAME_NM, sizeof FLAME_NM);
}

// One more reading of the pixels' true counts; only those beyond the black ones see light.
static void add(struct raw_counts *r, const double *truth, uint64_t *seed)
{
    struct raw_counts one;
    begin(&one, r->integration_us);
    one.readings = 1;
    for (int i = 0; i < PIXELS; i++) {
        one.mean[i] = truth[i] + NOISE * gauss(seed);
        one.active[0] += i < 20 ? 0 : one.mean[i] / (PIXELS - 20);
        one.black[0] += i < 6 || i > 17 ? 0 : one.mean[i] / 12;
    }
    if (!r->readings)
        *r = one;
    else
        assert_true(raw_join(r, &one, NULL));
}

// A dark with an even dark current, a slope of that over the detector, and
// light like that of a lamp.
static struct dark_facts judged(double current, double slope, double lit, double rise)
{
    static double truth[PIXELS];
    uint64_t seed = 5;
    struct dark_facts f;
    begin(light, US);
    for (int n = 0; n < READINGS; n++) {
        for (int i = 0; i < PIXELS; i++) {
            double x = (i - 1000) / 300.0;
            truth[i] = 600 + (i < 20 ? 0 : current * (1 + slope * i / PIXELS) + rise * n) +
                       (i < 20 ? 0 : lit * exp(-x * x));
        }
        truth[100] = 9000; // hot
        add(light, truth, &seed);
    }
    dark_judge(light, &f);
    return f;
}

static void a_dark_is_steady_and_dark_whatever_its_dark_current(void **state)
{
    (void)state;
    struct dark_facts f = judged(0, 0, 0, 0);
    assert_false(f.saturated || f.unsteady || f.illuminated);
    assert_near(f.noise, NOISE, 0.2 * NOISE);
    assert_near(f.black, 600, NOISE);
    f = judged(4000, 0.04, 0, 0); // the share of a real Maya2000Pro's pattern
    assert_false(f.unsteady || f.illuminated);
    assert_near(f.level - f.black, 4080, NOISE);
}

static void a_lit_dark_shows_by_its_shape(void **state)
{
    (void)state;
    struct dark_facts f = judged(100, 0.04, 40, 0);
    assert_true(f.illuminated);
    assert_false(f.unsteady);
    assert_near(f.leak_nm, 555, 30); // a part is 40 nm wide
    assert_near(f.leak, 40, 8);
    f = judged(0, 0, 5, 0); // below what matters
    assert_false(f.illuminated);
    f = judged(0, 0, 20000, 0);
    assert_true(f.illuminated);
}

static void a_spectral_line_in_a_dark_shows_though_parts_do_not_differ(void **state)
{
    (void)state;
    static double truth[PIXELS];
    uint64_t seed = 6;
    struct dark_facts f;
    begin(light, US);
    for (int i = 0; i < PIXELS; i++)
        truth[i] = 600 + (i < 20 ? 0 : 60 * exp(-pow((i - 960) / 2.5, 2)));
    truth[400] = truth[401] = 9000; // hot ones stay hot ones
    for (int n = 0; n < READINGS; n++)
        add(light, truth, &seed);
    dark_judge(light, &f);
    assert_true(f.illuminated && f.line > f.line_limit);
    assert_true(f.leak <= f.leak_limit);
    assert_near(f.line_nm, refit_nm(FLAME_NM, 960), 1);
}

static void a_dark_that_rises_is_unsteady(void **state)
{
    (void)state;
    struct dark_facts f = judged(0, 0, 0, 4);
    assert_true(f.unsteady);
    assert_near(f.drift, 40, 8); // half the readings at 4 each
    assert_false(f.illuminated);
}

static void joined_readings_are_those_of_one_series(void **state)
{
    (void)state;
    const double values[] = {3, 5, 4, 8, 10};
    begin(light, US);
    for (int k = 0; k < 5; k++) {
        static struct raw_counts one;
        begin(&one, US);
        one.readings = 1;
        one.mean[7] = values[k];
        one.saturated = k == 2;
        if (k)
            assert_true(raw_join(light, &one, NULL));
        else
            *light = one;
    }
    assert_int_equal(light->readings, 5);
    assert_int_equal(light->saturated, 1);
    assert_near(light->mean[7], 6, EXACT);
    assert_near(light->deviation[7], sqrt(8.5), EXACT);
    begin(dark, US + 10);
    dark->readings = 1;
    assert_false(raw_join(light, dark, NULL));
}

// ---- files -----------------------------------------------------------------

static void darks_are_what_the_driver_reads(void **state)
{
    (void)state;
    static double truth[PIXELS];
    struct table table = {0};
    struct ocean_darks darks;
    struct ocean_dark at;
    struct ocean_model model;
    struct error err = {0};
    uint64_t seed = 9;
    for (int k = 0; k < 2; k++) {
        begin(&dark[k], k ? 200000 : 1000);
        for (int i = 0; i < PIXELS; i++)
            truth[i] = 600 + i % 7 + 100 * k;
        for (int n = 0; n < 3; n++)
            add(&dark[k], truth, &seed);
    }
    const char *path = folder_at(&here, "darks.csv");
    assert_true(darks_save(path, dark, 2, &err));
    assert_true(csv_load(path, &table, &err));
    struct ocean_unit unit = raw_unit(dark, &model);
    assert_true(ocean_darks_make(&unit, &table, &darks, &err));
    table_fini(&table);
    assert_int_equal(darks.count, 2);
    assert_int_equal(darks.darks[1].averaged, 3);
    assert_true(ocean_dark_at(&darks, &unit, 200000, &at));
    for (int i = 0; i < PIXELS; i++)
        assert_near(at.raw[i] / dark[1].mean[i], 1, WRITTEN);
    ocean_darks_fini(&darks);
    struct raw_counts keep = dark[0];
    dark[0] = dark[1];
    dark[1] = keep;
    assert_false(darks_save(path, dark, 2, &err));
    assert_int_equal(err.code, ERROR_RANGE);
}

static void raw_counts_go_through_a_file(void **state)
{
    (void)state;
    static double truth[PIXELS];
    static struct raw_spectrum read, direct;
    struct error err = {0};
    uint64_t seed = 2;
    begin(light, US);
    begin(dark, US);
    for (int i = 0; i < PIXELS; i++)
        truth[i] = 600;
    add(dark, truth, &seed);
    for (int i = 20; i < PIXELS; i++)
        truth[i] += i;
    add(light, truth, &seed);
    const char *path = folder_at(&here, "raw.csv");
    assert_true(raw_save(path, light, dark, &err));
    assert_true(raw_spectrum_load(path, &read, &err));
    raw_spectrum_of(light, dark, &direct);
    assert_int_equal(read.pixels, PIXELS);
    double drift = raw_black(light) - raw_black(dark);
    for (int i = 20; i < PIXELS; i += 9) {
        assert_near(read.counts[i], light->mean[i] - dark->mean[i], 1e-3);
        assert_near(direct.counts[i], read.counts[i] - drift, 1e-3);
        assert_near(refit_nm(read.wavelength, i), refit_nm(FLAME_NM, i), 1e-5);
    }
    assert_near(direct.counts[10], 0, 0);
    assert_true(raw_save(path, light, NULL, &err));
    assert_true(raw_spectrum_load(path, &read, &err));
    assert_near(read.counts[99] / light->mean[99], 1, WRITTEN);
}

static void files_that_hold_no_spectrum_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text, *why;
    } bad[] = {
        {"nm,value\n400,1\n401,2\n", "nm and counts"},
        {"nm,counts\n400,1\n401,2\n", "no axis"},
        {"nm,counts\n400,1\n401,2\n403,2\n404,1\n410,1\n411,1\n412,1\n420,1\n", "no cubic"},
    };
    static struct raw_spectrum s;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct error err = {0};
        assert_false(raw_spectrum_load(folder_put(&here, "bad.csv", bad[i].text), &s, &err));
        assert_int_equal(err.code, ERROR_DATA);
        assert_holds(err.text, bad[i].why);
    }
}

static json_t *reply(void)
{
    return json_pack("{s:i, s:i, s:i, s:[f,f,f,f], s:[f,f,f,f], s:[f,f], s:[f,f], s:[i,i], "
                     "s:[[i,i]], s:f, s:f, s:[f,f], s:[f,f,f,f], s:[f,f,f,f], s:s, s:s, s:b}",
                     "integration_us", 5000, "readings", 2, "saturated", 1, "counts", 1., 2., 3.,
                     4., "deviation", .1, .2, .3, .4, "active_means", 3., 4., "black_means", 1., 2.,
                     "active", 2, 3, "black", 0, 1, "saturation", 26000., "full_counts", 65535.,
                     "nonlinearity", 1., 1e-6, "wavelength_nm", 400., 1., 0., 0.,
                     "own_wavelength_nm", 401., 1., 0., 0., "instrument", "Flame-S", "serial",
                     "EMU1", "emulated", 1);
}

static void boothds_reply_is_read_whole_or_refused(void **state)
{
    (void)state;
    static const char *const needed[] = {
        "integration_us", "counts", "deviation",  "active_means",  "black_means",
        "active",         "black",  "saturation", "wavelength_nm", "own_wavelength_nm"};
    static struct raw_counts r;
    struct ocean_model model;
    struct error err = {0};
    json_t *whole = reply();
    assert_true(raw_counts_of(whole, &r, &err));
    json_decref(whole);
    assert_string_equal(r.instrument, "Flame-S EMU1");
    assert_true(r.emulated);
    assert_int_equal(r.readings, 2);
    assert_int_equal(r.saturated, 1);
    assert_int_equal(r.detector.order, 1);
    assert_int_equal(r.detector.black[1].last, -1);
    assert_near(r.detector.own_wavelength[0], 401, 0);
    assert_near(raw_black(&r), 1.5, EXACT);
    assert_near(raw_noise(&r), sqrt((0.01 + 0.04) / 2), EXACT);
    struct ocean_unit unit = raw_unit(&r, &model);
    assert_near(ocean_bend(&unit, 1000), 1.001, EXACT);
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++) {
        json_t *part = reply();
        json_object_del(part, needed[i]);
        assert_false(raw_counts_of(part, &r, &err));
        assert_int_equal(err.code, ERROR_DATA);
        json_decref(part);
    }
    json_t *odd = reply();
    json_object_set_new(odd, "active", json_pack("[i,i]", 2, 4));
    assert_false(raw_counts_of(odd, &r, &err));
    json_decref(odd);
}

// ---- linearity -------------------------------------------------------------

// Counts that a polynomial bends: those above dark, those as read, or none.
static void exposures_of(enum bend bend)
{
    static double truth[PIXELS];
    uint64_t seed = 17;
    const double scale = 65535.0 / 26000;
    for (int k = 0; k < 6; k++) {
        for (int lit = 0; lit < 2; lit++) {
            struct raw_counts *r = lit ? &light[k] : &dark[k];
            begin(r, 10000 * (k + 1));
            for (int i = 0; i < PIXELS; i++) {
                double x = (i - 1000) / 300.0, base = 1500;
                double is = i < 20 ? 0 : lit * 3400.0 * (k + 1) * exp(-x * x);
                double all = bend == BEND_AS_READ ? base + is : is, c = all * scale, bent = c;
                for (int pass = 0; pass < 50;
                     pass++) // counts whose quotient is what they should be
                    bent = c * (1 + 1.5e-6 * bent - 2e-11 * bent * bent);
                truth[i] = (bend == BEND_OFF       ? base + is
                            : bend == BEND_AS_READ ? bent / scale
                                                   : base + bent / scale);
            }
            for (int n = 0; n < 40; n++)
                add(r, truth, &seed);
            r->detector.order = 2;
            r->detector.nonlinearity[0] = 1;
            r->detector.nonlinearity[1] = 1.5e-6;
            r->detector.nonlinearity[2] = -2e-11;
        }
    }
}

static void linearity_tells_what_the_polynomial_is_over(void **state)
{
    (void)state;
    for (int bend = BEND_ABOVE_DARK; bend <= BEND_OFF; bend++) {
        struct linearity_facts f;
        struct error err = {0};
        exposures_of((enum bend)bend);
        bool fine = linearity_judge(light, dark, 6, &f, &err);
        if (!fine)
            print_error("%s\n", err.text);
        assert_true(fine);
        assert_int_equal(f.best, bend);
        assert_true(f.rms[bend] < LINEAR);
        assert_true(f.rms[bend] < 5 * f.noise + EXACT);
        for (int other = BEND_ABOVE_DARK; other <= BEND_OFF; other++)
            assert_true(other == bend || f.rms[other] > 3 * f.rms[bend]);
        assert_true(f.part[5] > 5 * f.part[0]);
    }
}

static void exposures_that_say_nothing_are_refused(void **state)
{
    (void)state;
    struct linearity_facts f;
    struct error err = {0};
    exposures_of(BEND_OFF);
    assert_false(linearity_judge(light, dark, 2, &f, &err));
    light[1].saturated = 3;
    assert_false(linearity_judge(light, dark, 6, &f, &err));
    assert_holds(err.text, "saturated");
    light[1].saturated = 0;
    assert_false(linearity_judge(light, dark + 1, 5, &f, &err));
    assert_holds(err.text, "belong together");
    memcpy(light, dark, sizeof light);
    light[5].mean[1000] += 500;
    assert_false(linearity_judge(light, dark, 6, &f, &err));
    assert_holds(err.text, "see light");
}

// ---- real darks ------------------------------------------------------------

static bool real_dark(const char *path, const char *column, int us, struct raw_counts *r)
{
    struct table t = {0};
    if (access(path, R_OK)) {
        printf("skipped: %s is not there\n", path);
        return false;
    }
    assert_true(csv_load(path, &t, NULL));
    int c = table_column(&t, column);
    assert_true(c >= 0 && t.rows == 2068);
    begin(r, us);
    r->detector = (struct detector){.pixels = 2068,
                                    .active = {4, 2063},
                                    .black = {{0, 3}, {2064, 2067}},
                                    .saturation = 64000,
                                    .wavelength = {187.8225, 0.477582, -1.02839e-05, -1.57464e-09}};
    r->readings = 1;
    for (int i = 0; i < 2068; i++) {
        r->mean[i] = table_at(&t, (size_t)i, (size_t)c);
        r->active[0] += i < 4 || i > 2063 ? 0 : r->mean[i] / 2060;
        r->black[0] += i < 4 || i > 2063 ? r->mean[i] / 8 : 0;
    }
    table_fini(&t);
    return true;
}

static void real_darks_are_dark_and_real_light_is_not(void **state)
{
    (void)state;
    static const char base[] = "../shared/data/spectrometer/Incandescent.spct__Incandescent."
                               "raw_spct.raw.csv";
    static const struct {
        const char *column;
        int us;
        bool lit;
    } rows[] = {{"dark.counts_1", 789115, false},
                {"dark.counts_2", 7200000, false},
                {"filter.counts_1", 789115, true},
                {"light.counts_1", 789115, true}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct dark_facts f;
        if (!real_dark(base, rows[i].column, rows[i].us, light))
            skip();
        dark_judge(light, &f);
        print_message(
            "Maya2000Pro %s: %.0f above black, parts differ by %.0f (limit %.0f), highest "
            "line %.0f (%.0f)\n",
            rows[i].column, f.level - f.black, f.leak, f.leak_limit, f.line, f.line_limit);
        assert_int_equal(f.illuminated, rows[i].lit);
    }
}

// Somebody's dark of 24 ms has a hump of 35 counts of 65535 about 620 nm.
static void a_real_dark_with_stray_light_is_found_out(void **state)
{
    (void)state;
    const char *path = "../shared/data/spectrometer/jazspec.jaz";
    struct vendor_file file;
    struct dark_facts f;
    double worst;
    if (access(path, R_OK)) {
        printf("skipped: %s is not there\n", path);
        skip();
    }
    assert_true(vendor_file_load(path, &file, NULL));
    begin(light, file.integration_us);
    light->readings = 1;
    light->detector.saturation = 65535;
    memcpy(light->mean, file.dark, sizeof *file.dark * PIXELS);
    for (int i = 6; i < PIXELS; i++)
        *(i < 20 ? light->black : light->active) += light->mean[i] / (i < 20 ? 14 : PIXELS - 20);
    assert_true(refit_axis(file.nm, PIXELS, light->detector.wavelength, &worst, NULL));
    vendor_file_fini(&file);
    dark_judge(light, &f);
    print_message("Jaz: parts differ by %.0f counts (limit %.0f), most about %.0f nm\n", f.leak,
                  f.leak_limit, f.leak_nm);
    assert_true(f.illuminated);
    assert_near(f.leak_nm, 620, 30); // a part is 45 nm wide
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
        cmocka_unit_test(a_dark_is_steady_and_dark_whatever_its_dark_current),
        cmocka_unit_test(a_lit_dark_shows_by_its_shape),
        cmocka_unit_test(a_spectral_line_in_a_dark_shows_though_parts_do_not_differ),
        cmocka_unit_test(a_dark_that_rises_is_unsteady),
        cmocka_unit_test(joined_readings_are_those_of_one_series),
        cmocka_unit_test(darks_are_what_the_driver_reads),
        cmocka_unit_test(raw_counts_go_through_a_file),
        cmocka_unit_test(files_that_hold_no_spectrum_are_refused),
        cmocka_unit_test(boothds_reply_is_read_whole_or_refused),
        cmocka_unit_test(linearity_tells_what_the_polynomial_is_over),
        cmocka_unit_test(exposures_that_say_nothing_are_refused),
        cmocka_unit_test(real_darks_are_dark_and_real_light_is_not),
        cmocka_unit_test(a_real_dark_with_stray_light_is_found_out),
    };
    return cmocka_run_group_tests(tests, open_folder, close_folder);
}
