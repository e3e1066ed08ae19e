// SPDX-License-Identifier: Apache-2.0
// boothcal spectrometer in the emulated booth: a mercury-argon lamp mends an
// axis that is wrong, darks are stored and used, light under the lid is found out.
#include "tests/fakes/support.h"

#include "base/settings.h"
#include "drivers/irradiance.h"
#include "drivers/spectrometer.h"
#include "drivers/wavelength_refit.h"
#include "tests/fakes/folder.h"
#include "tests/whole/running.h"

// About 1.3 nm off the emulated unit's own axis.
#define WRONG_AXIS "341.2 0.3830 -2.08e-05 -1.12e-09"

static const double BEFORE_NM = 0.8; // the wrong axis is off by more, everywhere
static const double AFTER_NM = 0.1;  // a third of a pixel: noise, and light on a grid of 1 nm
static const double RMS_NM = 0.05;   // of the lines
static const double LINEAR = 0.002;  // of counts per time; noise of the black pixels: 0.0007

static struct folder here;
static json_t *before, *after, *refit, *dark, *lit, *linear;

// Lines 1.5 nm wide: narrower ones would lie on the middle of a nanometre,
// since the emulated light is a spectrum of 1 nm.
static void put_line_lamp(void)
{
    static const double lines[][2] = {
        {404.656, 0.5},  {407.783, 0.1},  {435.833, 1},    {546.074, 1.2},  {576.960, 0.2},
        {579.066, 0.2},  {696.543, 0.12}, {706.722, 0.08}, {738.398, 0.12}, {750.387, 0.15},
        {763.511, 0.25}, {772.376, 0.12}, {794.818, 0.08}, {811.531, 0.2}};
    const double sigma = 1.5 / 2.3548;
    FILE *out = fopen(folder_put(&here, "run/lamp.csv", ""), "w");
    assert_non_null(out);
    fprintf(out, "nm,power\n");
    for (int i = 3600; i <= 8300; i++) {
        double power = 1e-4;
        for (size_t l = 0; l < sizeof lines / sizeof *lines; l++)
            power += lines[l][1] * exp(-pow((i / 10.0 - lines[l][0]) / sigma, 2) / 2);
        fprintf(out, "%.1f,%.6g\n", i / 10.0, power);
    }
    fclose(out);
}

// The shipped booth with lamps that are warm at once: how a lamp comes up depends
// on how long the commands take.
static void put_warm_booth(char *path, size_t size)
{
    static char text[8192], whole[8192];
    read_words("simulator/scenarios/booth.ini", text, sizeof text);
    char *cold = strstr(text, "cold = yes");
    assert_non_null(cold);
    snprintf(whole, sizeof whole, "%.*scold = no%s", (int)(cold - text), text,
             cold + strlen("cold = yes"));
    snprintf(path, size, "%s", folder_put(&here, "booth.ini", whole));
}

// Inside boothsim: a first boothd with the wrong axis, a second one with what
// came out. $P is where the programs are.
static const char script[] =
    "cd \"$D/run\" || exit 1\n"
    "ctl() { \"$P/boothctl\" --socket boothd.sock \"$@\"; }\n"
    "start() {\n"
    "  \"$P/boothd\" --config boothd.conf --set spectrometer.longest_us=40000 \"$@\" 2>>log &\n"
    "  daemon=$!\n"
    "  until ctl --json raw --readings 1 >begun.json 2>>log; do\n"
    "    kill -0 $daemon || exit 1\n"
    "    sleep 0.1\n"
    "  done\n"
    "}\n"
    "cal() { \"$P/boothcal\" spectrometer \"$@\" --socket boothd.sock --json; }\n"
    "start --set \"spectrometer.wavelength_nm=" WRONG_AXIS "\"\n"
    "cp begun.json before.json\n"
    "cal wavelength --booth boothsim.sock --lamp line -o axis.ini >refit.json 2>>log\n"
    "echo wavelength $? >>codes\n"
    "cal dark --booth boothsim.sock --exposure 2000 --exposure 60000 --readings 5 \\\n"
    "  -o darks.csv >dark.json 2>>log\n"
    "echo dark $? >>codes\n"
    "ctl --json raw --readings 2 >lamps.json\n"
    "printf '\\n' | cal dark --exposure 5000 --readings 4 -o lit.csv >lit.json 2>lit.said\n"
    "echo lit $? >>codes\n"
    "cal linearity --booth boothsim.sock --lamp D50 --exposure 10000 --exposure 20000 \\\n"
    "  --exposure 40000 --readings 16 >linear.json 2>>log\n"
    "echo linearity $? >>codes\n"
    "cal wavelength --booth boothsim.sock --lamp D50 --exposure 9000 --readings 2 >/dev/null "
    "2>smooth.said\n"
    "echo smooth $? >>codes\n"
    "\"$P/boothcal\" spectrometer raw --socket boothd.sock -o raw.csv --readings 3 >/dev/null\n"
    "echo raw $? >>codes\n"
    "ctl quit\n"
    "wait $daemon\n"
    "start --set \"$(sed -n 's/^wavelength_nm = /spectrometer.wavelength_nm=/p' axis.ini)\" \\\n"
    "  --set spectrometer.darks=darks.csv\n"
    "ctl --json status >status.json\n"
    "cp begun.json after.json\n"
    "ctl quit\n"
    "wait $daemon\n";

