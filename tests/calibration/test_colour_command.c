// SPDX-License-Identifier: Apache-2.0
#include "calibration/commands.h"

#include <jansson.h>
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

#define PRINTED 5e-7 // six decimals
#define JSON 1e-8    // twelve significant digits of about 100

enum { WORDS = 16 };

static char folder[] = "/tmp/boothd-colour-XXXXXX";
static char said[65536], complained[4096];

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    char path[128];
    snprintf(path, sizeof path, "%s/stdin", folder);
    unlink(path);
    return rmdir(folder);
}

// A file of the test; the last eight paths stay good.
static const char *file(const char *name, const char *text)
{
    static char paths[8][128];
    static int next;
    char *path = paths[next++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fputs(text, out);
    fclose(out);
    return path;
}

static int divert(FILE *stream, FILE **into)
{
    *into = tmpfile();
    assert_non_null(*into);
    fflush(stream);
    int kept = dup(fileno(stream));
    dup2(fileno(*into), fileno(stream));
    return kept;
}

static void restore(FILE *stream, int kept, FILE *from, char *text, size_t size)
{
    fflush(stream);
    dup2(kept, fileno(stream));
    close(kept);
    rewind(from);
    text[fread(text, 1, size - 1, from)] = 0;
    fclose(from);
}

// Runs "boothcal colour WORDS" (separated by blanks) with that standard input.
static int run(const char *words, const char *input)
{
    char copy[1024], *argv[WORDS + 1] = {"colour"}, *rest = NULL;
    int argc = 1;
    snprintf(copy, sizeof copy, "%s", words);
    for (char *w = strtok_r(copy, " ", &rest); w && argc < WORDS; w = strtok_r(NULL, " ", &rest))
        argv[argc++] = w;
    assert_non_null(freopen(file("stdin", input ? input : ""), "r", stdin));
    FILE *out, *err;
    int kept_out = divert(stdout, &out), kept_err = divert(stderr, &err);
    int code = command_colour(argc, argv);
    restore(stderr, kept_err, err, complained, sizeof complained);
    restore(stdout, kept_out, out, said, sizeof said);
    return code;
}

// As run, with paths put into the words.
static int run_with(const char *format, const char *a, const char *b)
{
    char words[1024];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(words, sizeof words, format, a, b);
#pragma GCC diagnostic pop
    return run(words, NULL);
}

static void assert_one_line_says(const char *a, const char *b)
{
    const char *end = strchr(complained, '\n');
    assert_non_null(end);
    assert_true(end[1] == 0);
    if (!strstr(complained, a) || !strstr(complained, b))
        print_error("\"%s\" lacks \"%s\" or \"%s\"\n", complained, a, b);
    assert_non_null(strstr(complained, a));
    assert_non_null(strstr(complained, b));
    assert_string_equal(said, ""); // no partial output
}

static void deltae_reads_pairs_and_writes_differences(void **state)
{
    (void)state;
    assert_int_equal(run("deltae", "50 2.6772 -79.7751 50 0 -82.7485\n"
                                   "# a comment\n\n"
                                   "50,-0.0010,2.4900,50,0.0010,-2.4900\r\n"
                                   "2.0776;0.0795;-1.1350;0.9033;-0.0636;-0.5514"),
                     COMMAND_FINE);
    double a, b, c;
    assert_int_equal(sscanf(said, "%lf\n%lf\n%lf\n", &a, &b, &c), 3);
    assert_near(a, 2.0425, 1e-4); // Sharma's pairs 1, 14 and 34, four decimals
    assert_near(b, 4.8045, 1e-4);
    assert_near(c, 0.9082, 1e-4);
    assert_string_equal(complained, "");
}

static void deltae_reads_a_file_and_passes_over_its_header(void **state)
{
    (void)state;
    const char *path = file("pairs.csv", "L1,a1,b1,L2,a2,b2\n49,0,0,51,0,0\n");
    assert_int_equal(run_with("deltae %s", path, ""), COMMAND_FINE);
    assert_near(atof(said), 2, PRINTED);
    unlink(path);
}

static void deltae_wants_a_line_of_numbers(void **state)
{
    (void)state;
    static const char *const empty[] = {"", "\n# nothing\n", "a b c d e f\n", "L,a,b,L,a,b\r\n"};
    for (size_t i = 0; i < sizeof empty / sizeof *empty; i++) {
        assert_int_equal(run("deltae", empty[i]), COMMAND_USAGE);
        assert_one_line_says("stdin: no line of numbers", "L1 a1 b1 L2 a2 b2");
    }
}

static void deltae_passes_over_a_mark_and_a_first_line_of_names(void **state)
{
    (void)state;
    assert_int_equal(run("deltae", "\xef\xbb\xbf 50 0 0 52 0 0\n"), COMMAND_FINE);
    assert_near(atof(said), 2, 0.1); // lightness weighs about 1 at 50
    assert_int_equal(run("deltae", "# pairs\nL1;a1;b1;L2;a2;b2;DE00\n50;0;0;50;0;0\n"),
                     COMMAND_FINE);
    assert_near(atof(said), 0, 0);
}

static void deltae_does_not_guess_at_decimal_commas(void **state)
{
    (void)state;
    static const char *const bad[] = {"1,5 2,5 3,5\n", "1,5; 2; 3; 4; 5; 6\n", "1,5\t2,5\t3,5\n",
                                      "50 0 0 51 0 0,5\n"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(run("deltae", bad[i]), COMMAND_USAGE);
        assert_one_line_says("stdin:1:", "decimal comma");
    }
    assert_int_equal(run("deltae", " 50,0,0,50,0,0 \n"), COMMAND_FINE);
    assert_int_equal(run("deltae", "50, 0, 0, 50, 0, 0\n"), COMMAND_FINE);
}

// As run, with bytes as standard input.
static int run_bytes(const char *words, const char *bytes, size_t size)
{
    char path[128];
    snprintf(path, sizeof path, "%s/bytes", folder);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    assert_int_equal(fwrite(bytes, 1, size, out), size);
    fclose(out);
    char line[256];
    snprintf(line, sizeof line, "%s %s", words, path);
    int code = run(line, NULL);
    unlink(path);
    return code;
}

static void deltae_refuses_what_is_no_text(void **state)
{
    (void)state;
    static const char NUL[] = "50 0 0 51 0 0\n50 0\0 0 51 0 0\n";
    assert_int_equal(run_bytes("deltae", NUL, sizeof NUL - 1), COMMAND_USAGE);
    assert_one_line_says("bytes:2:", "0x00");
    size_t size = (1 << 20) + 1;
    char *line = malloc(size);
    memset(line, '5', size);
    assert_int_equal(run_bytes("deltae", line, size), COMMAND_USAGE);
    assert_one_line_says("bytes:1:", "longer than 1048576 bytes");
    free(line);
    assert_int_equal(run_with("deltae %s", folder, ""), COMMAND_USAGE);
    assert_one_line_says(folder, "directory");
}

static void deltae_refuses_bad_lines_by_number_without_partial_output(void **state)
{
    (void)state;
    const char *good = "50 0 0 51 0 0\n";
    static const struct {
        const char *line, *says;
    } bad[] = {
        {"1 2 3 4 5\n", "5 number(s)"},   {"1 2 3 4 5 6 7\n", "more than 6"},
        {"1 2 3 4 5 x\n", "\"x\""},       {"1 2 nan 4 5 6\n", "\"nan\""},
        {"1 2 inf 4 5 6\n", "\"inf\""},   {"L a b L a b\n", "\"L\""},
        {"1 2 3 4 5 6e999\n", "6e999"},   {"1 2 3 4 5 6,5x\n", "decimal comma"},
        {"1 2 3.5.1 4 5 6\n", "3.5.1"}, {"0x1 0x2 0x3 0x4 0x5 0x6\n", "0x1"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char input[256];
        snprintf(input, sizeof input, "%s%s%s", good, bad[i].line, good);
        assert_int_equal(run("deltae", input), COMMAND_USAGE);
        assert_one_line_says("stdin:2:", bad[i].says);
    }
    assert_int_equal(run("deltae /nowhere/pairs", ""), COMMAND_USAGE);
    assert_one_line_says("/nowhere/pairs", "No such file");
}

// ---- spectrum ----------------------------------------------------------------

static json_t *rows(void)
{
    json_t *all = json_loads(said, 0, NULL);
    assert_non_null(all);
    json_t *list = json_incref(json_object_get(all, "rows"));
    json_decref(all);
    assert_true(json_is_array(list));
    return list;
}

static double number(const json_t *row, const char *key, size_t i)
{
    const json_t *v = json_object_get(row, key);
    return json_number_value(json_is_array(v) ? json_array_get(v, i) : v);
}

static void a_lamp_shows_itself_as_white(void **state)
{
    (void)state;
    assert_int_equal(run("spectrum --light D65 --json", NULL), COMMAND_FINE);
    json_t *list = rows(), *row = json_array_get(list, 0);
    assert_int_equal(json_array_size(list), 1);
    assert_string_equal(json_string_value(json_object_get(row, "name")), "D65");
    assert_near(number(row, "XYZ", 0), 95.047, 2e-3); // CIE 015: 95.04, 100, 108.88
    assert_near(number(row, "XYZ", 1), 100, JSON);
    assert_near(number(row, "XYZ", 2), 108.883, 4e-3);
    assert_near(number(row, "Lab", 0), 100, JSON);
    assert_near(number(row, "Lab", 1), 0, JSON);
    assert_near(number(row, "xy", 0), 0.31272, 1e-5);
    assert_near(number(row, "xy", 1), 0.32903, 1e-5);
    assert_near(number(row, "CCT", 0), 6503, 1);
    assert_near(number(row, "Duv", 0), 0.0032, 1e-4);
    json_decref(list);
}

static void surfaces_are_seen_under_the_lamp(void **state)
{
    (void)state;
    const char *table = file("grey.csv", "nm,white,grey,black\n380,1,.2,0\n780,1,.2,0\n");
    assert_int_equal(run_with("spectrum --light FL8 --reflectance %s --json", table, ""),
                     COMMAND_FINE);
    unlink(table);
    json_t *list = rows();
    assert_int_equal(json_array_size(list), 3);
    const json_t *grey = json_array_get(list, 1), *black = json_array_get(list, 2);
    assert_near(number(json_array_get(list, 0), "XYZ", 1), 100, JSON);
    assert_near(number(grey, "XYZ", 1), 20, JSON);
    assert_near(number(grey, "Lab", 1), 0, JSON);
    assert_near(number(black, "Lab", 0), 0, JSON);
    assert_near(number(black, "xy", 0), 0, 0);
    assert_true(json_is_null(json_object_get(black, "CCT"))); // black has no temperature
    assert_true(json_is_null(json_object_get(black, "Duv")));
    json_decref(list);
}

static void observers_differ_and_cct_stays_that_of_1931(void **state)
{
    (void)state;
    double y[2], cct[2];
    const char *const words[] = {"spectrum --light FL11 --json",
                                 "spectrum --light FL11 --observer 2015-10 --json"};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(run(words[i], NULL), COMMAND_FINE);
        json_t *list = rows();
        y[i] = number(json_array_get(list, 0), "xy", 1);
        cct[i] = number(json_array_get(list, 0), "CCT", 0);
        json_decref(list);
    }
    assert_true(fabs(y[0] - y[1]) > 0.001);
    assert_near(cct[0], cct[1], 1e-6);
}

static void six_bands_come_near_to_the_full_spectrum(void **state)
{
    (void)state;
    const char *table = file("smooth.csv", "400,.1,.8\n430,.2,.7\n460,.2,.6\n500,.3,.5\n530,.4,.4\n560,.5,"
                                          ".3\n600,.6,.2\n630,.6,.2\n660,.6,.2\n700,.5,.3\n");
    const char *const modes[] = {"full", "bands", "product"};
    struct xyz seen[3];
    for (int i = 0; i < 3; i++) {
        assert_int_equal(run_with("spectrum --light D50 --reflectance %s --mode %s --json", table,
                                  modes[i]),
                         COMMAND_FINE);
        json_t *list = rows(), *row = json_array_get(list, 0);
        seen[i] = (struct xyz){number(row, "XYZ", 0), number(row, "XYZ", 1), number(row, "XYZ", 2)};
        json_decref(list);
    }
    unlink(table);
    assert_near(seen[1].Y / seen[0].Y, 1, 0.01); // hundredths: far looser than the fit
    assert_near(seen[2].Y / seen[0].Y, 1, 0.05); // the published method is coarser
    assert_true(seen[1].Y != seen[0].Y && seen[2].Y != seen[1].Y);
}

static void bands_may_come_from_a_file(void **state)
{
    (void)state;
    const char *bands = file("three.ini", "[bands]\ncount = 3\ncentre_nm = 450 550 610\n"
                                          "width_nm = 25 35 35\n");
    assert_int_equal(run_with("spectrum --light D65 --bands %s --json", bands, ""), COMMAND_FINE);
    json_t *list = rows();
    assert_near(number(json_array_get(list, 0), "XYZ", 1), 100, 1e-6); // the white is exact
    json_decref(list);
    unlink(bands);
    bands = file("two.ini", "[bands]\ncount = 3\ncentre_nm = 450 550\nwidth_nm = 25 35 35\n");
    assert_int_equal(run_with("spectrum --light D65 --bands %s", bands, ""), COMMAND_USAGE);
    assert_one_line_says("two.ini", "centre_nm");
    unlink(bands);
    bands = file("wide.ini", "[bands]\ncount = 3\ncentre_nm = 450 550 900\nwidth_nm = 25 35 35\n");
    assert_int_equal(run_with("spectrum --light D65 --bands %s", bands, ""), COMMAND_USAGE);
    assert_one_line_says("wide.ini", "900");
    unlink(bands);
}

static void text_output_has_a_line_for_each_row(void **state)
{
    (void)state;
    const char *lamps = file("lamps.csv", "nm,one,two\n400,1,2\n700,1,2\n");
    assert_int_equal(run_with("spectrum --light %s", lamps, ""), COMMAND_FINE);
    unlink(lamps);
    int lines = 0;
    for (const char *c = said; *c; c++)
        lines += *c == '\n';
    assert_int_equal(lines, 3);
    assert_non_null(strstr(said, "\none "));
    assert_non_null(strstr(said, "\ntwo "));
}

static void bad_words_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *words, *says;
    } bad[] = {
        {"spectrum", "--light"},
        {"spectrum --light", "--light"},
        {"spectrum --light A --observer 1931", "1964-10"},
        {"spectrum --light A --mode six", "product"},
        {"spectrum --light A --lamp B", "--lamp"},
        {"spectrum --light A B", "B"},
        {"spectrum --light A --mode full --bands 6", "--bands"},
        {"spectrum --light A --bands 2", "3..16"},
        {"spectrum --light A --bands 0", "boothcal: --bands: 0 bands: outside"},
        {"spectrum --light XYZ", "FL3.15"},
        {"spectrum --light D3000K", "4000"},
        {"spectrum --light /nowhere/lamp.csv", "/nowhere/lamp.csv"},
        {"spectrum --light A --reflectance /nowhere/table.csv", "/nowhere/table.csv"},
        {"spectrum --light A --bands /nowhere/bands.ini", "/nowhere/bands.ini"},
        {"colours", "colours"},
        {"deltae a b", "usage"},
        {"deltae --json", "usage"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(run(bad[i].words, NULL), COMMAND_USAGE);
        assert_one_line_says(bad[i].says, "");
    }
}

