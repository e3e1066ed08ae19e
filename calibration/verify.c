// SPDX-License-Identifier: Apache-2.0
#include "calibration/verify.h"

#include <math.h>
#include <string.h>

#include "calibration/facts_json.h"

void verify_init(struct verification *v)
{
    static const struct verify_criterion PRESETS[] = {
#define X(name, option, text, preset) {option, text, false, false, preset, 0, 0, VERDICT_UNDECIDED},
        VERIFY_CRITERIA(X)
#undef X
    };
    memcpy(v->criteria, PRESETS, sizeof v->criteria);
}

bool verify_ask(struct verification *v, const char *option, double tolerance)
{
    for (int i = 0; i < CRITERIA; i++)
        if (!strcmp(v->criteria[i].option, option)) {
            v->criteria[i].asked = true;
            v->criteria[i].tolerance = tolerance;
            return true;
        }
    return false;
}

// ---- figures -----------------------------------------------------------------------

static double apart(struct xyz a, struct xyz b, struct xyz white)
{
    struct lab la, lb;
    bool fine = lab_of(a, white, &la, NULL) && lab_of(b, white, &lb, NULL);
    return fine ? delta_e_2000(la, lb) : NAN;
}

// What one reading's own scatter moves it by: both instruments that a
// difference from the model stands on are the same one.
static double scatter_of(struct xyz c, struct xyz white, const struct uncertainties *u)
{
    double k = 1 + u->radiometer_repeat, e = 1 + u->radiometer_colour;
    double all = apart(c, (struct xyz){k * c.X, k * c.Y, k * c.Z}, white);
    double x = apart(c, (struct xyz){e * c.X, c.Y, c.Z}, white);
    double y = apart(c, (struct xyz){c.X, e * c.Y, c.Z}, white);
    double z = apart(c, (struct xyz){c.X, c.Y, e * c.Z}, white);
    return sqrt(all * all + x * x + y * y + z * z);
}

static void put(struct verification *v, enum verify_name name, double value, double u)
{
    struct verify_criterion *c = &v->criteria[name];
    c->computed = isfinite(value) && isfinite(u);
    c->value = value;
    c->expanded = 2 * u;
    c->verdict = verdict_of(value, c->expanded, c->tolerance);
}

static void judge_patches(struct verification *v, struct xyz white)
{
    double sum = 0, squares = 0, most = -1, most_u = 0;
    for (int i = 0; i < v->patch_count; i++) {
        struct verify_patch *p = &v->patches[i];
        p->de00 = apart(p->predicted, p->measured, white);
        p->u = scatter_of(p->measured, white, &v->report->u);
        sum += p->de00;
        squares += p->u * p->u;
        if (p->de00 > most) {
            most = p->de00;
            most_u = p->u;
        }
    }
    if (!v->patch_count)
        return;
    put(v, VERIFY_DISPLAY_MEAN, sum / v->patch_count, sqrt(squares) / v->patch_count);
    put(v, VERIFY_DISPLAY_MAX, most, most_u);
}

// Per cent of luminance that one unit of delta L is worth at a colour.
static double percent_of_L(struct xyz c, struct xyz white)
{
    struct lab a = {0}, b = {0};
    lab_of(c, white, &a, NULL);
    lab_of((struct xyz){1.01 * c.X, 1.01 * c.Y, 1.01 * c.Z}, white, &b, NULL);
    return 1 / delta_lch_2000(a, b).L;
}

static void judge_chart(struct verification *v, struct xyz white)
{
    const struct lamp_report *l = &v->facts->lamps[0];
    const struct report_lamp *own = &v->report->lamps[0];
    const struct budget *b = &own->measured;
    const struct proof_summary *p = &l->proof;
    if (!own->budgeted)
        return;
    if (p->published_in_gamut.n) {
        put(v, VERIFY_PUBLISHED_MEAN, p->published_in_gamut.mean, b->published_all.mean_u);
        put(v, VERIFY_PUBLISHED_MAX, p->published_in_gamut.max, b->published_all.max_u);
        put(v, VERIFY_ABSOLUTE_MEAN, p->absolute_in_gamut.mean, b->absolute_all.mean_u);
        put(v, VERIFY_ABSOLUTE_MAX, p->absolute_in_gamut.max, b->absolute_all.max_u);
    }
    put(v, VERIFY_WHITE, fabs(l->white_error_percent),
        b->absolute[l->white_patch].L.u * percent_of_L(l->white_measured, white));
}

