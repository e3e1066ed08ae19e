// SPDX-License-Identifier: Apache-2.0
#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "calibration/commands.h"
#include "calibration/display_fit.h"
#include "config/display_file.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

// A display that is a Day model comes back to within what splines leave of its
// sRGB curves, far below any instrument.
#define RECOVERED_DE00 0.02
// Two readings of 1 % white noise differ by 1.4 %; the fit averages 200.
#define NOISY_DE00 0.35
// Printed with seven digits.
#define PRINTED 1e-5

static char folder[] = "/tmp/boothd-fit-XXXXXX";
static char ti3[64], ini[64], answer[64];
// These tests are about plain Day; test_display_fit.c has the other kinds.
static const enum display_kind plain = DISPLAY_DAY;

static uint64_t seed;

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(ti3, sizeof ti3, "%s/m.ti3", folder);
    snprintf(ini, sizeof ini, "%s/d.ini", folder);
    snprintf(answer, sizeof answer, "%s/answer", folder);
    return 0;
}

static int drop_folder(void **state)
{
    (void)state;
    unlink(ti3);
    unlink(ini);
    unlink(answer);
    return rmdir(folder);
}

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

// Part of its light that the panel loses where red and green shine together.
static double shared_loss;

// P3-like panel of 900 cd/m2 with a black, gains that differ and an sRGB curve.
static struct xyz panel(struct counts c)
{
    const double m[3][4] = {{438, 239, 179, 0.35}, {206, 622, 71, 0.36}, {0.1, 41, 941, 0.5}};
    const double in[3] = {c.r, c.g, c.b};
    double t[3];
    for (int i = 0; i < 3; i++) {
        t[i] = m[i][3];
        for (int k = 0; k < 3; k++) {
            double v = pow(in[k], 1 + 0.05 * k);
            t[i] += m[i][k] * (v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
        }
    }
    double left = 1 - shared_loss * pow(c.r * c.g, 2.2);
    return (struct xyz){left * t[0], left * t[1], left * t[2]};
}

static void add(struct measurements *m, double r, double g, double b, double noise)
{
    struct xyz c = panel((struct counts){r, g, b});
    double k = 1 + noise * (2 * uniform() - 1);
    m->patches[m->count++] =
        (struct measured_patch){{r, g, b}, {c.X * k, c.Y * k, c.Z * k}, m->count + 1};
}

static struct measurements measured(double noise)
{
    struct measurements m = {
        .path = "panel", .white = panel((struct counts){1, 1, 1}), .absolute = true};
    m.patches = calloc(300, sizeof *m.patches);
    assert_non_null(m.patches);
    seed = 3;
    for (int k = 0; k <= 20; k++) {
        add(&m, k / 20.0, 0, 0, noise);
        add(&m, 0, k / 20.0, 0, noise);
        add(&m, 0, 0, k / 20.0, noise);
        add(&m, k / 20.0, k / 20.0, k / 20.0, noise);
    }
    while (m.count < 250)
        add(&m, uniform(), uniform(), uniform(), noise);
    return m;
}

static double mean_on_new_colours(const struct display_model *model)
{
    double sum = 0;
    struct xyz white = panel((struct counts){1, 1, 1});
    seed = 99;
    for (int n = 0; n < 1000; n++) {
        struct counts c = {uniform(), uniform(), uniform()};
        struct lab a, b;
        assert_true(lab_of(panel(c), white, &a, NULL) &&
                    lab_of(display_forward(model, c), white, &b, NULL));
        sum += delta_e_2000(a, b) / 1000;
    }
    return sum;
}

static void write_ti3(const char *keywords, const char *rows, int count)
{
    FILE *out = fopen(ti3, "w");
    assert_non_null(out);
    fprintf(out,
            "CTI3\n\nDEVICE_CLASS \"DISPLAY\"\nCOLOR_REP \"RGB_XYZ\"\n%s\nNUMBER_OF_FIELDS 7\n"
            "BEGIN_DATA_FORMAT\nSAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z\nEND_DATA_FORMAT\n\n"
            "NUMBER_OF_SETS %d\nBEGIN_DATA\n%sEND_DATA\n",
            keywords, count, rows);
    fclose(out);
}

static void write_panel_as(const char *keywords, double scale)
{
    struct measurements m = measured(0);
    char *rows = calloc(1, 400 * 120);
    size_t used = 0;
    for (int i = 0; i < m.count; i++) {
        struct measured_patch *p = &m.patches[i];
        used += (size_t)sprintf(rows + used, "%d %.7g %.7g %.7g %.7g %.7g %.7g\n", i + 1,
                                100 * p->counts.r, 100 * p->counts.g, 100 * p->counts.b,
                                scale * p->xyz.X, scale * p->xyz.Y, scale * p->xyz.Z);
    }
    write_ti3(keywords, rows, m.count);
    free(rows);
    measurements_fini(&m);
}

static void write_panel(void)
{
    write_panel_as("NORMALIZED_TO_Y_100 \"NO\"", 1);
}

static void refused(const char *keywords, const char *rows, int count, const char *says)
{
    struct measurements m = {.count = -7};
    struct error err = {0};
    write_ti3(keywords, rows, count);
    assert_false(measurements_load(ti3, &m, &err));
    assert_int_equal(m.count, -7);
    assert_non_null(strstr(err.text, ti3));
    if (!strstr(err.text, says))
        fail_msg("\"%s\" does not say \"%s\"", err.text, says);
}

static void relative_values_become_absolute_through_the_luminance(void **state)
{
    (void)state;
    struct measurements m;
    write_ti3("LUMINANCE_XYZ_CDM2 \"190 200 220\"\nNORMALIZED_TO_Y_100 \"YES\"",
              "1 100 100 100 95 99 110\n2 50 0 100 10 20 30\n3 100 100 100 95 101 110\n", 3);
    assert_true(measurements_load(ti3, &m, NULL));
    assert_int_equal(m.count, 3);
    assert_near(m.white.Y, 200, 0);
    assert_near(m.patches[1].xyz.Y, 40, PRINTED);
    assert_near(m.patches[1].counts.r, 0.5, PRINTED);
    assert_near(m.white_drift, 0.02, PRINTED);
    assert_int_equal(m.whites, 2);
    assert_true(m.absolute);
    assert_string_equal(m.display, "m");
    measurements_fini(&m);
}

static void without_luminance_the_white_patches_are_the_white(void **state)
{
    (void)state;
    struct measurements m;
    const char *rows = "1 100 100 100 95 99 110\n2 0 0 0 1 1 1\n3 100 100 100 97 101 112\n";
    write_ti3("", rows, 3);
    assert_true(measurements_load(ti3, &m, NULL));
    assert_near(m.white.X, 96, PRINTED);
    assert_near(m.white.Y, 100, PRINTED);
    assert_false(m.absolute);
    measurements_fini(&m);
    write_ti3("NORMALIZED_TO_Y_100 \"NO\"", rows, 3);
    assert_true(measurements_load(ti3, &m, NULL));
    assert_near(m.patches[1].xyz.Y, 1, PRINTED);
    assert_true(m.absolute);
    measurements_fini(&m);
}

static void bad_files_are_refused_by_line_and_key(void **state)
{
    (void)state;
    const char *const white = "1 100 100 100 95 100 110\n";
    refused("", "1 50 50 50 20 20 20\n", 1, "no white");
    refused("", "1 100 100 100 95 nan 110\n", 1, ":13: field XYZ_Y");
    refused("", "1 100 255 100 95 100 110\n", 1, ":13: RGB_G: 255 is outside 0..100");
    refused("", "1 100 100 100 95 100 110\n2 0 0 0 0 -5 0\n", 2, ":14: XYZ");
    refused("LUMINANCE_XYZ_CDM2 \"1 2\"", white, 1, "LUMINANCE_XYZ_CDM2");
    refused("LUMINANCE_XYZ_CDM2 \"0 0 0\"", white, 1, ":5: white: 0 0 0");
    refused("NORMALIZED_TO_Y_100 \"MAYBE\"", white, 1, ":5: NORMALIZED_TO_Y_100: \"MAYBE\"");
    refused("NORMALIZED_TO_Y_100 \"YES\"", "1 100 100 100 300 320 330\n", 1, "320");
    refused("LUMINANCE_XYZ_CDM2 \"190 200 220\"\nNORMALIZED_TO_Y_100 \"NO\"", white, 1, "100");
    refused("", "1 100 100 100 95 100 110\n2 50 50 50 20 1e300 20\n", 2, ":14: XYZ: 20 1e+300 20");
    refused("", "1 100 100 100 95 1e300 110\n", 1, ":13: XYZ_Y");
    refused("NORMALIZED_TO_Y_100 \"NO\"", "1 100 100 100 9e8 1e9 1e9\n", 1,
            ":13: white: 1e+09 cd/m2 is outside 1..100000");
    refused("LUMINANCE_XYZ_CDM2 \"9e-10 1e-9 1e-9\"", white, 1, ":5: white: 1e-09 cd/m2");
}

static void another_unit_of_rgb_is_named_as_such(void **state)
{
    (void)state;
    struct measurements m;
    refused("", "1 1 1 1 95 100 110\n2 0 0.5 0 30 50 20\n", 2, ":13: RGB_R RGB_G RGB_B");
    refused("", "1 1 1 1 95 100 110\n2 0 0.5 0 30 50 20\n", 2, "0..100");
    write_ti3("", "1 100 100 100 95 100 110\n2 0.5 0.5 0.5 0 0 0\n", 2);
    assert_true(measurements_load(ti3, &m, NULL));
    measurements_fini(&m);
}

static void the_white_rows_must_bear_the_luminance_out(void **state)
{
    (void)state;
    struct measurements m;
    static const char white[] = "1 100 100 100 95 100 110\n";
    refused("LUMINANCE_XYZ_CDM2 \"220 200 190\"", white, 1, ":5: LUMINANCE_XYZ_CDM2: 220 200 190");
    refused("LUMINANCE_XYZ_CDM2 \"190 200 190\"", white, 1, "190 200 220");
    refused("LUMINANCE_XYZ_CDM2 \"84 89 98\"\nNORMALIZED_TO_Y_100 \"NO\"", white, 1, "10 %");
    refused("", "1 100 100 100 104 111 120\n", 1, ":13: XYZ_Y: the patch 100 100 100 measured 111");
    write_ti3("LUMINANCE_XYZ_CDM2 \"190 200 202\"", white, 1);
    assert_true(measurements_load(ti3, &m, NULL));
    assert_near(m.white_error, 220.0 / 202 - 1, PRINTED);
    measurements_fini(&m);
    write_ti3("LUMINANCE_XYZ_CDM2 \"190 200 220\"", white, 1);
    assert_true(measurements_load(ti3, &m, NULL));
    assert_near(m.white_error, 0, PRINTED);
    measurements_fini(&m);
}

static void a_day_model_is_found_again(void **state)
{
    (void)state;
    struct measurements m = measured(0);
    struct display_model model;
    struct display_fit found;
    struct error err = {0};
    assert_true(display_fit(&m, &plain, &model, &found, &err));
    assert_true(found.de00.mean < RECOVERED_DE00);
    assert_true(mean_on_new_colours(&model) < RECOVERED_DE00);
    assert_false(found.misfit || found.ill_conditioned || found.drifted);
    assert_true(found.primaries);
    assert_true(fabs(found.additivity) < 1e-3);
    measurements_fini(&m);
}

static void noise_is_averaged_not_followed(void **state)
{
    (void)state;
    struct measurements m = measured(0.02);
    struct display_model model;
    struct display_fit found;
    assert_true(display_fit(&m, &plain, &model, &found, NULL));
    assert_true(mean_on_new_colours(&model) < NOISY_DE00);
    assert_true(mean_on_new_colours(&model) < found.de00.mean);
    measurements_fini(&m);
}

static void a_panel_whose_channels_do_not_add_is_a_misfit(void **state)
{
    (void)state;
    struct measurements m = measured(0);
    struct display_model model;
    struct display_fit found;
    for (int i = 0; i < m.count; i++) {
        struct counts c = m.patches[i].counts;
        double k = 1 - 0.25 * c.r * c.g * c.b;
        struct xyz *v = &m.patches[i].xyz;
        *v = (struct xyz){v->X * k, v->Y * k, v->Z * k};
    }
    m.white.X *= 0.75;
    m.white.Y *= 0.75;
    m.white.Z *= 0.75;
    assert_true(display_fit(&m, &plain, &model, &found, NULL));
    assert_true(found.misfit);
    assert_near(found.additivity, 1 / 0.75 - 1, 0.01); // black counts a little
    measurements_fini(&m);
}

static void exchanged_columns_show_in_the_primaries(void **state)
{
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        struct measurements m = measured(0);
        struct display_model model;
        struct display_fit found;
        struct error err = {0};
        for (int i = 0; i <= m.count; i++) {
            struct xyz *c = i < m.count ? &m.patches[i].xyz : &m.white, v = *c;
            *c = kind == 1   ? (struct xyz){v.Z, v.Y, v.X}
                 : kind == 2 ? (struct xyz){v.Y, v.X, v.Z}
                 : kind == 3 ? (struct xyz){v.X, v.Z, v.Y}
                             : v;
        }
        assert_true(display_fit(&m, &plain, &model, &found, &err));
        assert_int_equal(found.disordered, kind != 0);
        measurements_fini(&m);
    }
}

