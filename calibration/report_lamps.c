// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/proof.h"
#include "calibration/report_words.h"
#include "calibration/svg.h"

static void opening(const struct lamp_report *l, struct document *d)
{
    char cct[64] = "";
    document_heading(d, 2, "Lamp %s", l->name);
    if (*l->asked)
        document_paragraph(d, TONE_PLAIN, "Spectrum of the emulated lamp: %s.", l->asked);
    if (l->cct.valid)
        snprintf(cct, sizeof cct, ", CCT %.0f K, Duv %+.4f", l->cct.kelvin, l->cct.duv);
    document_paragraph(
        d, TONE_PLAIN,
        "Taught from %d readings (spread %.2f %%): %.0f lx at the spectrometer, x "
        "%.4f, y %.4f%s. Luminance map scaled by %.4f from %d spot readings. %.0f lx "
        "on the screen.",
        l->teach_readings, 100 * l->spread, l->lux, l->chromaticity.x, l->chromaticity.y, cct,
        l->map_scale, l->spots, l->proof_lux);
    document_paragraph(d, TONE_PLAIN,
                       "Perfect diffuser at the screen: %.1f cd/m², shown %.1f cd/m² (%+.2f %%). "
                       "Repeatability over %d readings: %.3f %% in luminance, %.3f %% in X/Y and "
                       "Z/Y. Drift over the chart's readings: %+.2f %%.",
                       l->white_reference.Y, l->white_measured.Y, l->white_error_percent,
                       l->repeats, 100 * l->repeat_level, 100 * l->repeat_colour,
                       l->chart_drift_percent);
}

// ---- summaries -----------------------------------------------------------------------

static void summary_row(struct document_table *t, const char *what, const struct summary *s)
{
    if (s->n)
        table_row(t, TONE_PLAIN, "%s\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%d", what, s->mean,
                  s->std, s->median, s->p90, s->p95, s->p99, s->max, s->n);
}

static void published_row(struct document_table *t, const char *what, const double v[4])
{
    if (v[3] > 0)
        table_row(t, TONE_MUTED, "%s\t%.1f\t%.1f\t\t%.1f\t\t\t%.1f\t", what, v[0], v[1], v[2],
                  v[3]);
}

static void summaries(const struct lamp_report *l, const struct report_lamp *own,
                      struct document *d)
{
    struct document_table t;
    table_begin(&t, "ΔE00\tmean\tstd\tmedian\t90th\t95th\t99th\tmax\tpatches");
    summary_row(&t, "band simulation, as published", &l->proof.simulation);
    summary_row(&t, "from screen, as published, in gamut", &l->proof.published_in_gamut);
    summary_row(&t, "out of gamut", &own->published_out);
    summary_row(&t, "floor of those: closest colour in gamut", &own->floor_published);
    summary_row(&t, "from screen, as published, all", &l->proof.published);
    summary_row(&t, "from screen, absolute, in gamut", &l->proof.absolute_in_gamut);
    summary_row(&t, "out of gamut", &own->absolute_out);
    summary_row(&t, "floor of those: closest colour in gamut", &own->floor_absolute);
    summary_row(&t, "from screen, absolute, all", &l->proof.absolute);
    for (int i = 0; i < 3; i++) {
        if (strcmp(published_table[i].lamp, l->name))
            continue;
        published_row(&t, "published: six-channel simulation", published_table[i].simulation);
        published_row(&t, "published: from screen, all", published_table[i].screen);
        published_row(&t, "published: from screen, in gamut", published_table[i].in_gamut);
    }
    document_table(d, &t);
    document_paragraph(d, l->reached ? TONE_PLAIN : TONE_BAD,
                       "Targets, from screen, in gamut, as published: mean %.2g, max %.2g; "
                       "luminance of white within %.2g %%: %s.",
                       PROOF_MEAN_MOST, PROOF_MAX_MOST, PROOF_WHITE_PERCENT_MOST,
                       l->reached ? "reached" : "missed");
}

