// SPDX-License-Identifier: Apache-2.0
#include "calibration/audit_report.h"

#include <stdlib.h>
#include <string.h>

#include "files/write.h"

enum { AUDIT_BYTES = 1 << 26 };
static const char KIND[] = "boothd audit";

// ---- JSON --------------------------------------------------------------------

static json_t *numbers(const double *v, int count)
{
    json_t *out = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(out, json_real(v[i]));
    return out;
}

static json_t *figures_json(const struct audit_lamp *l)
{
    json_t *out = json_array();
    for (int i = 0; i < FIGURES; i++) {
        const struct audit_limits *limits = &audit_limits[i];
        const struct audit_row *row = &l->figures[i];
        json_t *one =
            json_pack("{ss,ss,sf,ss}", "figure", limits->name, "unit", limits->unit, "least",
                      limits->least, "verdict", audit_verdict_name(row->verdict));
        if (isfinite(limits->most))
            json_object_set_new(one, "most", json_real(limits->most));
        if (row->verdict == FIGURE_NOT_COMPUTED)
            json_object_set_new(one, "why", json_string(row->why));
        else
            json_object_set_new(one, "value", json_real(row->value));
        json_array_append_new(out, one);
    }
    return out;
}

static void add_rendering(json_t *out, const struct audit_lamp *l)
{
    const struct rendering *r = &l->rendering;
    if (!l->rendered) {
        json_object_set_new(out, "Ra", json_null());
        json_object_set_new(out, "Ra_not_computed", json_string(l->no_rendering));
        return;
    }
    json_object_set_new(out, "Ra", json_real(r->general));
    json_object_set_new(out, "R1_R14", numbers(r->special, TEST_COLOURS));
    json_object_set_new(out, "reference", json_string(r->daylight ? "daylight" : "Planckian"));
    json_object_set_new(out, "distance_uv1960", json_real(r->distance));
    json_object_set_new(out, "indices_meaningful", json_boolean(r->distance <= RENDERING_FARTHEST));
}

static void add_colour(json_t *out, const struct audit_lamp *l)
{
    json_object_set_new(out, "xy", json_pack("[ff]", l->xy.x, l->xy.y));
    json_object_set_new(out, "u_v_", json_pack("[ff]", l->uv.u, l->uv.v));
    json_object_set_new(out, "u_10_v_10", json_pack("[ff]", l->uv_10.u, l->uv_10.v));
    json_object_set_new(out, "cct_K", l->cct.valid ? json_real(l->cct.kelvin) : json_null());
    json_object_set_new(out, "duv", l->cct.valid ? json_real(l->cct.duv) : json_null());
}

static json_t *lamp_json(const struct audit_lamp *l)
{
    json_t *out = json_pack("{ss,ss,ss,ss,sb,si,sf}", "name", l->name, "source", l->source,
                            "instrument", l->instrument, "taken", l->taken, "absolute", l->absolute,
                            "readings", l->readings, "spread", l->spread);
    json_object_set_new(out, "illuminance_lx", l->absolute ? json_real(l->lux) : json_null());
    json_object_set_new(out, "places_lx", numbers(l->place_lux, l->places));
    json_object_set_new(out, "uniformity", l->places ? json_real(l->uniformity) : json_null());
    add_colour(out, l);
    add_rendering(out, l);
    json_object_set_new(out, "iso3664_2009", figures_json(l));
    json_object_set_new(out, "spectrum_360_830", numbers(l->irradiance.v, SPECTRUM_COUNT));
    return out;
}

static json_t *metamerism_json(const struct audit_facts *f)
{
    json_t *out = json_array();
    for (int i = 0; i < f->metamerism_count; i++) {
        const struct audit_metamerism *m = &f->metamerism[i];
        json_array_append_new(out,
                              json_pack("{ss,ss,ss,sf,sf,sf}", "pair", f->pairs[m->pair], "matched",
                                        f->lamps[m->matched].name, "other", f->lamps[m->other].name,
                                        "match_dEab", m->index.match_ab, "index_dEab",
                                        m->index.index_ab, "index_dE00", m->index.index_2000));
    }
    return out;
}

static json_t *missing_json(const struct audit_facts *f)
{
    json_t *out = json_array();
    for (const struct audit_missing *m = audit_missing; m->what; m++)
        json_array_append_new(out, json_pack("{ss,ss}", "what", m->what, "why", m->why));
    if (!f->pair_count)
        json_array_append_new(out, json_pack("{ss,ss}", "what", "special metamerism indices", "why",
                                             "no sample pairs were given"));
    return out;
}