static void values_of_other_patches_are_no_display(void **state)
{
    (void)state;
    struct measurements m = measured(0);
    struct display_model model;
    struct display_fit found;
    struct error err = {0};
    for (int i = m.count - 1; i > 0; i--) {
        int j = (int)(uniform() * (i + 1));
        struct xyz swap = m.patches[i].xyz;
        m.patches[i].xyz = m.patches[j].xyz;
        m.patches[j].xyz = swap;
    }
    assert_false(display_fit(&m, &plain, &model, &found, &err));
    assert_non_null(strstr(err.text, "belong to no display"));
    measurements_fini(&m);
}

static void too_few_patches_decide_nothing(void **state)
{
    (void)state;
    struct measurements m = measured(0);
    struct display_model model = {.condition = -1};
    struct display_fit found;
    struct error err = {0};
    m.count = 12;
    assert_false(display_fit(&m, &plain, &model, &found, &err));
    assert_int_equal(err.code, ERROR_DATA);
    for (m.count = 0; m.count < 40;)
        add(&m, m.count % 2, m.count / 2 % 2, m.count / 4 % 2, 0);
    assert_false(display_fit(&m, &plain, &model, &found, &err));
    assert_non_null(strstr(err.text, "levels"));
    assert_near(model.condition, -1, 0);
    measurements_fini(&m);
}

