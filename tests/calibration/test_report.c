// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration/commands.h"
#include "calibration/facts_json.h"
#include "calibration/proof.h"
#include "calibration/report_steps.h"
#include "config/display_file.h"
#include "files/exr.h"
#include "files/write.h"

// cmocka defines a macro named fail: it comes last.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail

#include "tests/fakes/folder.h"
#include "tests/fakes/near.h"

enum { PATCHES = 3, DRAWS = 400, OUT = 2 }; // patch OUT is out of gamut
#define HALF_CODE 0.02                      // relative, of light at gamma 2.2
#define CODE_STEP 0.01                      // of a search that ends at 1e-4 of full code, dE00
#define READ_BACK 1e-8                      // nine digits

static struct session_facts *facts;
static struct folder folder;

// A display of gamma 2.2 and sRGB primaries, white 500 cd/m2.
static void make_model(struct display_model *m)
{
    static const double rgb[3][3] = {
        {0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
    *m = (struct display_model){.name = "panel"};
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < DISPLAY_NODES; i++)
            m->curve[c][i] = pow((double)i / (DISPLAY_NODES - 1), 2.2);
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < 3; c++)
            m->matrix[i][c] = 500 * rgb[i][c];
        m->matrix[i][3] = 0.2;
    }
    for (int c = 0; c < 3; c++)
        assert_int_equal(display_curve_repair(m->curve[c]), 0);
    assert_true(display_model_prepare(m, NULL));
}

static void make_map(const char *path)
{
    struct exr image;
    assert_true(exr_init(&image, 16, 12, 1, NULL));
    snprintf(image.names[0], sizeof image.names[0], "Y");
    for (int i = 0; i < 16 * 12; i++)
        image.pixels[i] = 3000;
    assert_true(exr_save(path, &image, NULL));
    exr_fini(&image);
}

static struct xyz scaled(struct xyz c, double k)
{
    return (struct xyz){k * c.X, k * c.Y, k * c.Z};
}

static void make_patch(struct lamp_report *lamp, int i, const struct display_model *model)
{
    struct patch_report *p = &lamp->patches[i];
    struct chart_report *c = &facts->chart[i];
    snprintf(p->name, sizeof p->name, "%s", i ? i == OUT ? "out" : "a<b" : "white");
    memcpy(c->name, p->name, sizeof c->name);
    for (int k = 0; k < SPECTRUM_COUNT; k++)
        c->reflectance.v[k] = i == OUT ? (k > 220 ? 0.9 : 0.0) : 0.9 - 0.6 * i;
    p->full = p->bands = xyz_relative(&lamp->irradiance, &c->reflectance, OBSERVER_1931_2);
    p->expected = p->aimed = p->reference = scaled(p->full, lamp->proof_lux / 100 / M_PI);
    struct display_inverse inverse = display_invert(model, p->aimed);
    p->counts = inverse.counts;
    p->in_gamut = inverse.in_gamut;
    p->predicted = display_forward(model, p->counts);
    p->measured = scaled(p->predicted, 1.004);
    p->reading = i;
}

