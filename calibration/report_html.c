// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/proof.h"
#include "calibration/report.h"
#include "calibration/svg.h"
#include "files/write.h"

static const char *const LAMP_COLOURS[FACTS_LAMPS] = {"#c2570c", "#0e7490", "#4338ca", "#4d7c0f",
                                                      "#a21caf", "#b91c1c", "#475569", "#0f766e"};

static const char HEAD[] =
    "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>boothd accuracy report</title>\n"
    "<style>body{font:14px/1.45 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#1c1917}"
    "h1{font-size:1.7em}h2{margin-top:2em;border-bottom:1px solid #d6d3d1}"
    "table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .6em;text-align:right}"
    "td:first-child,th:first-child{text-align:left;white-space:nowrap}thead td{text-align:center}thead th{border-bottom:1px solid #78716c}"
    "tr.published td{color:#78716c;font-style:italic}.bad{color:#b91c1c}"
    ".note{background:#fef3c7;padding:.6em 1em;border-left:4px solid #d97706}"
    "svg.plot{width:100%;font-size:11px}svg .grid{stroke:#e7e5e4}"
    "svg .locus{fill:#f5f5f4;stroke:#a8a29e}svg .small{font-size:8.5px}svg text{fill:#44403c}"
    "img.screen{max-width:320px;border:1px solid #a8a29e}pre{font-size:11px;overflow:auto;max-height:30em;"
    "background:#fafaf9;padding:1em}.swatch{display:inline-block;width:1.2em;height:1em;vertical-align:middle}"
    "@media print{body{margin:0;max-width:none}pre{max-height:none;white-space:pre-wrap}h2{break-after:avoid}"
    "table,svg,img{break-inside:avoid}}</style></head><body>\n";

static const char *spectral_mode(const struct session_facts *f)
{
    const json_t *quality =
        json_object_get(json_object_get(f->settings, "settings"), "quality");
    const char *mode = json_string_value(json_object_get(quality, "spectral"));
    return mode ? mode : "unknown";
}

static void heading(FILE *out, const struct session_facts *f)
{
    fprintf(out, "<h1>Accuracy of the soft proof: ");
    svg_escaped(out, f->booth);
    fprintf(out, "</h1>\n<p>%s to %s (%.0f s), %s, observer CIE %s.</p>\n", f->started, f->finished,
            f->seconds, f->software, f->observer);
    if (f->emulated)
        fprintf(out, "<p class=\"note\"><b>Emulated instruments.</b> Every reading in this report comes from "
                     "the emulated booth: it proves the chain, not a real display.</p>\n");
    fprintf(out, "<p>Reference: %s. Colour differences are CIEDE2000.</p>\n",
            f->truth_emulated
                ? "what the radiometer would read from a physical sample at the same place, integrated at "
                  "1 nm over the whole ceiling"
                : "full reflectance spectra under the taught spectrum of the lamp, at the illuminance "
                  "that follows from its luminance map");
    fprintf(out, "<p>Every patch was shown and measured at the centre of the screen, along its normal: "
                 "off-axis fall-off and uniformity of the panel are not part of these figures. Band simulation: "
                 "band coefficients against full spectra under the taught lamp. From screen: shown with "
                 "<code>spectral = %s</code>%s.</p>\n",
            spectral_mode(f), strcmp(spectral_mode(f), "auto") ? "" : ", that is full spectra baked per lamp where they are known");
}

static void summary_row(FILE *out, const char *what, const struct summary *s)
{
    fprintf(out, "<tr><td>%s</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%d</td></tr>\n",
            what, s->mean, s->std, s->p90, s->max, s->n);
}

static void published_row(FILE *out, const char *what, const double v[4])
{
    if (v[3] > 0)
        fprintf(out,
                "<tr class=\"published\"><td>%s</td><td>%.1f</td><td>%.1f</td><td>%.1f</td><td>%.1f</td><td></td></tr>\n",
                what, v[0], v[1], v[2], v[3]);
}

static void lamp_summary(FILE *out, const struct lamp_report *l)
{
    fprintf(out, "<table><thead><tr><th>&Delta;E00</th><th>mean</th><th>std</th><th>90th</th><th>max</th>"
                 "<th>patches</th></tr></thead>\n");
    summary_row(out, "band simulation, as published", &l->proof.simulation);
    summary_row(out, "from screen, as published, in gamut", &l->proof.published_in_gamut);
    summary_row(out, "from screen, as published, all", &l->proof.published);
    summary_row(out, "from screen, absolute, in gamut", &l->proof.absolute_in_gamut);
    summary_row(out, "from screen, absolute, all", &l->proof.absolute);
    for (int i = 0; i < 3; i++) {
        if (strcmp(published_table[i].lamp, l->name))
            continue;
        published_row(out, "published: six-channel simulation", published_table[i].simulation);
        published_row(out, "published: from screen, all", published_table[i].screen);
        published_row(out, "published: from screen, in gamut", published_table[i].in_gamut);
    }
    fprintf(out,
            "</table>\n<p>Targets, from screen, in gamut, as published: mean %.1f, max %.1f; luminance of "
            "white within %.0f %%: <b%s</b>.</p>\n",
            PROOF_MEAN_MOST, PROOF_MAX_MOST, PROOF_WHITE_PERCENT_MOST,
            l->reached ? ">reached" : " class=\"bad\">missed");
}