static int run(int count, char **argv)
{
    return command_display(count, argv);
}

static void the_commands_fit_and_refuse_with_their_exit_codes(void **state)
{
    (void)state;
    char *fit[] = {"display", "fit", ti3, "-o", ini, "--model", "day", NULL};
    char *check[] = {"display", "check", ini, ti3, "--json", NULL};
    write_panel();
    assert_int_equal(run(7, fit), COMMAND_FINE);
    assert_int_equal(run(5, check), COMMAND_FINE);
    assert_int_equal(unlink(ini), 0);
    assert_int_equal(run(4, fit), COMMAND_USAGE);
    write_ti3("", "1 50 50 50 20 20 20\n", 1);
    assert_int_equal(run(7, fit), COMMAND_USAGE);
    assert_int_equal(access(ini, F_OK), -1);
    assert_int_equal(run(5, check), COMMAND_USAGE);
}

static void the_measurements_are_not_overwritten(void **state)
{
    (void)state;
    char *same[] = {"display", "fit", ti3, "-o", ti3, NULL};
    struct measurements m;
    write_panel();
    assert_int_equal(run(5, same), COMMAND_USAGE);
    assert_int_equal(symlink(ti3, ini), 0);
    char *linked[] = {"display", "fit", ti3, "-o", ini, NULL};
    assert_int_equal(run(5, linked), COMMAND_USAGE);
    assert_int_equal(unlink(ini), 0);
    assert_true(measurements_load(ti3, &m, NULL));
    measurements_fini(&m);
}

