// SPDX-License-Identifier: Apache-2.0
#include "calibration/report_words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/svg.h"

static const char *const LAMP_COLOURS[FACTS_LAMPS] = {"#c2570c", "#0e7490", "#4338ca", "#4d7c0f",
                                                      "#a21caf", "#b91c1c", "#475569", "#0f766e"};
static const char NOT_MEASURED[] = "not measured";

static const json_t *setting(const struct session_facts *f, const char *section, const char *key)
{
    const json_t *all = json_object_get(f->settings, "settings");
    return json_object_get(json_object_get(all, section), key);
}

static const char *spectral_mode(const struct session_facts *f)
{
    const char *mode = json_string_value(setting(f, "quality", "spectral"));
    return mode ? mode : "unknown";
}

static void what_it_is(const struct session_facts *f, struct document *d)
{
    document_heading(d, 1, "Accuracy of the soft proof: %s", f->booth);
    document_paragraph(d, TONE_PLAIN, "%s to %s (%.0f s), %s, observer CIE %s.", f->started,
                       f->finished, f->seconds, f->software, f->observer);
    if (f->emulated)
        document_paragraph(d, TONE_NOTE,
                           "Emulated instruments. Every reading in this report comes from the "
                           "emulated booth: it proves the chain, not a real display.");
    document_paragraph(
        d, TONE_PLAIN, "Reference: %s. Colour differences are CIEDE2000.",
        f->truth_emulated
            ? "what the radiometer would read from a physical sample at the same place, integrated "
              "at 1 nm over the whole ceiling"
            : "full reflectance spectra under the taught spectrum of the lamp, at the illuminance "
              "that follows from its luminance map");
    document_paragraph(
        d, TONE_PLAIN,
        "Normalisation: absolute is cd/m², no division, no adaptation; as published, each set is "
        "divided by 1.13 times the luminance of its own white patch and adapted by CAT02 (D = 1) "
        "from the lamp's perfect diffuser to D65. Published figures: RIT light-booth display.");
    document_paragraph(
        d, TONE_PLAIN,
        "Patches of %s were shown and read at the centre of the screen, %s. Band simulation: band "
        "coefficients against full spectra under the taught lamp. From screen: shown with spectral "
        "= %s%s.",
        *f->material ? f->material : "the chart",
        f->view.measured ? "from the place of the eye" : "along its normal", spectral_mode(f),
        strcmp(spectral_mode(f), "auto")
            ? ""
            : ", that is full spectra baked per lamp where they are known");
}

// ---- where it comes from -----------------------------------------------------------

static void instruments(const struct session_facts *f, struct document *d)
{
    struct document_table t;
    const char *kind;
    json_t *i;
    table_begin(&t, "instrument\tmodel\tserial\tfirmware\tdriver\tstate");
    json_object_foreach(json_object_get(f->settings, "instruments"), kind, i)
    {
        const char *v[] = {"model", "serial", "firmware", "driver", "state"};
        for (int k = 0; k < 5; k++) {
            v[k] = json_string_value(json_object_get(i, v[k]));
            v[k] = v[k] && *v[k] ? v[k] : "-";
        }
        table_row(&t, TONE_PLAIN, "%s\t%s\t%s\t%s\t%s\t%s", kind, v[0], v[1], v[2], v[3], v[4]);
    }
    document_table(d, &t);
}

static void provenance(const struct report *r, struct document *d)
{
    const struct session_facts *f = r->facts;
    const char *display =
        json_string_value(json_object_get(json_object_get(f->settings, "display"), "model"));
    document_heading(d, 2, "Identity, settings, environment");
    instruments(f, d);
    document_paragraph(d, TONE_PLAIN, "Display: %s. SHA-256 of the settings: %s.",
                       display ? display : "not named", r->settings_sha256);
    document_paragraph(d, TONE_PLAIN, "Environment: %s.",
                       *f->environment ? f->environment
                                       : "not recorded (no instrument here reads temperature)");
    document_paragraph(d, TONE_PLAIN,
                       "Screen at a tilt of %.2f°, eye at x %.3f, y %.3f, z %.3f m in the booth.",
                       f->place.tilt_deg, f->place.eye.x, f->place.eye.y, f->place.eye.z);
}