static void lamp_bars(FILE *out, const struct lamp_report *l)
{
    const char *names[FACTS_PATCHES];
    double values[2 * FACTS_PATCHES];
    for (int i = 0; i < l->patch_count; i++) {
        names[i] = l->patches[i].name;
        values[2 * i] = l->patches[i].de_published;
        values[2 * i + 1] = l->patches[i].de_absolute;
    }
    svg_bars(out, "&Delta;E00 from screen", names, values, l->patch_count, 2,
             (const char *const[]){"#0e7490", "#d97706"}, (const char *const[]){"as published", "absolute"});
}

static void lamp_patches(FILE *out, const struct lamp_report *l)
{
    fprintf(out, "<table><thead><tr><td></td><td colspan=\"3\">reference, cd/m²</td><td colspan=\"3\">measured, "
                 "cd/m²</td><td colspan=\"3\">&Delta;E00</td></tr><tr><th>patch</th><th>X</th><th>Y</th><th>Z</th>"
                 "<th>X</th><th>Y</th><th>Z</th><th>simulation</th><th>published</th><th>absolute</th>"
                 "<th>gamut</th><th>reading</th></tr></thead>\n");
    for (int i = 0; i < l->patch_count; i++) {
        const struct patch_report *p = &l->patches[i];
        fprintf(out, "<tr><td>");
        svg_escaped(out, p->name);
        fprintf(out,
                "</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td>"
                "<td>%.2f</td><td>%.2f</td><td>%.2f</td><td%s</td><td>%d</td></tr>\n",
                p->reference.X, p->reference.Y, p->reference.Z, p->measured.X, p->measured.Y,
                p->measured.Z, p->de_simulation, p->de_published, p->de_absolute,
                p->in_gamut ? ">in" : " class=\"bad\">out", p->reading);
    }
    fprintf(out, "</table>\n");
}

static bool picture(FILE *out, const char *path, struct error *err)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t size;
    unsigned char *bytes = (unsigned char *)file_read(path, 1 << 26, &size, err);
    if (!bytes)
        return false;
    fprintf(out, "<p><img class=\"screen\" alt=\"what the screen showed\" src=\"data:image/png;base64,");
    for (size_t i = 0; i < size; i += 3) {
        unsigned group = (unsigned)bytes[i] << 16;
        group |= i + 1 < size ? (unsigned)bytes[i + 1] << 8 : 0;
        group |= i + 2 < size ? bytes[i + 2] : 0;
        char four[4] = {digits[group >> 18], digits[group >> 12 & 63],
                        i + 1 < size ? digits[group >> 6 & 63] : '=', i + 2 < size ? digits[group & 63] : '='};
        fwrite(four, 1, 4, out);
    }
    fprintf(out, "\"></p>\n");
    free(bytes);
    return true;
}

static bool lamp_section(FILE *out, const struct lamp_report *l, struct error *err)
{
    fprintf(out, "<h2>Lamp ");
    svg_escaped(out, l->name);
    fprintf(out, "</h2>\n<p>");
    if (*l->asked) {
        fprintf(out, "Spectrum of the emulated lamp: ");
        svg_escaped(out, l->asked);
        fprintf(out, ". ");
    }
    fprintf(out, "Taught from %d readings (spread %.2f %%): %.0f lx at the spectrometer, x %.4f, y %.4f",
            l->teach_readings, 100 * l->spread, l->lux, l->chromaticity.x, l->chromaticity.y);
    if (l->cct.valid)
        fprintf(out, ", CCT %.0f K, Duv %+.4f", l->cct.kelvin, l->cct.duv);
    fprintf(out,
            ". Luminance map scaled by %.4f from %d spot readings. Perfect diffuser at the screen: %.1f cd/m², "
            "shown %.1f cd/m² (%+.2f %%).</p>\n",
            l->map_scale, l->spots, l->white_reference.Y, l->white_measured.Y, l->white_error_percent);
    lamp_summary(out, l);
    if (*l->picture && !picture(out, l->picture, err))
        return false;
    lamp_bars(out, l);
    lamp_patches(out, l);
    return true;
}

static void spectra(FILE *out, const struct session_facts *f)
{
    static double nm[SPECTRUM_COUNT];
    struct svg_series series[FACTS_LAMPS];
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        nm[i] = SPECTRUM_FIRST_NM + i;
    for (int i = 0; i < f->lamp_count; i++)
        series[i] = (struct svg_series){f->lamps[i].name, LAMP_COLOURS[i], 421, nm,
                                        f->lamps[i].irradiance.v};
    fprintf(out, "<h2>Lamps as taught</h2>\n");
    svg_lines(out, "wavelength, nm", "W m&#8315;&#178; nm&#8315;&#185;", series, f->lamp_count);
}