static json_t *load(const char *name)
{
    char path[64];
    json_error_t why;
    snprintf(path, sizeof path, "run/%s", name);
    json_t *all = json_load_file(folder_at(&here, path), 0, &why);
    if (!all)
        print_error("%s: %s\n", name, why.text);
    return all;
}

static int a_technicians_round(void **state)
{
    (void)state;
    static char settings[8192], log[16384];
    char whole[12288], materials[512], programs[512], run[256], scenario[512], lamp[300];
    const char *build = getenv("BUILD");
    folder_open(&here);
    put_line_lamp();
    assert_non_null(realpath("config/materials", materials));
    assert_non_null(realpath(build ? build : "build", programs));
    put_warm_booth(scenario, sizeof scenario);
    read_words("config/booths/emulated.conf", settings, sizeof settings);
    snprintf(whole, sizeof whole, "%s\n[materials]\nfolder = %s\n[control]\nsocket = boothd.sock\n",
             settings, materials);
    folder_put(&here, "run/boothd.conf", whole);
    const char *inside = folder_put(&here, "inside.sh", script);
    snprintf(run, sizeof run, "%s", folder_at(&here, "run"));
    snprintf(lamp, sizeof lamp, "line=%s/lamp.csv", run);
    setenv("D", here.path, 1);
    setenv("P", programs, 1);
    const char *argv[] = {program_path("boothsim"),
                          "--scenario",
                          scenario,
                          "--run",
                          run,
                          "--no-xvfb",
                          "--lamp",
                          lamp,
                          "--",
                          "/bin/sh",
                          inside,
                          NULL};
    int status = run_program(argv, folder_at(&here, "said"));
    bool all = (before = load("before.json")) && (after = load("after.json")) &&
               (refit = load("refit.json")) && (dark = load("dark.json")) &&
               (lit = load("lit.json")) && (linear = load("linear.json"));
    if (status || !all)
        print_error("%s\n%s\n", read_words(folder_at(&here, "said"), settings, sizeof settings),
                    read_words(folder_at(&here, "run/log"), log, sizeof log));
    return status || !all ? -1 : 0;
}

static int cleared(void **state)
{
    (void)state;
    json_t *all[] = {before, after, refit, dark, lit, linear};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        json_decref(all[i]);
    folder_close(&here);
    return 0;
}

static void each_command_ended_as_it_should(void **state)
{
    (void)state;
    char words[512];
    assert_string_equal(read_words(folder_at(&here, "run/codes"), words, sizeof words),
                        "wavelength 0\ndark 0\nlit 3\nlinearity 0\nsmooth 2\nraw 0\n");
    read_words(folder_at(&here, "run/smooth.said"), words, sizeof words);
    assert_holds(words, "of the lamp's lines found");
}

static void take_axis(const json_t *reply, const char *key, double out[4])
{
    const json_t *values = json_object_get(reply, key);
    assert_int_equal(json_array_size(values), 4);
    for (size_t i = 0; i < 4; i++)
        out[i] = json_number_value(json_array_get(values, i));
}