static void inputs(const struct report *r, struct document *d)
{
    struct document_table t;
    document_heading(d, 2, "What this report was made from");
    table_begin(&t, "file\tSHA-256");
    for (int i = 0; i < r->inputs.count; i++)
        table_row(&t, TONE_PLAIN, "%s\t%s", r->inputs.of[i].path, r->inputs.of[i].digest.hex);
    document_table(d, &t);
    for (int i = 0; i < r->missing_count; i++)
        document_paragraph(d, TONE_BAD, "No longer there: %s.", r->missing[i]);
}

static void uncertainties(const struct report *r, struct document *d)
{
    struct document_table t;
    document_heading(d, 2, "Standard uncertainties that the budget starts from");
    document_paragraph(
        d, TONE_PLAIN,
        "%s. k = 1; JCGM 101 Monte Carlo of %d draws, spectral errors as waves of random phase. "
        "What the session found out itself (repeatability, drift, spread of spot readings, "
        "residuals of the display model) counts where it is larger.",
        *r->uncertainty_file ? r->uncertainty_file : "Presets", r->draws);
    table_begin(&t, "cause\tvalue\tunit\twhat");
    for (const struct setting *row = uncertainty_settings; row->name; row++) {
        char text[64];
        settings_get(row, &r->u, text, sizeof text);
        table_row(&t, TONE_PLAIN, "%s\t%s\t%s\t%s", row->name, text, row->unit, row->help);
    }
    document_table(d, &t);
}

// ---- the display ---------------------------------------------------------------------

static void summary_row(struct document_table *t, const char *what, const struct summary *s)
{
    table_row(t, TONE_PLAIN, "%s\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%d", what, s->mean, s->median,
              s->p90, s->p95, s->p99, s->max, s->n);
}

static void display(const struct session_facts *f, struct document *d)
{
    const struct display_report *m = &f->display;
    struct document_table t;
    document_heading(d, 2, "Display model");
    document_paragraph(d, TONE_PLAIN,
                       "From %d patches (%s), checked on %d others. White %.1f cd/m², black %.3f "
                       "cd/m², condition of the primaries %.1f.",
                       m->patches, m->measurements, m->verified, m->white.Y, m->black.Y,
                       m->condition);
    document_paragraph(d, TONE_PLAIN,
                       "Warm-up: white was waited for %.0f s, its slope then %+.2f %%/h; %.2f s "
                       "after each patch; white drifted by %.2f %% while the display was measured.",
                       m->warm_up_s, m->warm_up_percent_h, m->settle_s, m->white_drift_percent);
    table_begin(&t, "ΔE00\tmean\tmedian\t90th\t95th\t99th\tmax\tpatches");
    summary_row(&t, "fitted patches", &m->fit);
    summary_row(&t, "patches kept apart", &m->verification);
    document_table(d, &t);
}

static void view(const struct session_facts *f, struct document *d)
{
    const struct view_report *v = &f->view;
    struct document_table t;
    document_heading(d, 2, "Display by direction and place");
    if (!v->measured) {
        document_paragraph(d, TONE_PLAIN, "Off-axis light and uniformity: %s.", NOT_MEASURED);
        return;
    }
    table_begin(&t, "white\tlargest difference\tΔE00");
    table_row(&t, TONE_PLAIN, "%d directions, uncorrected\t%+.1f %%\t%.2f", v->directions,
              v->before_percent, v->before_de00);
    table_row(&t, TONE_PLAIN, "the same, corrected\t%+.2f %%\t%.2f", v->after_percent,
              v->after_de00);
    table_row(&t, TONE_PLAIN, "%d places, uncorrected\t%+.1f %%\t%.2f", v->places, v->place_percent,
              v->place_de00);
    document_table(d, &t);
}