static json_t *drift_json(const struct audit_facts *f)
{
    json_t *lamps = json_array();
    if (!f->compared)
        json_decref(lamps);
    for (int i = 0; f->compared && i < f->drift_count; i++) {
        const struct audit_drift *d = &f->drift[i];
        json_t *one = json_pack("{ss,sf,sf}", "name", f->lamps[d->lamp].name, "u_v_", d->uv,
                                "shape", d->shape);
        json_object_set_new(one, "illuminance_percent",
                            d->level ? json_real(d->lux_percent) : json_null());
        json_object_set_new(one, "cct_K", d->cct ? json_real(d->kelvin) : json_null());
        json_object_set_new(one, "Ra", d->ra ? json_real(d->ra_by) : json_null());
        json_array_append_new(lamps, one);
    }
    return f->compared ? json_pack("{ss,so}", "since", f->since, "lamps", lamps) : json_null();
}

json_t *audit_as_json(const struct audit_facts *f)
{
    json_t *lamps = json_array();
    for (int i = 0; i < f->lamp_count; i++)
        json_array_append_new(lamps, lamp_json(&f->lamps[i]));
    return json_pack("{ss,ss,ss,ss,ss,sb,so,so,so,so,so,ss}", "kind", KIND, "made", f->made,
                     "software", f->software, "booth", f->booth, "observer", "1931-2", "emulated",
                     f->emulated, "lamps", lamps, "metamerism", metamerism_json(f), "drift",
                     drift_json(f), "not_computed", missing_json(f), "inputs",
                     sealed_inputs_json(&f->inputs), "seal", SEAL_BLANK);
}

bool audit_save(const struct audit_facts *facts, const char *path, struct error *err)
{
    json_t *audit = audit_as_json(facts);
    char *text = audit ? json_dumps(audit, JSON_INDENT(1) | JSON_REAL_PRECISION(12)) : NULL;
    bool fine = text ? seal_write(path, text, strlen(text), err)
                     : fail(err, ERROR_DATA, "%s: a name in it is no UTF-8 text", path);
    free(text);
    json_decref(audit);
    return fine;
}

// ---- reading back --------------------------------------------------------------

static void take_text(const json_t *from, const char *key, char *out, size_t size)
{
    const char *text = json_string_value(json_object_get(from, key));
    snprintf(out, size, "%s", text ? text : "");
}

static bool take_numbers(const json_t *from, int count, double *out)
{
    if ((int)json_array_size(from) != count)
        return false;
    for (int i = 0; i < count; i++) {
        const json_t *v = json_array_get(from, (size_t)i);
        out[i] = json_number_value(v);
        if (!json_is_number(v))
            return false;
    }
    return true;
}

static bool take_lamp(const json_t *from, struct audit_lamp *l, struct error *err)
{
    const json_t *places = json_object_get(from, "places_lx");
    take_text(from, "name", l->name, sizeof l->name);
    take_text(from, "instrument", l->instrument, sizeof l->instrument);
    l->absolute = json_is_true(json_object_get(from, "absolute"));
    l->places = (int)json_array_size(places);
    if ((l->places &&
         (l->places != AUDIT_PLACES || !take_numbers(places, AUDIT_PLACES, l->place_lux))) ||
        !take_numbers(json_object_get(from, "spectrum_360_830"), SPECTRUM_COUNT, l->irradiance.v))
        return fail(err, ERROR_DATA, "lamp \"%s\" has no spectrum of %d values", l->name,
                    SPECTRUM_COUNT);
    return true;
}

static bool take_audit(const json_t *from, struct audit_facts *f, struct error *err)
{
    char kind[32];
    size_t i;
    json_t *lamp;
    const json_t *lamps = json_object_get(from, "lamps");
    take_text(from, "kind", kind, sizeof kind);
    take_text(from, "made", f->made, sizeof f->made);
    if (strcmp(kind, KIND) || json_array_size(lamps) > AUDIT_LAMPS)
        return fail(err, ERROR_DATA, "no audit that boothcal wrote");
    json_array_foreach(lamps, i,
                       lamp) if (!take_lamp(lamp, &f->lamps[f->lamp_count++], err)) return false;
    return audit_judge(f, err);
}

bool audit_load(const char *path, struct audit_facts *facts, struct error *err)
{
    size_t size;
    json_error_t why;
    *facts = (struct audit_facts){0};
    char *text = file_read(path, AUDIT_BYTES, &size, err);
    if (!text)
        return false;
    bool fine = seal_check(text, size, NULL, err);
    json_t *from = fine ? json_loadb(text, size, 0, &why) : NULL;
    free(text);
    if (fine && !from)
        fine = fail(err, ERROR_DATA, "line %d: %s", why.line, why.text);
    fine = fine && take_audit(from, facts, err);
    json_decref(from);
    return fine || while_doing(err, "%s", path);
}