static void bad_files_are_refused_with_place_and_reason(void **state)
{
    (void)state;
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"nm,v\n400,1\n380,1\n700,1\n", ":3:"}, {"nm,v\n400,1\n500,nan\n700,1\n", ":3:"},
        {"nm,v\n.4,1\n.5,1\n.7,1\n", "nanometres"}, {"nm,v\n400,1\n500,-1\n700,1\n", ":3:"},
        {"nm,v\n400,0\n500,0\n700,0\n", "no light"}, {"", "bad.csv"},
        {"nm,v\n380,1e-320\n780,1e-320\n", ":2: v: 9.99989e-321"},
        {"nm,v,w\n380,1,1e300\n780,1,1e300\n", ":2: w: 1e+300"},
        {"nm,v\n380,1\n425,1\n", "380..425"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *path = file("bad.csv", bad[i].text);
        assert_int_equal(run_with("spectrum --json --light %s", path, ""), COMMAND_USAGE);
        assert_one_line_says("bad.csv", bad[i].says);
        unlink(path);
    }
    const char *path = file("many.csv", "400,1,1\n700,1,1\n"), *r = file("r.csv", "400,1\n700,1\n");
    assert_int_equal(run_with("spectrum --light %s --reflectance %s", path, r), COMMAND_USAGE);
    assert_one_line_says("many.csv", "2 spectra");
    unlink(path);
    unlink(r);
}

