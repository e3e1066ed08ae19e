// SPDX-License-Identifier: Apache-2.0
#include "calibration/report.h"

#include "calibration/proof.h"

static json_t *json_xyz(struct xyz c)
{
    return json_pack("[fff]", c.X, c.Y, c.Z);
}

static json_t *json_summary(const struct summary *s)
{
    return json_pack("{si,sf,sf,sf,sf,sf,sf,sf}", "n", s->n, "mean", s->mean, "std", s->std, "median",
                     s->median, "p90", s->p90, "p95", s->p95, "p99", s->p99, "max", s->max);
}

static json_t *json_patch(const struct patch_report *p)
{
    return json_pack("{ss,so,so,so,so,sb,si,sf,sf,sf}", "name", p->name, "reference_cdm2",
                     json_xyz(p->reference), "measured_cdm2", json_xyz(p->measured), "full_relative",
                     json_xyz(p->full), "bands_relative", json_xyz(p->bands), "in_gamut", p->in_gamut,
                     "reading", p->reading, "de00_simulation", p->de_simulation, "de00_published",
                     p->de_published, "de00_absolute", p->de_absolute);
}

static json_t *json_lamp(const struct lamp_report *l)
{
    json_t *patches = json_array(), *irradiance = json_array();
    for (int i = 0; i < l->patch_count; i++)
        json_array_append_new(patches, json_patch(&l->patches[i]));
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        json_array_append_new(irradiance, json_real(l->irradiance.v[i]));
    json_t *out = json_pack(
        "{ss,ss,sf,sf,si,s[ff],sf,si,so,so,sf,s:{so,so,so,so,so},ss,so,so}", "name", l->name,
        "emulated_spectrum", l->asked, "lux", l->lux, "spread", l->spread, "teach_readings",
        l->teach_readings, "xy", l->chromaticity.x, l->chromaticity.y, "map_scale", l->map_scale,
        "spot_readings", l->spots, "white_reference_cdm2", json_xyz(l->white_reference),
        "white_measured_cdm2", json_xyz(l->white_measured), "white_luminance_error_percent",
        l->white_error_percent, "de00", "simulation", json_summary(&l->proof.simulation), "published",
        json_summary(&l->proof.published), "published_in_gamut",
        json_summary(&l->proof.published_in_gamut), "absolute", json_summary(&l->proof.absolute),
        "absolute_in_gamut", json_summary(&l->proof.absolute_in_gamut), "picture", l->picture,
        "patches", patches, "irradiance_360_830_W_m2_nm", irradiance);
    json_t *ratios = json_array();
    for (int i = 0; i < l->spots; i++)
        json_array_append_new(ratios, json_real(l->spot_ratios[i]));
    json_object_set_new(out, "spot_ratios", ratios);
    json_object_set_new(out, "reached", json_boolean(l->reached));
    json_object_set_new(out, "white_taught_relative", json_xyz(l->white_taught));
    json_object_set_new(out, "cct_K", l->cct.valid ? json_real(l->cct.kelvin) : json_null());
    json_object_set_new(out, "duv", l->cct.valid ? json_real(l->cct.duv) : json_null());
    return out;
}

static json_t *json_display(const struct display_report *d)
{
    return json_pack("{ss,ss,si,si,so,so,sf,so,so,sf}", "measurements", d->measurements, "model",
                     d->model, "patches", d->patches, "verification_patches", d->verified, "fit_de00",
                     json_summary(&d->fit), "verification_de00", json_summary(&d->verification),
                     "condition", d->condition, "white_cdm2", json_xyz(d->white), "black_cdm2",
                     json_xyz(d->black), "white_drift_percent", d->white_drift_percent);
}

static json_t *json_pose(const struct pose_report *p)
{
    json_t *out = json_pack("{sf,sf,s[fff],s[fff]}", "tilt_deg", p->tilt_deg, "tilt_seen_deg",
                            p->tilt_seen_deg, "eye_m", p->eye.x, p->eye.y, p->eye.z, "eye_seen_m",
                            p->eye_seen.x, p->eye_seen.y, p->eye_seen.z);
    if (p->off_axis)
        json_object_set_new(out, "off_normal_deg", json_real(p->off_normal_deg));
    if (p->moved_screen) {
        json_object_set_new(out, "white_reference_cdm2", json_xyz(p->reference));
        json_object_set_new(out, "white_measured_cdm2", json_xyz(p->measured));
        json_object_set_new(out, "white_luminance_error_percent", json_real(p->error_percent));
    }
    return out;
}

// Null when it was not measured.
static json_t *json_view(const struct view_report *v)
{
    if (!v->measured)
        return json_null();
    return json_pack("{si,si,sf,sf,sf,sf,sf,sf}", "directions", v->directions, "places", v->places,
                     "white_before_de00", v->before_de00, "white_after_de00", v->after_de00,
                     "white_before_percent", v->before_percent, "white_after_percent",
                     v->after_percent, "place_de00", v->place_de00, "place_percent",
                     v->place_percent);
}

static json_t *json_published(void)
{
    json_t *rows = json_array();
    for (int i = 0; i < 3; i++) {
        const struct published_row *r = &published_table[i];
        json_array_append_new(
            rows, json_pack("{ss,s[ffff],s[ffff],s[ffff]}", "lamp", r->lamp, "simulation",
                            r->simulation[0], r->simulation[1], r->simulation[2], r->simulation[3],
                            "screen", r->screen[0], r->screen[1], r->screen[2], r->screen[3],
                            "screen_in_gamut", r->in_gamut[0], r->in_gamut[1], r->in_gamut[2],
                            r->in_gamut[3]));
    }
    return rows;
}

json_t *report_as_json(const struct session_facts *f)
{
    json_t *lamps = json_array(), *poses = json_array();
    for (int i = 0; i < f->lamp_count; i++)
        json_array_append_new(lamps, json_lamp(&f->lamps[i]));
    for (int i = 0; i < f->pose_count; i++)
        json_array_append_new(poses, json_pose(&f->poses[i]));
    return json_pack(
        "{ss,ss,ss,ss,ss,sb,ss,sf,so,so,so,so,so,sO,sO,s{sf,sf,sf}}", "booth", f->booth, "started", f->started,
        "finished", f->finished, "software", f->software, "observer", f->observer, "emulated",
        f->emulated, "reference",
        f->truth_emulated ? "physical sample in the emulated booth, 1 nm integration"
                          : "taught spectrum and luminance map, 1 nm integration",
        "seconds", f->seconds, "display", json_display(&f->display), "view", json_view(&f->view), "lamps", lamps, "poses", poses,
        "published_mean_std_p90_max", json_published(), "settings", f->settings, "readings",
        f->readings, "targets", "de00_mean", PROOF_MEAN_MOST, "de00_max", PROOF_MAX_MOST,
        "white_percent", PROOF_WHITE_PERCENT_MOST);
}
