// SPDX-License-Identifier: Apache-2.0
#include "calibration/audit_report.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#undef fail

#include "calibration/commands.h"
#include "colorimetry/illuminant.h"
#include "files/write.h"
#include "tests/fakes/folder.h"
#include "tests/fakes/near.h"

#define EXACT 1e-9
#define PRINTED 1e-9  // twelve significant digits of figures below 100
#define SHARED_RA 0.1 // what the audit promises against an independent oracle
#define D50_UV 1e-4   // u'10 v'10 of D50 as published, four decimals

static struct audit_facts *audit_of(const char *const *lamps, int count, double lux)
{
    struct audit_facts *f = calloc(1, sizeof *f);
    for (int i = 0; i < count; i++) {
        struct audit_lamp *l = &f->lamps[f->lamp_count++];
        snprintf(l->name, sizeof l->name, "%s", lamps[i]);
        assert_true(illuminant(lamps[i], &l->irradiance, NULL));
        l->absolute = lux > 0;
        if (l->absolute)
            spectrum_scale(&l->irradiance, lux / xyz_absolute(&l->irradiance, OBSERVER_1931_2).Y);
    }
    assert_true(audit_judge(f, NULL));
    return f;
}

static void done_with(struct audit_facts *f)
{
    audit_fini(f);
    free(f);
}

static enum audit_verdict verdict(const struct audit_facts *f, int lamp, enum audit_figure figure)
{
    return f->lamps[lamp].figures[figure].verdict;
}

static void a_good_booth_is_within_the_figures_that_can_be_computed(void **state)
{
    (void)state;
    struct audit_facts *f = audit_of((const char *[]){"D50", "FL11"}, 2, 2000);
    assert_near(f->lamps[0].lux, 2000, 1e-6);
    assert_int_equal(verdict(f, 0, FIGURE_P1), FIGURE_WITHIN);
    assert_int_equal(verdict(f, 0, FIGURE_P2), FIGURE_OUTSIDE);
    assert_int_equal(verdict(f, 0, FIGURE_CHROMATICITY), FIGURE_WITHIN);
    assert_int_equal(verdict(f, 0, FIGURE_RA), FIGURE_WITHIN);
    assert_int_equal(verdict(f, 1, FIGURE_CHROMATICITY), FIGURE_OUTSIDE);
    assert_int_equal(verdict(f, 1, FIGURE_RA), FIGURE_OUTSIDE);
    // CIE 015:2018: D50 by the 10 degree observer
    assert_near(f->lamps[0].uv_10.u, 0.2102, D50_UV);
    assert_near(f->lamps[0].uv_10.v, 0.4889, D50_UV);
    done_with(f);
}

static void what_cannot_be_computed_says_why(void **state)
{
    (void)state;
    struct audit_facts *f = audit_of((const char *[]){"D65"}, 1, 0);
    const enum audit_figure none[] = {FIGURE_P1, FIGURE_P2, FIGURE_UNIFORMITY, FIGURE_MI_VISIBLE,
                                      FIGURE_MI_UV};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++) {
        assert_int_equal(verdict(f, 0, none[i]), FIGURE_NOT_COMPUTED);
        assert_true(strlen(f->lamps[0].figures[none[i]].why) > 10);
    }
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    audit_as_text(f, out);
    fclose(out);
    const char *const said[] = {"TM-30 Rf", "ISO/CIE 23603", "ultraviolet", "no sample pairs"};
    for (size_t i = 0; i < sizeof said / sizeof *said; i++)
        assert_non_null(strstr(text, said[i]));
    free(text);
    done_with(f);
}