static void a_surface_that_fluoresces_is_a_warning(void **state)
{
    (void)state;
    const char *table = file("paper.csv", "nm,paper\n380,1.2\n780,1.2\n");
    assert_int_equal(run_with("spectrum --light D50 --reflectance %s --json", table, ""),
                     COMMAND_WARNED);
    assert_non_null(strstr(complained, "warning: "));
    assert_non_null(strstr(complained, "paper: 1.2 at 380 nm"));
    json_t *list = rows();
    assert_near(number(json_array_get(list, 0), "XYZ", 1), 120, JSON);
    json_decref(list);
    unlink(table);
}

static void help_names_every_option(void **state)
{
    (void)state;
    static const char *const options[] = {"--light", "--reflectance", "--observer", "--mode",
                                          "--bands", "--json"};
    assert_int_equal(run("spectrum --light A --help", NULL), COMMAND_FINE);
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        assert_non_null(strstr(said, options[i]));
}

static void help_is_given(void **state)
{
    (void)state;
    const char *const words[] = {"--help", "deltae --help", "spectrum --help", "deltae -h"};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(run(words[i], NULL), COMMAND_FINE);
        assert_non_null(strstr(said, "usage"));
        assert_string_equal(complained, "");
    }
    assert_int_equal(run("", NULL), COMMAND_USAGE);
    assert_non_null(strstr(complained, "usage"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(deltae_reads_pairs_and_writes_differences),
        cmocka_unit_test(deltae_reads_a_file_and_passes_over_its_header),
        cmocka_unit_test(deltae_wants_a_line_of_numbers),
        cmocka_unit_test(deltae_passes_over_a_mark_and_a_first_line_of_names),
        cmocka_unit_test(deltae_does_not_guess_at_decimal_commas),
        cmocka_unit_test(deltae_refuses_what_is_no_text),
        cmocka_unit_test(deltae_refuses_bad_lines_by_number_without_partial_output),
        cmocka_unit_test(a_lamp_shows_itself_as_white),
        cmocka_unit_test(surfaces_are_seen_under_the_lamp),
        cmocka_unit_test(observers_differ_and_cct_stays_that_of_1931),
        cmocka_unit_test(six_bands_come_near_to_the_full_spectrum),
        cmocka_unit_test(bands_may_come_from_a_file),
        cmocka_unit_test(text_output_has_a_line_for_each_row),
        cmocka_unit_test(bad_words_are_refused),
        cmocka_unit_test(bad_files_are_refused_with_place_and_reason),
        cmocka_unit_test(a_surface_that_fluoresces_is_a_warning),
        cmocka_unit_test(help_names_every_option),
        cmocka_unit_test(help_is_given),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