static void a_white_that_is_a_little_wrong_is_a_warning(void **state)
{
    (void)state;
    char *fit[] = {"display", "fit", ti3, "-o", ini, "--model", "day", NULL};
    char *check[] = {"display", "check", ini, ti3, NULL};
    struct xyz white = panel((struct counts){1, 1, 1});
    const struct {
        double off;
        int code;
    } cases[] = {{1.02, COMMAND_FINE}, {1.05, COMMAND_WARNED}, {1.12, COMMAND_USAGE}};
    for (int i = 0; i < 3; i++) {
        char keywords[128];
        snprintf(keywords, sizeof keywords,
                 "NORMALIZED_TO_Y_100 \"NO\"\nLUMINANCE_XYZ_CDM2 \"%.4f %.4f %.4f\"",
                 white.X * cases[i].off, white.Y * cases[i].off, white.Z * cases[i].off);
        write_panel_as(keywords, 1);
        assert_int_equal(run(7, fit), cases[i].code);
        assert_int_equal(run(4, check), cases[i].code);
    }
    unlink(ini);
}

// Runs "check ini ti3 --json"; its mean.
static double checked(int expected)
{
    char *check[] = {"display", "check", ini, ti3, "--json", NULL};
    double mean = NAN;
    fflush(stdout);
    int out_kept = dup(1);
    assert_non_null(freopen(answer, "w", stdout));
    int code = run(5, check);
    fflush(stdout);
    dup2(out_kept, 1);
    close(out_kept);
    FILE *got = fopen(answer, "r");
    assert_int_equal(fscanf(got, "{\"mean\": %lf", &mean), 1);
    fclose(got);
    assert_int_equal(code, expected);
    return mean;
}

