// SPDX-License-Identifier: Apache-2.0
#include <math.h>

#include "calibration/facts_json.h"
#include "calibration/proof.h"
#include "calibration/report.h"

#define OWNER budget_figure
static const struct field figure_fields[] = {
    F_NUMBER("value", value),
    F_NUMBER("u", u),
    F_NUMBERS("share", share),
    {0},
};
#undef OWNER

#define OWNER budget_difference
static const struct field difference_fields[] = {
    F_OBJECT("L", L, figure_fields),
    F_OBJECT("C", C, figure_fields),
    F_OBJECT("H", H, figure_fields),
    F_OBJECT("E00", E, figure_fields),
    {0},
};
#undef OWNER

#define OWNER budget_overall
static const struct field overall_fields[] = {
    F_NUMBER("mean", mean),
    F_NUMBER("mean_u", mean_u),
    F_NUMBER("max", max),
    F_NUMBER("max_u", max_u),
    {0},
};
#undef OWNER

#define OWNER report_lamp
static const struct field outside_fields[] = {
    F_OBJECT("absolute_out_of_gamut", absolute_out, summary_fields),
    F_OBJECT("published_out_of_gamut", published_out, summary_fields),
    F_OBJECT("floor_absolute", floor_absolute, summary_fields),
    F_OBJECT("floor_published", floor_published, summary_fields),
    {0},
};
#undef OWNER

#define OWNER booth_light
static const struct field light_fields[] = {
    F_NUMBER("lux", lux),
    F_NUMBER("by_tilt_per_deg", by_tilt),
    F_NUMBER("by_up_per_m", by_up),
    F_NUMBER("by_near_per_m", by_near),
    F_NUMBERS("by_shape", by_shape),
    {0},
};
#undef OWNER

static json_t *names(int count, const char *(*name)(int))
{
    json_t *out = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(out, json_string(name(i)));
    return out;
}

static const char *cause_name(int i)
{
    return budget_cause_name((enum budget_cause)i);
}

static const char *step_name(int i)
{
    return report_step_name((enum report_step)i);
}

static json_t *numbers(const double *v, int count)
{
    json_t *out = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(out, isnan(v[i]) ? json_null() : json_real(v[i]));
    return out;
}

static json_t *budget_json(const struct budget *b)
{
    json_t *absolute = json_array(), *published = json_array();
    for (int i = 0; i < b->count; i++) {
        json_array_append_new(absolute, fields_as_json(difference_fields, &b->absolute[i]));
        json_array_append_new(published, fields_as_json(difference_fields, &b->published[i]));
    }
    return json_pack("{si,so,so,so,so}", "draws", b->draws, "absolute", absolute, "published",
                     published, "absolute_in_gamut",
                     fields_as_json(overall_fields, &b->absolute_all), "published_in_gamut",
                     fields_as_json(overall_fields, &b->published_all));
}

static json_t *worst_json(const struct lamp_report *from, const struct report_lamp *lamp)
{
    json_t *out = json_array();
    for (int i = 0; i < lamp->worst_count; i++) {
        const struct patch_report *p = &from->patches[lamp->worst[i]];
        json_array_append_new(
            out, json_pack("{ss,sf}", "name", p->name, "de00_absolute", p->de_absolute));
    }
    return out;
}

static void add_patches(json_t *patches, const struct report_lamp *lamp)
{
    size_t i;
    json_t *patch;
    json_array_foreach(patches, i, patch)
    {
        const struct report_patch *p = &lamp->patches[i];
        json_object_set_new(patch, "floor_de00_absolute", json_real(p->floor_absolute));
        json_object_set_new(patch, "floor_de00_published", json_real(p->floor_published));
        json_object_set_new(patch, "steps_de00", numbers(p->steps, STEPS));
    }
}