static int a_session_of_three_patches(void **state)
{
    (void)state;
    struct display_model *model = calloc(1, sizeof *model);
    struct display_origin origin = {.patches = 20};
    facts = calloc(1, sizeof *facts);
    folder_open(&folder);
    make_model(model);
    strcpy(facts->booth, "booth <7> & co");
    strcpy(facts->observer, "1931-2");
    facts->emulated = true;
    facts->lamp_count = facts->pose_count = 1;
    facts->poses[0].moved_screen = true;
    facts->chart_count = PATCHES;
    facts->place = (struct place_report){.screen = {0.5, 0.3, 100, 60},
                                         .tilt_deg = 20,
                                         .eye = {0, 0.5, 0.6},
                                         .centre_m = {0, 0.8, 0},
                                         .width_m = 0.9,
                                         .depth_m = 0.6,
                                         .bits = 8};
    facts->display.residual = (struct vec3){0.1, 0.2, 0.2};
    snprintf(facts->display.model, sizeof facts->display.model, "%s",
             folder_at(&folder, "display.ini"));
    assert_true(display_save(facts->display.model, model, &origin, NULL));
    struct lamp_report *lamp = &facts->lamps[0];
    strcpy(lamp->name, "D65");
    snprintf(lamp->map, sizeof lamp->map, "%s", folder_at(&folder, "map.exr"));
    make_map(lamp->map);
    lamp->map_scale = 1;
    lamp->proof_lux = 1000;
    lamp->patch_count = PATCHES;
    lamp->gains[0] = lamp->gains[1] = lamp->gains[2] = lamp->gains[3] = 1;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        lamp->irradiance.v[i] = 0.01;
    lamp->white_taught = xyz_relative(&lamp->irradiance, NULL, OBSERVER_1931_2);
    lamp->white_reference = scaled(lamp->white_taught, lamp->proof_lux / 100 / M_PI);
    lamp->white_measured = lamp->white_reference;
    lamp->black_shown = display_black(model);
    for (int i = 0; i < PATCHES; i++)
        make_patch(lamp, i, model);
    facts->settings = json_pack("{s{s{ss}}}", "settings", "quality", "spectral", "auto");
    facts->readings = json_pack("[{ss},{ss},{ss}]", "what", "white", "what", "a<b", "what", "out");
    free(model);
    folder_put(&folder, "verify.ti3", "CTI3\n");
    assert_true(facts_save(facts, folder_at(&folder, "session.json"), NULL));
    return proof_judge(lamp, NULL) ? 0 : -1;
}

static int done(void **state)
{
    (void)state;
    facts_fini(facts);
    free(facts);
    folder_close(&folder);
    return 0;
}

static struct report *made(void)
{
    struct report *r = calloc(1, sizeof *r);
    assert_true(report_make(facts, folder.path, NULL, DRAWS, r, NULL));
    return r;
}

static void finished(struct report *r)
{
    report_fini(r);
    free(r);
}

static void facts_come_back_from_their_file(void **state)
{
    (void)state;
    struct session_facts *back = calloc(1, sizeof *back);
    const char *path = folder_at(&folder, "again.json");
    assert_true(facts_save(facts, path, NULL));
    assert_true(facts_load(path, back, NULL));
    assert_string_equal(back->booth, facts->booth);
    assert_int_equal(back->lamps[0].patch_count, PATCHES);
    assert_string_equal(back->lamps[0].patches[1].name, "a<b");
    const struct patch_report *a = &facts->lamps[0].patches[OUT], *b = &back->lamps[0].patches[OUT];
    assert_near(b->measured.Z / a->measured.Z, 1, READ_BACK);
    assert_near(b->counts.r, a->counts.r, READ_BACK);
    assert_true(b->in_gamut == a->in_gamut);
    assert_near(back->chart[OUT].reflectance.v[300], 0.9, READ_BACK);
    assert_true(json_equal(back->readings, facts->readings));
    facts_fini(back);
    struct error err = {0};
    assert_false(facts_load(folder_put(&folder, "no.json", "{\"kind\": \"other\"}"), back, &err));
    assert_int_equal(err.code, ERROR_DATA);
    free(back);
}

static void every_difference_has_its_uncertainty(void **state)
{
    (void)state;
    struct report *r = made();
    const struct report_lamp *l = &r->lamps[0];
    assert_true(l->budgeted);
    assert_int_equal(l->measured.count, PATCHES);
    for (int i = 0; i < PATCHES; i++) {
        assert_true(l->measured.absolute[i].E.u > 0);
        assert_true(l->shown.absolute[i].E.u > 0);
        assert_true(l->measured.absolute[i].L.share[CAUSE_DISPLAY_MODEL] == 0);
    }
    assert_near(l->measured.absolute[1].E.value, facts->lamps[0].patches[1].de_absolute, 1e-6);
    assert_near(l->measured.published[1].E.value, facts->lamps[0].patches[1].de_published, 1e-6);
    finished(r);
}