// What a command prints, as JSON; code is what it ends with.
static json_t *json_of(int count, char **argv, int *code)
{
    fflush(stdout);
    int kept = dup(1);
    assert_non_null(freopen(answer, "w", stdout));
    *code = run(count, argv);
    fflush(stdout);
    dup2(kept, 1);
    close(kept);
    json_t *facts = json_load_file(answer, 0, NULL);
    assert_non_null(facts);
    return facts;
}

static void the_fit_says_which_model_it_keeps_and_why(void **state)
{
    (void)state;
    char *fit[] = {"display", "fit", ti3, "--json", "--out", ini, "--model", "auto", NULL};
    const char *name;
    int code, folds, significant = 0;
    double day, kept;
    shared_loss = 0.35;
    write_panel();
    json_t *facts = json_of(8, fit, &code);
    shared_loss = 0;
    assert_int_equal(code, COMMAND_WARNED); // a matrix does not describe it
    assert_int_equal(json_unpack(facts, "{s:s,s:{s:i,s:{s:{s:f,s:b},s:{s:f}}}}", "model", &name,
                                 "cross_validation", "folds", &folds, "candidates", "day", "mean",
                                 &day, "significant", &significant, "interaction", "mean", &kept),
                     0);
    assert_string_not_equal(name, "day");
    assert_true(significant && folds > 1 && kept < day);
    assert_true(json_array_size(json_object_get(facts, "warnings")) == 1);
    json_decref(facts);
    unlink(ini);
}

static void an_unknown_model_is_refused(void **state)
{
    (void)state;
    char *fit[] = {"display", "fit", ti3, "-o", ini, "--model", "best", NULL};
    write_panel();
    assert_int_equal(run(7, fit), COMMAND_USAGE);
    assert_int_equal(access(ini, F_OK), -1);
}

static void relative_measurements_are_checked_at_their_own_white(void **state)
{
    (void)state;
    char *fit[] = {"display", "fit", ti3, "-o", ini, "--model", "day", NULL};
    write_panel();
    assert_int_equal(run(7, fit), COMMAND_FINE);
    double absolute = checked(COMMAND_FINE);
    write_panel_as("", 100 / panel((struct counts){1, 1, 1}).Y);
    assert_near(checked(COMMAND_WARNED), absolute, 1e-3); // by how far the fit misses white
    unlink(ini);
}

static void help_names_what_the_commands_take(void **state)
{
    (void)state;
    char *const names[] = {"fit", "check", "forward", "inverse"};
    for (int i = 0; i < 4; i++) {
        char *words[] = {"display", names[i], ini, "--help", NULL};
        assert_int_equal(run(4, words), COMMAND_FINE);
    }
}