static void uniformity_is_the_least_of_nine_places_over_the_centre(void **state)
{
    (void)state;
    struct audit_facts *f = audit_of((const char *[]){"D50"}, 1, 1000);
    struct audit_lamp *l = &f->lamps[0];
    l->places = AUDIT_PLACES;
    for (int i = 0; i < AUDIT_PLACES; i++)
        l->place_lux[i] = i == AUDIT_CENTRE ? 1000 : 700 + 10 * i;
    assert_true(audit_judge(f, NULL));
    assert_near(l->uniformity, 0.7, EXACT);
    assert_int_equal(verdict(f, 0, FIGURE_UNIFORMITY), FIGURE_WITHIN);
    l->place_lux[8] = 500;
    assert_true(audit_judge(f, NULL));
    assert_int_equal(verdict(f, 0, FIGURE_UNIFORMITY), FIGURE_OUTSIDE);
    done_with(f);
}

static void a_lamp_without_colour_temperature_is_audited_without_ra(void **state)
{
    (void)state;
    struct audit_facts *f = audit_of((const char *[]){"E"}, 1, 100);
    memset(&f->lamps[0].irradiance, 0, sizeof f->lamps[0].irradiance);
    struct error err = {0};
    assert_false(audit_judge(f, &err)); // darkness is no lamp
    assert_int_equal(err.code, ERROR_DATA);
    for (int nm = 500; nm < 540; nm++)
        f->lamps[0].irradiance.v[nm - SPECTRUM_FIRST_NM] = 1;
    assert_true(audit_judge(f, NULL));
    assert_false(f->lamps[0].rendered);
    assert_int_equal(verdict(f, 0, FIGURE_RA), FIGURE_NOT_COMPUTED);
    done_with(f);
}

static void pairs_are_judged_under_every_change_of_lamp(void **state)
{
    (void)state;
    struct audit_facts *f = audit_of((const char *[]){"A", "D50", "D65"}, 3, 0);
    struct spectrum samples[4];
    char names[4][64] = {"one", "two", "three", "four"};
    for (int i = 0; i < 4; i++)
        test_colour(3 * i, &samples[i]);
    struct spectra all = {.count = 4, .spectra = samples, .names = names};
    assert_true(audit_metamerism(f, &all, NULL));
    assert_int_equal(f->metamerism_count, 2 * 3 * 2);
    assert_string_equal(f->pairs[1], "three / four");
    all.count = 3;
    struct error err = {0};
    audit_fini(f);
    assert_false(audit_metamerism(f, &all, &err));
    assert_int_equal(err.code, ERROR_DATA);
    done_with(f);
}

static void an_audit_is_read_back_and_shows_the_drift_since(void **state)
{
    (void)state;
    struct folder folder;
    folder_open(&folder);
    const char *path = folder_at(&folder, "audit.json");
    struct audit_facts *before = audit_of((const char *[]){"A", "FL8"}, 2, 1000);
    struct audit_facts *now = audit_of((const char *[]){"FL8", "D65"}, 2, 900);
    struct audit_facts *back = calloc(1, sizeof *back);
    snprintf(before->made, sizeof before->made, "2026-01-01T00:00:00Z");
    assert_true(audit_save(before, path, NULL));
    assert_true(audit_load(path, back, NULL));
    assert_int_equal(back->lamp_count, 2);
    assert_string_equal(back->made, before->made);
    for (int i = 0; i < 2; i++) {
        assert_near(back->lamps[i].lux, before->lamps[i].lux, 1e-6);
        assert_near(back->lamps[i].rendering.general, before->lamps[i].rendering.general, PRINTED);
    }
    audit_compare(now, back);
    assert_int_equal(now->drift_count, 1); // A is gone, D65 is new
    assert_near(now->drift[0].lux_percent, -10, 1e-6);
    assert_near(now->drift[0].uv, 0, PRINTED);
    assert_near(now->drift[0].ra_by, 0, 1e-6);
    done_with(before);
    done_with(now);
    done_with(back);
    folder_close(&folder);
}