// ---- text ----------------------------------------------------------------------

static void lamp_text(const struct audit_lamp *l, FILE *out)
{
    fprintf(out, "\nLamp %s (%s%s%s)\n", l->name, l->source, *l->taken ? ", " : "", l->taken);
    if (l->absolute)
        fprintf(out, "  illuminance %.0f lx", l->lux);
    else
        fprintf(out, "  illuminance not computed: the spectrum is relative");
    if (l->readings)
        fprintf(out, ", %d readings, spread %.2f %%", l->readings, 100 * l->spread);
    fprintf(out, "\n  x %.4f, y %.4f, u' %.4f, v' %.4f, ", l->xy.x, l->xy.y, l->uv.u, l->uv.v);
    if (l->cct.valid)
        fprintf(out, "CCT %.0f K, Duv %+.4f\n", l->cct.kelvin, l->cct.duv);
    else
        fprintf(out, "no correlated colour temperature\n");
    if (!l->rendered) {
        fprintf(out, "  Ra not computed: %s\n", l->no_rendering);
        return;
    }
    fprintf(out, "  Ra %.1f; R1..R14", l->rendering.general);
    for (int i = 0; i < TEST_COLOURS; i++)
        fprintf(out, " %.0f", l->rendering.special[i]);
    fprintf(out, "%s\n",
            l->rendering.distance > RENDERING_FARTHEST
                ? " (too far from its reference for them to mean much)"
                : "");
}

static void figures_text(const struct audit_lamp *l, FILE *out)
{
    for (int i = 0; i < FIGURES; i++) {
        const struct audit_limits *limits = &audit_limits[i];
        const struct audit_row *row = &l->figures[i];
        char range[48];
        if (isfinite(limits->most))
            snprintf(range, sizeof range, "%g..%g", limits->least, limits->most);
        else
            snprintf(range, sizeof range, ">= %g", limits->least);
        fprintf(out, "    %-34s %11s %-2s  ", limits->name, range, limits->unit);
        if (row->verdict == FIGURE_NOT_COMPUTED)
            fprintf(out, "not computed: %s\n", row->why);
        else
            fprintf(out, "%.4g: %s\n", row->value, audit_verdict_name(row->verdict));
    }
}

static void drift_text(const struct audit_facts *f, FILE *out)
{
    fprintf(out, "\nDrift since %s\n", f->since);
    for (int i = 0; i < f->drift_count; i++) {
        const struct audit_drift *d = &f->drift[i];
        fprintf(out, "  %s: u'v' %.4f, shape %.4f", f->lamps[d->lamp].name, d->uv, d->shape);
        if (d->level)
            fprintf(out, ", illuminance %+.1f %%", d->lux_percent);
        if (d->cct)
            fprintf(out, ", CCT %+.0f K", d->kelvin);
        if (d->ra)
            fprintf(out, ", Ra %+.1f", d->ra_by);
        fprintf(out, "\n");
    }
    if (!f->drift_count)
        fprintf(out, "  no lamp of the same name\n");
}

void audit_as_text(const struct audit_facts *f, FILE *out)
{
    fprintf(out, "Audit of %s, %s, %s%s\n", *f->booth ? f->booth : "lamps", f->made, f->software,
            f->emulated ? ", EMULATED instruments" : "");
    for (int i = 0; i < f->lamp_count; i++) {
        lamp_text(&f->lamps[i], out);
        fprintf(out,
                "  beside the figures of ISO 3664:2009 (for D50; no statement of conformity)\n");
        figures_text(&f->lamps[i], out);
    }
    if (f->pair_count)
        fprintf(
            out,
            "\nSpecial metamerism indices   matched (dE*ab there) -> other: index dE*ab (dE00)\n");
    for (int i = 0; i < f->metamerism_count; i++) {
        const struct audit_metamerism *m = &f->metamerism[i];
        fprintf(out, "  %-32s %s (%.2f) -> %s: %.2f (%.2f)\n", f->pairs[m->pair],
                f->lamps[m->matched].name, m->index.match_ab, f->lamps[m->other].name,
                m->index.index_ab, m->index.index_2000);
    }
    if (f->compared)
        drift_text(f, out);
    fprintf(out, "\nNot computed\n");
    if (!f->pair_count)
        fprintf(out, "  special metamerism indices: no sample pairs were given\n");
    for (const struct audit_missing *m = audit_missing; m->what; m++)
        fprintf(out, "  %s: %s\n", m->what, m->why);
}