// ---- uncertainty ---------------------------------------------------------------------

enum { WAYS = 4 };

// Shares of the variance of L, C, H, over all patches together.
static void shares_of(const struct budget *b, const struct budget_difference *all,
                      double share[CAUSES])
{
    double whole = 0;
    memset(share, 0, CAUSES * sizeof *share);
    for (int i = 0; i < b->count; i++) {
        const struct budget_figure *f[] = {&all[i].L, &all[i].C, &all[i].H};
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < CAUSES; c++) {
                share[c] += f[k]->share[c] * f[k]->u * f[k]->u;
                whole += f[k]->share[c] * f[k]->u * f[k]->u;
            }
    }
    for (int c = 0; c < CAUSES && whole > 0; c++)
        share[c] /= whole;
}

static void shares(const struct report_lamp *own, struct document *d)
{
    double v[WAYS][CAUSES];
    struct document_table t;
    shares_of(&own->measured, own->measured.published, v[0]);
    shares_of(&own->measured, own->measured.absolute, v[1]);
    shares_of(&own->shown, own->shown.published, v[2]);
    shares_of(&own->shown, own->shown.absolute, v[3]);
    table_begin(&t, "share of the variance of ΔL, ΔC, ΔH\tas read, published\tas read, absolute\t"
                    "as shown, published\tas shown, absolute");
    for (int c = 0; c < CAUSES; c++)
        table_row(&t, TONE_PLAIN, "%s\t%.0f %%\t%.0f %%\t%.0f %%\t%.0f %%",
                  budget_cause_name((enum budget_cause)c), 100 * v[0][c], 100 * v[1][c],
                  100 * v[2][c], 100 * v[3][c]);
    document_table(d, &t);
}

static void overall_row(struct document_table *t, const char *what, const struct budget_overall *o)
{
    table_row(t, TONE_PLAIN, "%s\t%.2f ± %.2f\t%.2f ± %.2f", what, o->mean, 2 * o->mean_u, o->max,
              2 * o->max_u);
}

static void uncertainty(const struct report_lamp *own, struct document *d)
{
    struct document_table t;
    document_heading(d, 3, "Uncertainty");
    if (!own->budgeted) {
        document_paragraph(d, TONE_BAD, "Not computed: %s.", own->no_budget);
        return;
    }
    document_paragraph(d, TONE_PLAIN,
                       "Expanded uncertainty U (k = 2) of differences from the expected sample, "
                       "in gamut. As read: screen by the radiometer. As shown: any colour by the "
                       "display model, from the place of the eye.");
    table_begin(&t, "ΔE00 ± U\tmean\tmax");
    overall_row(&t, "as read, as published", &own->measured.published_all);
    overall_row(&t, "as read, absolute", &own->measured.absolute_all);
    overall_row(&t, "as shown, as published", &own->shown.published_all);
    overall_row(&t, "as shown, absolute", &own->shown.absolute_all);
    document_table(d, &t);
    shares(own, d);
}

// ---- patches -------------------------------------------------------------------------

static void steps(const struct report_lamp *own, struct document *d)
{
    struct document_table t;
    if (!own->split)
        return;
    document_heading(d, 3, "Where the error comes from");
    table_begin(&t, "step\tΔE00, rms over the patches");
    for (int k = 0; k < STEPS; k++)
        table_row(&t, TONE_PLAIN, "%s\t%.2f", report_step_name((enum report_step)k), own->steps[k]);
    document_table(d, &t);
    document_paragraph(d, TONE_PLAIN,
                       "Black under the lamp: %.3f cd/m² expected (the display's own and its "
                       "reflection), %.3f read.",
                       own->black_expected, own->black_shown);
}

static void worst(const struct lamp_report *l, const struct report_lamp *own, struct document *d)
{
    char text[512] = "";
    size_t at = 0;
    for (int i = 0; i < own->worst_count && at < sizeof text; i++) {
        const struct patch_report *p = &l->patches[own->worst[i]];
        at += (size_t)snprintf(text + at, sizeof text - at, "%s%s %.2f", at ? ", " : "", p->name,
                               p->de_absolute);
    }
    document_paragraph(d, TONE_PLAIN, "Worst five, absolute: %s.", text);
}

