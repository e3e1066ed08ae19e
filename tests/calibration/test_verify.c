// SPDX-License-Identifier: Apache-2.0
#include "calibration/verify.h"

#include <math.h>
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
#include "tests/fakes/near.h"

#define EXACT 1e-9
#define ONE_PER_CENT 0.02 // relative: 0.2213 dE00 for one per cent at white

static const struct xyz WHITE = {475, 500, 544};

struct all {
    struct session_facts facts;
    struct report report;
    struct verification v;
    struct budget_difference rows[2][1];
};

// A chart whose in-gamut mean is 0.8 +- 0.3 and whose largest is 2 +- 0.6.
static struct all *chart(void)
{
    struct all *a = calloc(1, sizeof *a);
    struct lamp_report *l = &a->facts.lamps[0];
    struct report_lamp *own = &a->report.lamps[0];
    l->patch_count = 1;
    l->white_measured = WHITE;
    l->white_error_percent = -1;
    l->proof.published_in_gamut = (struct summary){.n = 20, .mean = 0.8, .max = 2};
    l->proof.absolute_in_gamut = (struct summary){.n = 20, .mean = 0.9, .max = 2.2};
    own->budgeted = true;
    own->measured.absolute = a->rows[0];
    own->measured.published = a->rows[1];
    own->measured.published_all = (struct budget_overall){0.8, 0.15, 2, 0.3};
    own->measured.absolute_all = (struct budget_overall){0.9, 0.2, 2.2, 0.4};
    own->measured.absolute[0].L.u = 0.2213;
    assert_true(uncertainties_load(NULL, &a->report.u, NULL));
    a->v.facts = &a->facts;
    a->v.report = &a->report;
    verify_init(&a->v);
    return a;
}

static enum verdict asked(const char *option, double tolerance)
{
    struct all *a = chart();
    assert_true(verify_ask(&a->v, option, tolerance));
    assert_true(verify_judge(&a->v, WHITE, NULL));
    enum verdict out = a->v.verdict;
    free(a);
    return out;
}

static void uncertainty_guards_the_tolerance_on_both_sides(void **state)
{
    (void)state;
    assert_int_equal(asked("published-mean", 1.2), VERDICT_PASS);
    assert_int_equal(asked("published-mean", 1.0), VERDICT_UNDECIDED);
    assert_int_equal(asked("published-mean", 0.6), VERDICT_UNDECIDED);
    assert_int_equal(asked("published-mean", 0.4), VERDICT_FAIL);
    assert_int_equal(asked("published-max", 2.7), VERDICT_PASS);
    assert_int_equal(asked("absolute-max", 1), VERDICT_FAIL);
}

static void without_a_wish_the_published_figures_count(void **state)
{
    (void)state;
    struct all *a = chart();
    assert_true(verify_judge(&a->v, WHITE, NULL));
    for (int i = 0; i < CRITERIA; i++)
        assert_true(a->v.criteria[i].asked ==
                    (i == VERIFY_PUBLISHED_MEAN || i == VERIFY_PUBLISHED_MAX));
    assert_int_equal(a->v.criteria[VERIFY_PUBLISHED_MAX].verdict, VERDICT_PASS);
    assert_int_equal(a->v.verdict, VERDICT_UNDECIDED); // the mean: 0.8 + 0.3 > 1
    free(a);
}

static void one_failure_outweighs_everything(void **state)
{
    (void)state;
    struct all *a = chart();
    assert_true(verify_ask(&a->v, "published-mean", 0.4));
    assert_true(verify_ask(&a->v, "published-max", 10));
    assert_true(verify_ask(&a->v, "absolute-mean", 1));
    assert_true(verify_judge(&a->v, WHITE, NULL));
    assert_int_equal(a->v.verdict, VERDICT_FAIL);
    assert_false(verify_ask(&a->v, "no-such", 1));
    free(a);
}

static void the_luminance_of_white_is_judged_in_per_cent(void **state)
{
    (void)state;
    struct all *a = chart();
    assert_true(verify_judge(&a->v, WHITE, NULL));
    const struct verify_criterion *c = &a->v.criteria[VERIFY_WHITE];
    assert_near(c->value, 1, EXACT);
    assert_near(c->expanded / 2, 1, ONE_PER_CENT);
    free(a);
}

static void patches_of_counts_stand_against_the_model(void **state)
{
    (void)state;
    struct all *a = chart();
    a->v.patch_count = 2;
    a->v.patches[0].predicted = a->v.patches[0].measured = (struct xyz){95, 100, 109};
    a->v.patches[1].predicted = (struct xyz){95, 100, 109};
    a->v.patches[1].measured = (struct xyz){97, 102, 111};
    assert_true(verify_ask(&a->v, "display-max", 0.1));
    assert_true(verify_judge(&a->v, WHITE, NULL));
    assert_true(a->v.patches[0].de00 == 0);
    const struct verify_criterion *mean = &a->v.criteria[VERIFY_DISPLAY_MEAN];
    const struct verify_criterion *max = &a->v.criteria[VERIFY_DISPLAY_MAX];
    assert_near(mean->value, a->v.patches[1].de00 / 2, EXACT);
    assert_near(max->value, a->v.patches[1].de00, EXACT);
    assert_true(max->expanded > 0 && max->expanded < 0.6); // 0.06 % in X, Y and Z each
    assert_int_equal(a->v.verdict, VERDICT_FAIL);
    free(a);
}

static void what_cannot_be_judged_is_no_pass(void **state)
{
    (void)state;
    struct all *a = chart();
    struct error err = {0};
    a->report.lamps[0].budgeted = false;
    strcpy(a->report.lamps[0].no_budget, "no map");
    assert_false(verify_judge(&a->v, WHITE, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "no map"));
    free(a);
}

static void it_is_written_with_every_criterion_and_a_seal(void **state)
{
    (void)state;
    struct all *a = chart();
    assert_true(verify_judge(&a->v, WHITE, NULL));
    json_t *json = verify_as_json(&a->v);
    assert_non_null(json);
    assert_int_equal(json_array_size(json_object_get(json, "criteria")), CRITERIA);
    assert_string_equal(json_string_value(json_object_get(json, "verdict")), "undecided");
    assert_string_equal(json_string_value(json_object_get(json, "seal")), SEAL_BLANK);
    json_decref(json);
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    verify_as_text(&a->v, out);
    fclose(out);
    assert_non_null(strstr(text, "undecided"));
    assert_non_null(strstr(text, "not computed")); // no patches of counts
    free(text);
    free(a);
}

static void a_wrong_command_line_is_misuse(void **state)
{
    (void)state;
    assert_int_equal(command_verify(1, (char *[]){"verify", NULL}), COMMAND_USAGE);
    assert_int_equal(
        command_verify(5, (char *[]){"verify", "--config", "x", "--white", "much", NULL}),
        COMMAND_USAGE);
    assert_int_equal(command_verify(3, (char *[]){"verify", "--config", "/nowhere", NULL}),
                     COMMAND_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(uncertainty_guards_the_tolerance_on_both_sides),
        cmocka_unit_test(without_a_wish_the_published_figures_count),
        cmocka_unit_test(one_failure_outweighs_everything),
        cmocka_unit_test(the_luminance_of_white_is_judged_in_per_cent),
        cmocka_unit_test(patches_of_counts_stand_against_the_model),
        cmocka_unit_test(what_cannot_be_judged_is_no_pass),
        cmocka_unit_test(it_is_written_with_every_criterion_and_a_seal),
        cmocka_unit_test(a_wrong_command_line_is_misuse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