static void a_line_lamp_mends_a_wrong_axis(void **state)
{
    (void)state;
    double own[4], wrong[4], mended[4], worst = 0;
    take_axis(before, "own_wavelength_nm", own);
    take_axis(before, "wavelength_nm", wrong);
    take_axis(after, "wavelength_nm", mended);
    for (int i = 0; i < 2048; i++) {
        double nm = refit_nm(own, i);
        if (nm < 380 || nm > 780)
            continue;
        assert_true(fabs(refit_nm(wrong, i) - nm) > BEFORE_NM);
        worst = fmax(worst, fabs(refit_nm(mended, i) - nm));
    }
    print_message("axis off by %.3f nm at most within 380..780 nm, rms of %d lines %.3f nm\n",
                  worst, (int)json_array_size(json_object_get(refit, "lines")),
                  json_number_value(json_object_get(refit, "rms_nm")));
    assert_true(worst < AFTER_NM);
    assert_true(json_number_value(json_object_get(refit, "rms_nm")) < RMS_NM);
}

static void the_setting_reads_back_to_the_coefficients(void **state)
{
    (void)state;
    char words[512];
    double fitted[4];
    static struct spectrometer_options options;
    read_words(folder_at(&here, "run/axis.ini"), words, sizeof words);
    char *value = strstr(words, "[spectrometer]\nwavelength_nm = ");
    assert_non_null(value);
    value = strchr(value, '=') + 2;
    *strchr(value, '\n') = 0;
    assert_true(settings_set(spectrometer_settings, &options, "wavelength_nm", value, NULL));
    take_axis(refit, "wavelength_nm", fitted);
    for (int i = 0; i < 4; i++)
        assert_near(options.wavelength_nm[i], fitted[i], 1e-9 * fabs(fitted[i]));
}

static const json_t *only(const json_t *report, size_t index)
{
    return json_array_get(json_object_get(report, "darks"), index);
}

static void darks_are_stored_as_the_driver_reads_them(void **state)
{
    (void)state;
    struct table table = {0};
    struct error err = {0};
    assert_true(csv_load(folder_at(&here, "run/darks.csv"), &table, &err));
    assert_int_equal(table.rows, 2048);
    assert_int_equal(table.columns, 2);
    assert_string_equal(table.names[0], "us2000x5");
    assert_string_equal(table.names[1], "us60000x5");
    table_fini(&table);
    for (size_t i = 0; i < 2; i++) {
        assert_true(json_is_false(json_object_get(only(dark, i), "illuminated")));
        assert_true(json_is_false(json_object_get(only(dark, i), "unsteady")));
    }
    assert_string_equal(json_string_value(json_object_get(dark, "warning")), "");
}

static double highest(const json_t *reply)
{
    double most = 0;
    const json_t *counts = json_object_get(reply, "counts");
    for (size_t i = 0; i < json_array_size(counts); i++)
        most = fmax(most, json_number_value(json_array_get(counts, i)));
    return most;
}

static void the_lamps_are_on_again_after_the_lid_was_closed(void **state)
{
    (void)state;
    json_t *lamps = load("lamps.json");
    assert_true(highest(lamps) > 5000);
    json_decref(lamps);
}

static void light_under_the_lid_is_found_out(void **state)
{
    (void)state;
    char words[1024];
    assert_true(json_is_true(json_object_get(only(lit, 0), "illuminated")));
    read_words(folder_at(&here, "run/lit.said"), words, sizeof words);
    assert_holds(words, "Close the lid");
    assert_holds(words, "warning: the dark of 5000 us looks illuminated");
}

static void linearity_names_the_units_own_way(void **state)
{
    (void)state;
    assert_string_equal(json_string_value(json_object_get(linear, "best")), "above dark");
    assert_string_equal(json_string_value(json_object_get(linear, "in_use")), "above dark");
    double rms = json_number_value(json_array_get(json_object_get(linear, "rms"), 0));
    print_message("counts per time: rms %.3f %%, without a polynomial %.3f %%\n", 100 * rms,
                  100 * json_number_value(json_array_get(json_object_get(linear, "rms"), 2)));
    assert_true(rms < LINEAR);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_command_ended_as_it_should),
        cmocka_unit_test(a_line_lamp_mends_a_wrong_axis),
        cmocka_unit_test(the_setting_reads_back_to_the_coefficients),
        cmocka_unit_test(darks_are_stored_as_the_driver_reads_them),
        cmocka_unit_test(the_lamps_are_on_again_after_the_lid_was_closed),
        cmocka_unit_test(light_under_the_lid_is_found_out),
        cmocka_unit_test(linearity_names_the_units_own_way),
    };
    return cmocka_run_group_tests(tests, a_technicians_round, cleared);
}