static bool decide(struct verification *v, struct error *err)
{
    static const enum verdict WORSE[] = {VERDICT_FAIL, VERDICT_UNDECIDED};
    v->verdict = VERDICT_PASS;
    for (int i = 0; i < CRITERIA; i++)
        if (v->criteria[i].asked && !v->criteria[i].computed)
            return fail(err, ERROR_DATA, "%s cannot be judged: %s", v->criteria[i].text,
                        v->report->lamps[0].budgeted ? "no patch for it"
                                                     : v->report->lamps[0].no_budget);
    for (int k = 1; k >= 0; k--)
        for (int i = 0; i < CRITERIA; i++)
            if (v->criteria[i].asked && v->criteria[i].verdict == WORSE[k])
                v->verdict = WORSE[k];
    return true;
}

bool verify_judge(struct verification *v, struct xyz white, struct error *err)
{
    bool any = false;
    for (int i = 0; i < CRITERIA; i++)
        any = any || v->criteria[i].asked;
    if (!any)
        v->criteria[VERIFY_PUBLISHED_MEAN].asked = v->criteria[VERIFY_PUBLISHED_MAX].asked = true;
    judge_chart(v, white);
    judge_patches(v, white);
    return decide(v, err);
}

// ---- written down ----------------------------------------------------------------

#define OWNER verify_patch
static const struct field patch_rows[] = {
    F_NUMBERS("counts", counts),
    F_NUMBERS("predicted_cdm2", predicted),
    F_NUMBERS("measured_cdm2", measured),
    F_NUMBER("de00", de00),
    F_NUMBER("u", u),
    {0},
};
#undef OWNER

static json_t *criteria_json(const struct verification *v)
{
    json_t *out = json_array();
    for (int i = 0; i < CRITERIA; i++) {
        const struct verify_criterion *c = &v->criteria[i];
        json_t *one = json_pack("{ss,ss,sb,sf}", "name", c->option, "what", c->text, "asked",
                                c->asked, "tolerance", c->tolerance);
        json_object_set_new(one, "value", c->computed ? json_real(c->value) : json_null());
        json_object_set_new(one, "U", c->computed ? json_real(c->expanded) : json_null());
        json_object_set_new(one, "verdict",
                            json_string(c->computed ? verdict_name(c->verdict) : "not computed"));
        json_array_append_new(out, one);
    }
    return out;
}

json_t *verify_as_json(const struct verification *v)
{
    const struct session_facts *f = v->facts;
    json_t *patches = json_array();
    for (int i = 0; i < v->patch_count; i++)
        json_array_append_new(patches, fields_as_json(patch_rows, &v->patches[i]));
    return json_pack("{ss,ss,ss,ss,ss,sb,ss,so,so,so,so,ss}", "kind", "boothd verification",
                     "booth", f->booth, "made", f->finished, "software", f->software, "lamp",
                     f->lamps[0].name, "emulated", f->emulated, "verdict", verdict_name(v->verdict),
                     "criteria", criteria_json(v), "patches", patches, "chart",
                     fields_as_json(lamp_fields, &f->lamps[0]), "inputs",
                     sealed_inputs_json(&v->report->inputs), "seal", SEAL_BLANK);
}

void verify_as_text(const struct verification *v, FILE *out)
{
    const struct session_facts *f = v->facts;
    fprintf(out, "%s under %s, %s, %s%s\n", f->booth, f->lamps[0].name, f->finished, f->software,
            f->emulated ? ", EMULATED instruments" : "");
    fprintf(out, "  %-48s %9s %7s %10s\n", "", "value", "U", "tolerance");
    for (int i = 0; i < CRITERIA; i++) {
        const struct verify_criterion *c = &v->criteria[i];
        if (!c->computed)
            fprintf(out, "  %-48s not computed\n", c->text);
        else if (c->asked)
            fprintf(out, "  %-48s %9.2f %7.2f %10.2f  %s\n", c->text, c->value, c->expanded,
                    c->tolerance, verdict_name(c->verdict));
        else
            fprintf(out, "  %-48s %9.2f %7.2f\n", c->text, c->value, c->expanded);
    }
    fprintf(out, "%s\n", verdict_name(v->verdict));
}
