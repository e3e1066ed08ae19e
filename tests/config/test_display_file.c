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

#include "config/display_file.h"

#include <cmocka.h>

#include "tests/fakes/near.h"

static char folder[] = "/tmp/boothd-display-XXXXXX";
static char path[64];

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(path, sizeof path, "%s/d.ini", folder);
    return 0;
}

static int drop_folder(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder);
}

static struct display_model model(void)
{
    struct display_model m = {.name = "Panel 7",
                              .matrix = {{410.1, 350.7, 180.3, 0.31},
                                         {212.6, 715.2, 72.2, 0.30},
                                         {19.3, 119.2, 950.5, 0.44}}};
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < DISPLAY_NODES; k++)
            m.curve[c][k] = pow(k / 1020.0, 2.1 + c / 10.0);
        display_curve_repair(m.curve[c]);
    }
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static const struct display_origin origin = {.instrument = "PR-655 1",
                                             .date = "2026-01-31T12:34:56Z",
                                             .software = "boothd",
                                             .source = "train.ti3",
                                             .patches = 300,
                                             .fit_mean_de00 = 0.25,
                                             .fit_max_de00 = 1.5};

static void write_with(const char *from, const char *to)
{
    char *text = NULL;
    size_t size = 0;
    FILE *in = fopen(path, "r");
    assert_non_null(in);
    assert_true(getdelim(&text, &size, 0, in) > 0);
    fclose(in);
    char *at = strstr(text, from);
    assert_non_null(at);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fprintf(out, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
    fclose(out);
    free(text);
}

static void refused(const char *from, const char *to, const char *says)
{
    struct display_model m = model();
    struct display_model untouched = {.condition = -1};
    struct error err = {0};
    assert_true(display_save(path, &m, &origin, &err));
    write_with(from, to);
    assert_false(display_load(path, &untouched, NULL, &err));
    assert_non_null(strstr(err.text, path));
    assert_non_null(strstr(err.text, says));
    assert_near(untouched.condition, -1, 0);
}

static void what_is_saved_is_loaded_to_the_last_bit(void **state)
{
    (void)state;
    struct display_model m = model();
    struct display_model loaded = {0};
    struct display_origin from = {0};
    struct error err = {0};
    assert_true(display_save(path, &m, &origin, &err));
    assert_true(display_load(path, &loaded, &from, &err));
    m.residual.least = (struct vec3){0, -100, -100}; // not in the file: its presets
    m.residual.most = (struct vec3){100, 100, 100};
    assert_memory_equal(&loaded, &m, sizeof m);
    assert_memory_equal(&from, &origin, sizeof from);
}

static void check_kept(const struct display_model *m)
{
    struct display_model loaded = {0};
    struct error err = {0};
    assert_true(display_save(path, m, &origin, &err));
    if (!display_load(path, &loaded, NULL, &err))
        fail_msg("%s", err.text);
    assert_memory_equal(&loaded, m, sizeof *m);
}

static struct display_model interacting(void)
{
    struct display_model m = model();
    m.kind = DISPLAY_INTERACTION;
    for (int i = 0; i < 3; i++)
        for (int t = 0; t < DISPLAY_TERMS; t++)
            m.interaction[i][t] = 0.1 * i - 1.0 / 3 * t;
    m.residual.least = (struct vec3){0, -100, -100}; // as the file presets them
    m.residual.most = (struct vec3){100, 100, 100};
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static struct display_model corrected(void)
{
    struct display_model m = model();
    m.kind = DISPLAY_RESIDUAL;
    m.residual.least = (struct vec3){0, -99.5, -115.25};
    m.residual.most = (struct vec3){100, 98.1, 97};
    for (int k = 0; k < LATTICE_NODES; k++)
        for (int n = 0; n < 3; n++)
            m.residual.node[k][n] = sin(k + n) / 3;
    assert_true(display_model_prepare(&m, NULL));
    return m;
}

static void every_kind_is_kept_to_the_last_bit(void **state)
{
    (void)state;
    struct display_model m = interacting();
    check_kept(&m);
    m = corrected();
    check_kept(&m);
}

static void the_uncertainty_is_kept_with_the_modes_there_are(void **state)
{
    (void)state;
    struct display_model m = interacting(), loaded = {0};
    struct display_origin from = origin, back = {0};
    struct error err = {0};
    from.uncertainty = (struct display_uncertainty){.modes = 3,
                                                    .smooth_de00 = 0.12,
                                                    .length_lab = 16,
                                                    .local_de00 = 0.08,
                                                    .neutral_de00 = 0.05,
                                                    .noise_de00 = 0.02};
    for (int k = 0; k < 3; k++)
        for (int p = 0; p < UNCERTAINTY_PLACES; p++)
            for (int n = 0; n < 3; n++)
                from.uncertainty.mode[k][p][n] = (100 * k + p - 30 * n) * 1e-4;
    assert_true(display_save(path, &m, &from, &err));
    assert_true(display_load(path, &loaded, &back, &err));
    assert_memory_equal(&back, &from, sizeof back);
}

static void a_file_without_a_model_key_is_plain_day(void **state)
{
    (void)state;
    struct display_model m = model(), loaded = interacting();
    struct error err = {0};
    assert_true(display_save(path, &m, &origin, &err));
    write_with("model = day\n", "");
    assert_true(display_load(path, &loaded, NULL, &err));
    assert_int_equal(loaded.kind, DISPLAY_DAY);
}

static void an_addition_that_folds_is_refused_by_its_section(void **state)
{
    (void)state;
    struct display_model m = corrected();
    struct error err = {0};
    assert_true(display_save(path, &m, &origin, &err));
    write_with("node_333 = ", "node_333 = 900 0 0\n#");
    assert_false(display_load(path, &m, NULL, &err));
    assert_non_null(strstr(err.text, ":3: [residual]: residual: two inputs"));
    m = interacting();
    m.interaction[1][2] = 5000;
    assert_true(display_save(path, &m, &origin, &err));
    assert_false(display_load(path, &m, NULL, &err));
    assert_non_null(strstr(err.text, ":3: [interaction]: interaction: two inputs"));
    write_with("model = interaction", "model = daily");
    assert_false(display_load(path, &m, NULL, &err));
    assert_non_null(strstr(err.text, "daily"));
}

static void texts_an_ini_cannot_hold_are_made_plain(void **state)
{
    (void)state;
    struct display_model m = model();
    struct display_origin from = origin;
    struct error err = {0};
    strcpy(from.instrument, " i1\nDisplay\xff ");
    assert_true(display_save(path, &m, &from, &err));
    assert_true(display_load(path, &m, &from, &err));
    assert_string_equal(from.instrument, "i1?Display?");
}

static void a_curve_that_falls_is_refused(void **state)
{
    (void)state;
    refused("node_0500 = 0", "node_0500 = 0.9 0.9 0.9\n#", "does not rise");
    char place[32];
    FILE *in = fopen(path, "r");
    char *line = NULL;
    size_t room = 0;
    int number = 1;
    while (getline(&line, &room, in) > 0 && strncmp(line, "node_0501", 9))
        number++;
    fclose(in);
    free(line);
    snprintf(place, sizeof place, ":%d: [curves]", number);
    refused("node_0500 = 0", "node_0500 = 0.9 0.9 0.9\n#", place);
}

static void a_missing_node_is_refused_by_name(void **state)
{
    (void)state;
    refused("node_0012 =", "# node_0012 =", "node_0012");
}

static void nan_in_the_matrix_is_refused_by_name(void **state)
{
    (void)state;
    refused("Y = ", "Y = nan ", "Y");
}

static void primaries_alike_are_refused(void **state)
{
    (void)state;
    struct display_model m = model();
    struct error err = {0};
    for (int i = 0; i < 3; i++)
        m.matrix[i][1] = m.matrix[i][0] * 1.01;
    assert_true(display_save(path, &m, &origin, &err));
    assert_false(display_load(path, &m, NULL, &err));
    assert_non_null(strstr(err.text, "condition"));
    assert_non_null(strstr(err.text, ": [matrix]: "));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_saved_is_loaded_to_the_last_bit),
        cmocka_unit_test(every_kind_is_kept_to_the_last_bit),
        cmocka_unit_test(the_uncertainty_is_kept_with_the_modes_there_are),
        cmocka_unit_test(a_file_without_a_model_key_is_plain_day),
        cmocka_unit_test(an_addition_that_folds_is_refused_by_its_section),
        cmocka_unit_test(texts_an_ini_cannot_hold_are_made_plain),
        cmocka_unit_test(a_curve_that_falls_is_refused),
        cmocka_unit_test(a_missing_node_is_refused_by_name),
        cmocka_unit_test(nan_in_the_matrix_is_refused_by_name),
        cmocka_unit_test(primaries_alike_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, drop_folder);
}