static void a_changed_audit_is_refused(void **state)
{
    (void)state;
    struct folder folder;
    folder_open(&folder);
    const char *path = folder_at(&folder, "audit.json");
    struct audit_facts *f = audit_of((const char *[]){"FL2"}, 1, 500);
    struct error err = {0};
    size_t size;
    assert_true(audit_save(f, path, NULL));
    char *text = file_read(path, 1 << 20, &size, NULL);
    memcpy(strstr(text, "FL2"), "FL3", 3);
    assert_true(whole_file_write(path, text, size, NULL));
    assert_false(audit_load(path, f, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "changed"));
    free(text);
    done_with(f);
    folder_close(&folder);
}

static int run(int argc, char **argv)
{
    FILE *nothing = freopen("/dev/null", "w", stdout);
    (void)nothing;
    return command_audit(argc, argv);
}

static void the_command_ends_with_what_it_found(void **state)
{
    (void)state;
    struct folder folder;
    folder_open(&folder);
    char table[4096] = "nm,lamp\n";
    struct spectrum fl4;
    assert_true(illuminant("FL4", &fl4, NULL));
    for (int i = 0; i < SPECTRUM_COUNT; i += 5)
        snprintf(table + strlen(table), sizeof table - strlen(table), "%d,%g\n",
                 SPECTRUM_FIRST_NM + i, fl4.v[i]);
    char *file = (char *)folder_put(&folder, "fl4.csv", table);
    char *out = (char *)folder_at(&folder, "out.json");
    assert_int_equal(run(4, (char *[]){"audit", file, "-o", out, NULL}), COMMAND_FINE);
    assert_int_equal(run(4, (char *[]){"audit", file, "--previous", out, NULL}), COMMAND_FINE);
    assert_int_equal(run(4, (char *[]){"audit", file, "--condition", "P1", NULL}), COMMAND_WARNED);
    assert_int_equal(run(3, (char *[]){"audit", file, "--nine", NULL}), COMMAND_USAGE);
    assert_int_equal(run(1, (char *[]){"audit", NULL}), COMMAND_USAGE);
    assert_int_equal(run(2, (char *[]){"audit", "/nowhere.csv", NULL}), COMMAND_USAGE);
    folder_close(&folder);
}

// Files as labs exchange them, through the reader of files.
static void ra_of_shared_files_agrees_with_the_oracle(void **state)
{
    (void)state;
    static const char FOLDER[] = "../shared/data/cie";
    char path[256], line[512], name[32];
    FILE *in = fopen("../shared/data/cie/illuminant_oracle_colour046.csv", "r");
    if (!in) {
        printf("skipped: no %s\n", FOLDER);
        return;
    }
    int seen = 0;
    while (fgets(line, sizeof line, in)) {
        double ra;
        struct spectra s = {0};
        struct rendering r;
        if (sscanf(line, "%31[^,],%*f,%*f,%*f,%*f,%*f,%*f,%*f,%lf", name, &ra) != 2)
            continue;
        snprintf(path, sizeof path, "%s/illum_%s.csv", FOLDER, name);
        if (!spectra_load(path, false, &s, NULL))
            continue;
        assert_true(rendering_of(&s.spectra[0], &r, NULL));
        assert_near(r.general, ra, SHARED_RA);
        spectra_fini(&s);
        seen++;
    }
    fclose(in);
    assert_true(seen >= 15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_booth_is_within_the_figures_that_can_be_computed),
        cmocka_unit_test(what_cannot_be_computed_says_why),
        cmocka_unit_test(uniformity_is_the_least_of_nine_places_over_the_centre),
        cmocka_unit_test(a_lamp_without_colour_temperature_is_audited_without_ra),
        cmocka_unit_test(pairs_are_judged_under_every_change_of_lamp),
        cmocka_unit_test(an_audit_is_read_back_and_shows_the_drift_since),
        cmocka_unit_test(a_changed_audit_is_refused),
        cmocka_unit_test(ra_of_shared_files_agrees_with_the_oracle),
        cmocka_unit_test(the_command_ends_with_what_it_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