static void the_floor_is_what_the_closest_colour_leaves(void **state)
{
    (void)state;
    struct report *r = made();
    const struct patch_report *p = &facts->lamps[0].patches[OUT];
    const struct report_patch *own = &r->lamps[0].patches[OUT];
    assert_false(p->in_gamut);
    assert_true(own->floor_absolute > 1);
    assert_true(own->floor_absolute <= own->steps[STEP_GAMUT] + CODE_STEP);
    for (int i = 0; i < OUT; i++) {
        assert_true(facts->lamps[0].patches[i].in_gamut);
        assert_true(r->lamps[0].patches[i].floor_absolute == 0);
        assert_true(r->lamps[0].patches[i].steps[STEP_GAMUT] == 0);
    }
    assert_int_equal(r->lamps[0].absolute_out.n, 1);
    assert_int_equal(r->lamps[0].worst[0], OUT);
    finished(r);
}

static void steps_name_what_was_done_wrong(void **state)
{
    (void)state;
    struct lamp_report lamp = facts->lamps[0];
    struct report_lamp *own = calloc(1, sizeof *own);
    struct display_model *model = calloc(1, sizeof *model);
    make_model(model);
    lamp.patches[1].aimed = scaled(lamp.patches[1].expected, 1.02);
    lamp.patches[0].measured = scaled(lamp.patches[0].predicted, 0.97);
    lamp.black_shown.Y += 0.5;
    report_steps(facts, &lamp, model, own);
    assert_true(own->patches[1].steps[STEP_SPECTRAL] > 0.3);
    assert_true(own->patches[0].steps[STEP_SPECTRAL] == 0);
    assert_true(own->patches[0].steps[STEP_MODEL] > 0.4);
    assert_true(own->patches[0].steps[STEP_FLARE] > 0.01);
    assert_near(own->black_shown - own->black_expected, 0.5, 1e-9);
    free(model);
    free(own);
}

static void a_code_is_worth_its_slope(void **state)
{
    (void)state;
    struct display_model *model = calloc(1, sizeof *model);
    make_model(model);
    struct counts c = {0.5, 0.5, 0.5};
    struct mat3 by = report_by_code(&facts->lamps[0], model, c, 8);
    double slope = 2.2 * pow(0.5, 1.2) / 255 * 500 * 0.7152;
    assert_near(by.m[1][1] / slope, 1, HALF_CODE);
    free(model);
}

static void the_json_report_holds_every_figure_and_every_raw_reading(void **state)
{
    (void)state;
    struct report *r = made();
    json_t *report = report_as_json(r);
    assert_non_null(report);
    const json_t *lamp = json_array_get(json_object_get(report, "lamps"), 0);
    const json_t *patch = json_array_get(json_object_get(lamp, "patches"), 1);
    assert_near(json_number_value(json_object_get(patch, "de00_published")),
                facts->lamps[0].patches[1].de_published, 1e-12);
    assert_int_equal(json_array_size(json_object_get(report, "readings")), PATCHES);
    assert_int_equal(json_array_size(json_object_get(lamp, "irradiance_360_830_W_m2_nm")),
                     SPECTRUM_COUNT);
    assert_string_equal(json_string_value(json_object_get(report, "observer")), "1931-2");
    assert_true(json_is_true(json_object_get(report, "emulated")));
    assert_int_equal(json_array_size(json_object_get(report, "published_mean_std_p90_max")), 3);
    const json_t *budget = json_object_get(lamp, "budget_measured");
    assert_int_equal(json_array_size(json_object_get(budget, "absolute")), PATCHES);
    assert_int_equal(json_array_size(json_object_get(report, "causes")), CAUSES);
    assert_int_equal(json_array_size(json_object_get(report, "inputs")),
                     4); // facts, model, map, verify.ti3
    json_decref(report);
    finished(r);
}

static const char *const FORMS[] = {"report.json", "report.txt", "report.html", "report.pdf"};