static void chromaticities(FILE *out, const struct session_facts *f)
{
    double u[FACTS_LAMPS][FACTS_PATCHES], v[FACTS_LAMPS][FACTS_PATCHES];
    struct svg_series series[FACTS_LAMPS];
    enum observer observer = OBSERVER_1931_2;
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
    fprintf(out, "<h2>Patches as measured from the screen</h2>\n");
    svg_chromaticities(out, observer, series, f->lamp_count);
}

static void display_section(FILE *out, const struct display_report *d)
{
    fprintf(out,
            "<h2>Display model</h2>\n<p>Day/Taplin/Berns from %d patches (<code>%s</code>), checked on %d others. "
            "White %.1f cd/m², black %.3f cd/m², condition of the primaries %.1f, white drifted by %.2f %%.</p>\n"
            "<table><thead><tr><th>&Delta;E00</th><th>mean</th><th>std</th><th>90th</th><th>max</th>"
            "<th>patches</th></tr></thead>\n",
            d->patches, d->measurements, d->verified, d->white.Y, d->black.Y, d->condition,
            d->white_drift_percent);
    summary_row(out, "fitted patches", &d->fit);
    summary_row(out, "patches kept apart", &d->verification);
    fprintf(out, "</table>\n");
}

static void view(FILE *out, const struct view_report *v)
{
    if (!v->measured)
        return;
    fprintf(out,
            "<h2>Display by direction and place</h2>\n<table><thead><tr><th>white</th><th>largest "
            "difference</th><th>CIEDE2000</th></tr></thead>\n"
            "<tr><td>%d directions, uncorrected</td><td>%+.1f %%</td><td>%.2f</td></tr>\n"
            "<tr><td>the same, corrected</td><td>%+.2f %%</td><td>%.2f</td></tr>\n"
            "<tr><td>%d places, uncorrected</td><td>%+.1f %%</td><td>%.2f</td></tr>\n</table>\n",
            v->directions, v->before_percent, v->before_de00, v->after_percent, v->after_de00,
            v->places, v->place_percent, v->place_de00);
}

static void poses(FILE *out, const struct session_facts *f)
{
    fprintf(out, "<h2>Screen tilted, head moved</h2>\n<table><thead><tr><th>tilt</th><th>seen</th>"
                 "<th>eye off the normal</th>"
                 "<th>eye off by, mm</th><th>white reference</th><th>white shown, cd/m²</th><th>error</th></tr></thead>\n");
    for (int i = 0; i < f->pose_count; i++) {
        const struct pose_report *p = &f->poses[i];
        fprintf(out, "<tr><td>%.1f°</td><td>%.2f°</td><td>", p->tilt_deg, p->tilt_seen_deg);
        if (p->off_axis)
            fprintf(out, "%.0f°", p->off_normal_deg);
        fprintf(out, "</td><td>%.1f</td>",
                1000 * vec3_length(vec3_sub(p->eye, p->eye_seen)));
        if (p->moved_screen)
            fprintf(out, "<td>%.1f</td><td>%.1f</td><td>%+.2f %%</td></tr>\n", p->reference.Y,
                    p->measured.Y, p->error_percent);
        else
            fprintf(out, "<td></td><td></td><td></td></tr>\n");
    }
    fprintf(out, "</table>\n");
}

static void raw(FILE *out, const char *title, const json_t *value, size_t flags)
{
    char *text = json_dumps(value, flags);
    fprintf(out, "<h2>%s</h2>\n<pre>", title);
    if (text)
        svg_escaped(out, text);
    fprintf(out, "</pre>\n");
    free(text);
}

static void raw_readings(FILE *out, const json_t *readings)
{
    fprintf(out, "<h2>Every raw reading</h2>\n<p>One a line, numbered from 0 as the tables refer to them.</p>\n<pre>");
    for (size_t i = 0; i < json_array_size(readings); i++) {
        char *text = json_dumps(json_array_get(readings, i), JSON_COMPACT | JSON_REAL_PRECISION(6));
        fprintf(out, "%zu ", i);
        if (text)
            svg_escaped(out, text);
        fprintf(out, "\n");
        free(text);
    }
    fprintf(out, "</pre>\n");
}

bool report_as_html(const struct session_facts *f, FILE *out, struct error *err)
{
    fputs(HEAD, out);
    heading(out, f);
    fprintf(out, "<p>As published: each set divided by 1.13 times the luminance of its own white patch, CAT02 "
                 "(D = 1) from the lamp's perfect diffuser to D65. Absolute: cd/m², no division, no adaptation. "
                 "Published figures: RIT light-booth display.</p>\n");
    for (int i = 0; i < f->lamp_count; i++)
        if (!lamp_section(out, &f->lamps[i], err))
            return false;
    spectra(out, f);
    chromaticities(out, f);
    display_section(out, &f->display);
    view(out, &f->view);
    poses(out, f);
    raw(out, "Settings", f->settings, JSON_INDENT(2));
    raw_readings(out, f->readings);
    fputs("</body></html>\n", out);
    return true;
}