static void add_lamp(json_t *out, const struct lamp_report *from, const struct report_lamp *lamp)
{
    if (!from->cct.valid) {
        json_object_set_new(out, "cct_K", json_null());
        json_object_set_new(out, "duv", json_null());
    }
    if (lamp->split)
        add_patches(json_object_get(out, "patches"), lamp);
    json_t *more = fields_as_json(outside_fields, lamp);
    json_object_update(json_object_get(out, "de00"), more);
    json_decref(more);
    json_object_set_new(out, "worst", worst_json(from, lamp));
    json_object_set_new(out, "steps_rms_de00",
                        lamp->split ? numbers(lamp->steps, STEPS) : json_null());
    json_object_set_new(out, "black_cdm2",
                        lamp->split ? json_pack("{sf,sf}", "expected", lamp->black_expected,
                                                "shown", lamp->black_shown)
                                    : json_null());
    if (lamp->budgeted) {
        json_object_set_new(out, "light", fields_as_json(light_fields, &lamp->light));
        json_object_set_new(out, "budget_measured", budget_json(&lamp->measured));
        json_object_set_new(out, "budget_shown", budget_json(&lamp->shown));
    } else {
        json_object_set_new(out, "budget_not_computed", json_string(lamp->no_budget));
    }
}

// A pose where only the head moved has no white.
static void trim_poses(json_t *poses, const struct session_facts *f)
{
    size_t i;
    json_t *pose;
    json_array_foreach(poses, i, pose)
    {
        if (!f->poses[i].off_axis)
            json_object_del(pose, "off_normal_deg");
        if (f->poses[i].moved_screen)
            continue;
        json_object_del(pose, "white_reference_cdm2");
        json_object_del(pose, "white_measured_cdm2");
        json_object_del(pose, "white_luminance_error_percent");
    }
}

static json_t *published_json(void)
{
    json_t *rows = json_array();
    for (int i = 0; i < 3; i++) {
        const struct published_row *r = &published_table[i];
        json_array_append_new(rows,
                              json_pack("{ss,so,so,so}", "lamp", r->lamp, "simulation",
                                        numbers(r->simulation, 4), "screen", numbers(r->screen, 4),
                                        "screen_in_gamut", numbers(r->in_gamut, 4)));
    }
    return rows;
}

static json_t *missing_json(const struct report *r)
{
    json_t *out = json_array();
    for (int i = 0; i < r->missing_count; i++)
        json_array_append_new(out, json_string(r->missing[i]));
    return out;
}

static json_t *uncertainties_json(const struct uncertainties *u)
{
    json_t *out = json_object();
    for (const struct setting *row = uncertainty_settings; row->name; row++) {
        char text[64];
        settings_get(row, u, text, sizeof text);
        json_object_set_new(out, row->name, json_string(text));
    }
    return out;
}

static void add_provenance(json_t *out, const struct report *r)
{
    json_object_set_new(out, "settings_sha256", json_string(r->settings_sha256));
    json_object_set_new(out, "uncertainty", uncertainties_json(&r->u));
    json_object_set_new(out, "causes", names(CAUSES, cause_name));
    json_object_set_new(out, "steps", names(STEPS, step_name));
    json_object_set_new(out, "published_mean_std_p90_max", published_json());
    json_object_set_new(out, "targets",
                        json_pack("{sf,sf,sf}", "de00_mean", PROOF_MEAN_MOST, "de00_max",
                                  PROOF_MAX_MOST, "white_percent", PROOF_WHITE_PERCENT_MOST));
    json_object_set_new(out, "normalisation",
                        json_string("absolute: cd/m2, white of CIELAB the perfect diffuser at that "
                                    "place; published: each set over 1.13 times its own white "
                                    "patch, CAT02 (D = 1) to D65"));
    json_object_set_new(out, "inputs", sealed_inputs_json(&r->inputs));
    json_object_set_new(out, "inputs_missing", missing_json(r));
    json_object_set_new(out, "seal", json_string(SEAL_BLANK));
}

json_t *report_as_json(const struct report *r)
{
    json_t *out = fields_as_json(session_fields, r->facts);
    if (!out)
        return NULL;
    json_object_set_new(out, "kind", json_string("boothd report"));
    json_object_set_new(out, "reference",
                        json_string(r->facts->truth_emulated
                                        ? "physical sample in the emulated booth, 1 nm integration"
                                        : "taught spectrum and luminance map, 1 nm integration"));
    if (!r->facts->view.measured)
        json_object_set_new(out, "view", json_null());
    for (int i = 0; i < r->facts->lamp_count; i++)
        add_lamp(json_array_get(json_object_get(out, "lamps"), (size_t)i), &r->facts->lamps[i],
                 &r->lamps[i]);
    trim_poses(json_object_get(out, "poses"), r->facts);
    add_provenance(out, r);
    return out;
}