static void poses(const struct session_facts *f, struct document *d)
{
    struct document_table t;
    document_heading(d, 2, "Screen tilted, head moved");
    table_begin(&t, "tilt\tseen\teye off the normal\teye off by, mm\twhite expected, cd/m²\tshown\t"
                    "error");
    for (int i = 0; i < f->pose_count; i++) {
        const struct pose_report *p = &f->poses[i];
        char axis[16] = "", white[96] = "\t\t";
        if (p->off_axis)
            snprintf(axis, sizeof axis, "%.0f°", p->off_normal_deg);
        if (p->moved_screen)
            snprintf(white, sizeof white, "%.1f\t%.1f\t%+.2f %%", p->reference.Y, p->measured.Y,
                     p->error_percent);
        table_row(&t, TONE_PLAIN, "%.1f°\t%.2f°\t%s\t%.1f\t%s", p->tilt_deg, p->tilt_seen_deg, axis,
                  1000 * vec3_length(vec3_sub(p->eye, p->eye_seen)), white);
    }
    document_table(d, &t);
}

// ---- charts --------------------------------------------------------------------------

static void spectra(const struct session_facts *f, struct document *d)
{
    static double nm[SPECTRUM_COUNT];
    struct svg_series series[FACTS_LAMPS];
    char *svg = NULL;
    size_t size;
    FILE *out = open_memstream(&svg, &size);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        nm[i] = SPECTRUM_FIRST_NM + i;
    for (int i = 0; i < f->lamp_count; i++)
        series[i] = (struct svg_series){f->lamps[i].name, LAMP_COLOURS[i], 421, nm,
                                        f->lamps[i].irradiance.v};
    document_heading(d, 2, "Lamps as taught");
    if (!out)
        return;
    svg_lines(out, "wavelength, nm", "W m⁻² nm⁻¹", series, f->lamp_count);
    fclose(out);
    document_chart(d, svg, size);
    free(svg);
}

static void chromaticities(const struct session_facts *f, struct document *d)
{
    double u[FACTS_LAMPS][FACTS_PATCHES], v[FACTS_LAMPS][FACTS_PATCHES];
    struct svg_series series[FACTS_LAMPS];
    enum observer observer = OBSERVER_1931_2;
    char *svg = NULL;
    size_t size;
    FILE *out = open_memstream(&svg, &size);
    observer_from_name(f->observer, &observer);
    for (int l = 0; l < f->lamp_count; l++) {
        const struct lamp_report *lamp = &f->lamps[l];
        for (int i = 0; i < lamp->patch_count; i++) {
            struct uv c = uv_of(lamp->patches[i].measured);
            u[l][i] = c.u;
            v[l][i] = c.v;
        }
        series[l] = (struct svg_series){lamp->name, LAMP_COLOURS[l], lamp->patch_count, u[l], v[l]};
    }
    document_heading(d, 2, "Patches as measured from the screen");
    if (!out)
        return;
    svg_chromaticities(out, observer, series, f->lamp_count);
    fclose(out);
    document_chart(d, svg, size);
    free(svg);
}

// ---- raw ---------------------------------------------------------------------------

static void raw(const char *title, const json_t *value, const char *where, struct document *d)
{
    char *text = json_dumps(value, JSON_INDENT(2) | JSON_ENCODE_ANY);
    document_heading(d, 2, "%s", title);
    document_verbatim(d, text ? text : "", where);
    free(text);
}

// One a line, numbered from 0 as the tables refer to them.
static void readings(const json_t *all, struct document *d)
{
    char *lines = NULL;
    size_t size, i;
    json_t *reading;
    FILE *out = open_memstream(&lines, &size);
    document_heading(d, 2, "Every raw reading");
    if (!out)
        return;
    json_array_foreach((json_t *)all, i, reading)
    {
        char *text = json_dumps(reading, JSON_COMPACT | JSON_REAL_PRECISION(6));
        fprintf(out, "%zu %s\n", i, text ? text : "");
        free(text);
    }
    fclose(out);
    document_verbatim(d, lines, "\"readings\" in report.json");
    free(lines);
}

void report_words(const struct report *r, struct document *d)
{
    const struct session_facts *f = r->facts;
    what_it_is(f, d);
    for (int i = 0; i < f->lamp_count; i++)
        report_lamp_words(r, i, d);
    spectra(f, d);
    chromaticities(f, d);
    display(f, d);
    view(f, d);
    poses(f, d);
    provenance(r, d);
    uncertainties(r, d);
    inputs(r, d);
    raw("Settings", f->settings, "\"settings\" in report.json", d);
    readings(f->readings, d);
    document_seal(d);
}