static void colours(const struct lamp_report *l, struct document *d)
{
    struct document_table t;
    document_heading(d, 3, "Patches: XYZ, cd/m²");
    table_begin(&t, "patch\texpected X\tY\tZ\tpredicted X\tY\tZ\tmeasured X\tY\tZ\treference X\tY\t"
                    "Z\treading");
    for (int i = 0; i < l->patch_count; i++) {
        const struct patch_report *p = &l->patches[i];
        table_row(&t, TONE_PLAIN,
                  "%s\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%d",
                  p->name, p->expected.X, p->expected.Y, p->expected.Z, p->predicted.X,
                  p->predicted.Y, p->predicted.Z, p->measured.X, p->measured.Y, p->measured.Z,
                  p->reference.X, p->reference.Y, p->reference.Z, p->reading);
    }
    document_table(d, &t);
}

static void figures_text(const struct budget_difference *b, char *out, size_t size)
{
    snprintf(out, size, "%.2f ± %.2f\t%+.2f ± %.2f\t%+.2f ± %.2f\t%+.2f ± %.2f", b->E.value,
             2 * b->E.u, b->L.value, 2 * b->L.u, b->C.value, 2 * b->C.u, b->H.value, 2 * b->H.u);
}

static void differences(const struct lamp_report *l, const struct report_lamp *own, bool published,
                        struct document *d)
{
    struct document_table t;
    document_heading(d, 3, "Patches: measured against expected, %s, ± U (k = 2)",
                     published ? "as published" : "absolute");
    table_begin(&t, "patch\tΔE00\tΔL\tΔC\tΔH\tΔE00 to the reference\tfloor\tgamut");
    for (int i = 0; i < l->patch_count; i++) {
        const struct patch_report *p = &l->patches[i];
        const struct budget *b = &own->measured;
        char figures[128] = "\t\t\t", floor[16] = "";
        if (own->budgeted)
            figures_text(published ? &b->published[i] : &b->absolute[i], figures, sizeof figures);
        if (own->split && !p->in_gamut)
            snprintf(floor, sizeof floor, "%.2f",
                     published ? own->patches[i].floor_published : own->patches[i].floor_absolute);
        table_row(&t, p->in_gamut ? TONE_PLAIN : TONE_BAD, "%s\t%s\t%.2f\t%s\t%s", p->name, figures,
                  published ? p->de_published : p->de_absolute, floor, p->in_gamut ? "in" : "out");
    }
    document_table(d, &t);
}

static void bars(const struct lamp_report *l, struct document *d)
{
    const char *names[FACTS_PATCHES];
    double values[2 * FACTS_PATCHES];
    char *svg = NULL;
    size_t size;
    FILE *out = open_memstream(&svg, &size);
    if (!out)
        return;
    for (int i = 0; i < l->patch_count; i++) {
        names[i] = l->patches[i].name;
        values[2 * i] = l->patches[i].de_published;
        values[2 * i + 1] = l->patches[i].de_absolute;
    }
    svg_bars(out, "ΔE00 from screen", names, values, l->patch_count, 2,
             (const char *const[]){"#0e7490", "#d97706"},
             (const char *const[]){"as published", "absolute"});
    fclose(out);
    document_chart(d, svg, size);
    free(svg);
}

void report_lamp_words(const struct report *r, int lamp, struct document *d)
{
    const struct lamp_report *l = &r->facts->lamps[lamp];
    const struct report_lamp *own = &r->lamps[lamp];
    opening(l, d);
    summaries(l, own, d);
    worst(l, own, d);
    if (*l->picture)
        document_picture(d, l->picture, "The chart as the screen showed it");
    bars(l, d);
    uncertainty(own, d);
    steps(own, d);
    differences(l, own, true, d);
    differences(l, own, false, d);
    colours(l, d);
}