// Runs forward or inverse on text as stdin; its stdout into out.
static int lines(const char *what, const char *text, char *out, size_t size)
{
    char *argv[] = {"display", (char *)what, ini, NULL};
    int in_kept = dup(0);
    int out_kept = dup(1);
    FILE *given = fopen(answer, "w");
    fputs(text, given);
    fclose(given);
    fflush(stdout);
    assert_non_null(freopen(answer, "r", stdin));
    unlink(answer);
    assert_non_null(freopen(answer, "w", stdout));
    int code = run(3, argv);
    fflush(stdout);
    dup2(in_kept, 0);
    dup2(out_kept, 1);
    close(in_kept);
    close(out_kept);
    FILE *got = fopen(answer, "r");
    out[fread(out, 1, size - 1, got)] = 0;
    fclose(got);
    return code;
}

static void forward_and_inverse_undo_each_other_line_by_line(void **state)
{
    (void)state;
    char out[256], back[256];
    double v[6];
    char *fit[] = {"display", "fit", ti3, "-o", ini, "--model", "day", NULL};
    write_panel();
    assert_int_equal(run(7, fit), COMMAND_FINE);
    assert_int_equal(lines("forward", "50 25 75\n100, 100, 100\n", out, sizeof out), COMMAND_FINE);
    assert_int_equal(lines("inverse", out, back, sizeof back), COMMAND_FINE);
    assert_int_equal(sscanf(back, "%lf %lf %lf %lf %lf %lf", v, v + 1, v + 2, v + 3, v + 4, v + 5),
                     6);
    assert_near(v[0], 50, PRINTED);
    assert_near(v[1], 25, PRINTED);
    assert_near(v[2], 75, PRINTED);
    assert_near(v[5], 100, PRINTED);
    assert_int_equal(lines("inverse", "2000 10 10\n", back, sizeof back), COMMAND_FINE);
    assert_non_null(strstr(back, " out-of-gamut\n"));
    assert_int_equal(lines("forward", "50 101 50\n", out, sizeof out), COMMAND_USAGE);
    assert_int_equal(lines("inverse", "1 2\n", out, sizeof out), COMMAND_USAGE);
    // A bad line leaves nothing of the good ones before it.
    assert_int_equal(lines("forward", "50 25 75\n50 25\n", out, sizeof out), COMMAND_USAGE);
    assert_string_equal(out, "");
    assert_int_equal(lines("inverse", "20 20 20\n1 2 x\n", out, sizeof out), COMMAND_USAGE);
    assert_string_equal(out, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(relative_values_become_absolute_through_the_luminance),
        cmocka_unit_test(without_luminance_the_white_patches_are_the_white),
        cmocka_unit_test(bad_files_are_refused_by_line_and_key),
        cmocka_unit_test(another_unit_of_rgb_is_named_as_such),
        cmocka_unit_test(the_white_rows_must_bear_the_luminance_out),
        cmocka_unit_test(a_day_model_is_found_again),
        cmocka_unit_test(noise_is_averaged_not_followed),
        cmocka_unit_test(a_panel_whose_channels_do_not_add_is_a_misfit),
        cmocka_unit_test(exchanged_columns_show_in_the_primaries),
        cmocka_unit_test(values_of_other_patches_are_no_display),
        cmocka_unit_test(too_few_patches_decide_nothing),
        cmocka_unit_test(the_commands_fit_and_refuse_with_their_exit_codes),
        cmocka_unit_test(the_measurements_are_not_overwritten),
        cmocka_unit_test(a_white_that_is_a_little_wrong_is_a_warning),
        cmocka_unit_test(the_fit_says_which_model_it_keeps_and_why),
        cmocka_unit_test(an_unknown_model_is_refused),
        cmocka_unit_test(relative_measurements_are_checked_at_their_own_white),
        cmocka_unit_test(help_names_what_the_commands_take),
        cmocka_unit_test(forward_and_inverse_undo_each_other_line_by_line),
    };
    return cmocka_run_group_tests(tests, make_folder, drop_folder);
}