static void every_form_is_written_and_sealed(void **state)
{
    (void)state;
    struct report *r = made();
    struct error err = {0};
    if (!report_save(r, folder.path, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    for (int i = 0; i < 4; i++) {
        size_t size;
        char *text = file_read(folder_at(&folder, FORMS[i]), 1 << 26, &size, NULL);
        assert_non_null(text);
        assert_true(seal_check(text, size, NULL, NULL));
        free(text);
    }
    finished(r);
}

static void the_html_report_fetches_nothing_and_names_cannot_break_it(void **state)
{
    (void)state;
    size_t size;
    char *text = file_read(folder_at(&folder, "report.html"), 1 << 26, &size, NULL);
    assert_null(strstr(text, "http"));
    assert_null(strstr(text, "<script"));
    assert_non_null(strstr(text, "Emulated instruments"));
    assert_non_null(strstr(text, "published: six-channel simulation"));
    assert_null(strstr(text, "a<b"));
    assert_non_null(strstr(text, "a&lt;b"));
    assert_non_null(strstr(text, "booth &lt;7&gt; &amp; co"));
    free(text);
}

static void without_map_or_model_it_says_what_is_not_computed(void **state)
{
    (void)state;
    struct lamp_report *lamp = &facts->lamps[0];
    char map[sizeof lamp->map], model[sizeof facts->display.model];
    memcpy(map, lamp->map, sizeof map);
    memcpy(model, facts->display.model, sizeof model);
    strcpy(lamp->map, "/nowhere/map.exr");
    strcpy(facts->display.model, "/nowhere/display.ini");
    struct report *r = made();
    assert_false(r->lamps[0].budgeted);
    assert_non_null(strstr(r->lamps[0].no_budget, "/nowhere/map.exr"));
    assert_false(r->lamps[0].split);
    assert_int_equal(r->missing_count, 2);
    assert_true(report_save(r, folder.path, NULL));
    finished(r);
    memcpy(lamp->map, map, sizeof map);
    memcpy(facts->display.model, model, sizeof model);
}

static void a_report_that_cannot_be_written_names_what_is_missing(void **state)
{
    (void)state;
    struct error err = {0};
    strcpy(facts->lamps[0].picture, "/nowhere/chart.png");
    struct report *r = made();
    assert_false(report_save(r, folder.path, &err));
    facts->lamps[0].picture[0] = 0;
    assert_non_null(strstr(err.text, "/nowhere/chart.png"));
    finished(r);
}

static int run(int argc, char **argv)
{
    FILE *nothing = freopen("/dev/null", "w", stdout);
    (void)nothing;
    return command_report(argc, argv);
}

static void the_command_makes_and_checks_reports(void **state)
{
    (void)state;
    char *path = strdup(folder_at(&folder, "report.json"));
    assert_int_equal(run(4, (char *[]){"report", "--draws", "200", folder.path, NULL}),
                     COMMAND_FINE);
    assert_int_equal(run(3, (char *[]){"report", "--check", path, NULL}), COMMAND_FINE);
    folder_put(&folder, "display.ini", "changed\n");
    assert_int_equal(run(3, (char *[]){"report", "--check", path, NULL}), COMMAND_WARNED);
    size_t size;
    char *text = file_read(path, 1 << 26, &size, NULL);
    char *digit = strstr(text, "de00_absolute\": ") + 16;
    *digit = *digit == '1' ? '2' : '1';
    assert_true(whole_file_write(path, text, size, NULL));
    assert_int_equal(run(3, (char *[]){"report", "--check", path, NULL}), COMMAND_FAILED);
    assert_int_equal(run(2, (char *[]){"report", "/nowhere", NULL}), COMMAND_USAGE);
    assert_int_equal(run(1, (char *[]){"report", NULL}), COMMAND_USAGE);
    free(text);
    free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(facts_come_back_from_their_file),
        cmocka_unit_test(every_difference_has_its_uncertainty),
        cmocka_unit_test(the_floor_is_what_the_closest_colour_leaves),
        cmocka_unit_test(steps_name_what_was_done_wrong),
        cmocka_unit_test(a_code_is_worth_its_slope),
        cmocka_unit_test(the_json_report_holds_every_figure_and_every_raw_reading),
        cmocka_unit_test(every_form_is_written_and_sealed),
        cmocka_unit_test(the_html_report_fetches_nothing_and_names_cannot_break_it),
        cmocka_unit_test(without_map_or_model_it_says_what_is_not_computed),
        cmocka_unit_test(a_report_that_cannot_be_written_names_what_is_missing),
        cmocka_unit_test(the_command_makes_and_checks_reports),
    };
    return cmocka_run_group_tests(tests, a_session_of_three_patches, done);
}
