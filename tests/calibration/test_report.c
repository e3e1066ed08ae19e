// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration/proof.h"
#include "calibration/report.h"

// cmocka defines a macro named fail: it comes last.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static struct session_facts facts;

static int a_session_with_two_patches(void **state)
{
    (void)state;
    memset(&facts, 0, sizeof facts);
    strcpy(facts.booth, "booth <7> & co");
    strcpy(facts.observer, "1931-2");
    facts.emulated = true;
    facts.lamp_count = 1;
    struct lamp_report *lamp = &facts.lamps[0];
    strcpy(lamp->name, "D65");
    lamp->white_reference = lamp->white_measured = lamp->white_taught = (struct xyz){95, 100, 108};
    lamp->patch_count = 2;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        lamp->irradiance.v[i] = i;
    for (int i = 0; i < 2; i++) {
        struct patch_report *p = &lamp->patches[i];
        snprintf(p->name, sizeof p->name, i ? "a<b" : "white");
        p->reference = p->full = p->bands = (struct xyz){90 - 50 * i, 95 - 50 * i, 100 - 50 * i};
        p->measured = (struct xyz){91 - 50 * i, 95 - 50 * i, 100 - 50 * i};
        p->in_gamut = true;
        p->reading = i;
    }
    facts.pose_count = 1;
    facts.poses[0].moved_screen = true;
    facts.settings = json_pack("{ss}", "observer", "1931-2");
    facts.readings = json_pack("[{ss},{ss}]", "what", "white", "what", "a<b");
    return proof_judge(lamp, NULL) ? 0 : -1;
}

static int done(void **state)
{
    (void)state;
    json_decref(facts.settings);
    json_decref(facts.readings);
    return 0;
}

static char *html(struct error *err, bool *fine)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    *fine = report_as_html(&facts, out, err);
    fclose(out);
    return text;
}

static void the_json_report_holds_every_figure_and_every_raw_reading(void **state)
{
    (void)state;
    json_t *report = report_as_json(&facts);
    assert_non_null(report);
    const json_t *lamp = json_array_get(json_object_get(report, "lamps"), 0);
    const json_t *patch = json_array_get(json_object_get(lamp, "patches"), 1);
    assert_float_equal(json_number_value(json_object_get(patch, "de00_published")),
                       facts.lamps[0].patches[1].de_published, 1e-12);
    assert_int_equal(json_array_size(json_object_get(report, "readings")), 2);
    assert_int_equal(json_array_size(json_object_get(lamp, "irradiance_360_830_W_m2_nm")),
                     SPECTRUM_COUNT);
    assert_string_equal(json_string_value(json_object_get(report, "observer")), "1931-2");
    assert_true(json_is_true(json_object_get(report, "emulated")));
    assert_int_equal(json_array_size(json_object_get(report, "published_mean_std_p90_max")), 3);
    json_decref(report);
}

static void the_html_report_is_one_file_that_fetches_nothing(void **state)
{
    (void)state;
    bool fine;
    char *text = html(NULL, &fine);
    assert_true(fine);
    assert_null(strstr(text, "http"));
    assert_null(strstr(text, "<script"));
    assert_null(strstr(text, "<link"));
    assert_non_null(strstr(text, "Emulated instruments"));
    assert_non_null(strstr(text, "published: six-channel simulation"));
    free(text);
}

static void names_from_files_cannot_break_the_html(void **state)
{
    (void)state;
    bool fine;
    char *text = html(NULL, &fine);
    assert_null(strstr(text, "a<b"));
    assert_non_null(strstr(text, "a&lt;b"));
    assert_non_null(strstr(text, "booth &lt;7&gt; &amp; co"));
    free(text);
}

static void a_missing_picture_fails_with_its_path(void **state)
{
    (void)state;
    struct error err = {0};
    bool fine;
    strcpy(facts.lamps[0].picture, "/nowhere/chart.png");
    char *text = html(&err, &fine);
    facts.lamps[0].picture[0] = 0;
    assert_false(fine);
    assert_non_null(strstr(err.text, "/nowhere/chart.png"));
    free(text);
}

static void a_report_that_cannot_be_written_leaves_nothing_behind(void **state)
{
    (void)state;
    char folder[] = "/tmp/report-XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    strcpy(facts.lamps[0].picture, "/nowhere/chart.png");
    assert_false(report_save(&facts, folder, NULL));
    facts.lamps[0].picture[0] = 0;
    snprintf(path, sizeof path, "%s/report.html", folder);
    assert_int_not_equal(access(path, F_OK), 0);
    snprintf(path, sizeof path, "%s/report.json", folder);
    unlink(path);
    assert_int_equal(rmdir(folder), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_json_report_holds_every_figure_and_every_raw_reading),
        cmocka_unit_test(the_html_report_is_one_file_that_fetches_nothing),
        cmocka_unit_test(names_from_files_cannot_break_the_html),
        cmocka_unit_test(a_missing_picture_fails_with_its_path),
        cmocka_unit_test(a_report_that_cannot_be_written_leaves_nothing_behind),
    };
    return cmocka_run_group_tests(tests, a_session_with_two_patches, done);
}
