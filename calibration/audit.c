// SPDX-License-Identifier: Apache-2.0
#include "calibration/audit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "colorimetry/classifier.h"
#include "colorimetry/illuminant.h"

const struct audit_limits audit_limits[FIGURES] = {
#define X(name, text, unit, least, most) {text, unit, least, most},
    AUDIT_FIGURES(X)
#undef X
};

static const char NO_METAMERS[] = "needs the virtual metamers of ISO 23603, which are not at hand";
static const char NO_UV[] = "there is no ultraviolet reading: spectra here begin at 360 nm";

const struct audit_missing audit_missing[] = {
    {"ISO/CIE 23603 grades", NO_METAMERS},
    {"TM-30 Rf (CIE 224)", "needs its 99 colour evaluation samples, which are not at hand"},
    {"ultraviolet irradiance", NO_UV},
    {NULL, NULL},
};

const char *audit_verdict_name(enum audit_verdict verdict)
{
    static const char *const names[] = {"not computed", "within", "outside"};
    return names[verdict];
}

void audit_fini(struct audit_facts *facts)
{
    free(facts->pairs);
    free(facts->metamerism);
    facts->pairs = NULL;
    facts->metamerism = NULL;
    facts->pair_count = facts->metamerism_count = 0;
}

static struct audit_row judged(enum audit_figure figure, double value)
{
    const struct audit_limits *l = &audit_limits[figure];
    bool within = value >= l->least && value <= l->most;
    return (struct audit_row){within ? FIGURE_WITHIN : FIGURE_OUTSIDE, value, ""};
}

static struct audit_row not_computed(const char *why)
{
    return (struct audit_row){FIGURE_NOT_COMPUTED, 0, why};
}

static double from_d50(struct uv uv_10)
{
    struct spectrum d50;
    illuminant("D50", &d50, NULL);
    struct uv aim = uv_of(xyz_relative(&d50, NULL, OBSERVER_1964_10));
    return hypot(uv_10.u - aim.u, uv_10.v - aim.v);
}

static void judge_figures(struct audit_lamp *l)
{
    static const char RELATIVE[] = "the spectrum is relative";
    static const char ONE_PLACE[] = "not read at nine places";
    for (int i = 0; i < FIGURES; i++) {
        enum audit_figure figure = (enum audit_figure)i;
        struct audit_row *row = &l->figures[i];
        switch (figure) {
        case FIGURE_P1:
        case FIGURE_P2:
            *row = l->absolute ? judged(figure, l->lux) : not_computed(RELATIVE);
            break;
        case FIGURE_UNIFORMITY:
            *row = l->places ? judged(figure, l->uniformity) : not_computed(ONE_PLACE);
            break;
        case FIGURE_CHROMATICITY:
            *row = judged(figure, from_d50(l->uv_10));
            break;
        case FIGURE_RA:
            *row =
                l->rendered ? judged(figure, l->rendering.general) : not_computed(l->no_rendering);
            break;
        case FIGURE_MI_VISIBLE:
            *row = not_computed(NO_METAMERS);
            break;
        case FIGURE_MI_UV:
            *row = not_computed(NO_UV);
            break;
        case FIGURES:
            break;
        }
    }
}

static double uniformity_of(const struct audit_lamp *l)
{
    double least = INFINITY;
    for (int i = 0; i < l->places; i++)
        least = fmin(least, l->place_lux[i]);
    return least / l->place_lux[AUDIT_CENTRE];
}

static bool judge_lamp(struct audit_lamp *l, struct error *err)
{
    struct error why = {0};
    l->xyz = xyz_relative(&l->irradiance, NULL, OBSERVER_1931_2);
    if (!(l->xyz.Y > 0) || (l->places && !(l->place_lux[AUDIT_CENTRE] > 0)))
        return fail(err, ERROR_DATA, "lamp %s: there is no light", l->name);
    l->lux = l->absolute ? xyz_absolute(&l->irradiance, OBSERVER_1931_2).Y : 0;
    l->uniformity = l->places ? uniformity_of(l) : 0;
    l->xy = xy_of(l->xyz);
    l->uv = uv_of(l->xyz);
    l->uv_10 = uv_of(xyz_relative(&l->irradiance, NULL, OBSERVER_1964_10));
    l->cct = cct_of(l->xy);
    l->rendered = rendering_of(&l->irradiance, &l->rendering, &why);
    snprintf(l->no_rendering, sizeof l->no_rendering, "%.150s", l->rendered ? "" : why.text);
    judge_figures(l);
    return true;
}

bool audit_judge(struct audit_facts *facts, struct error *err)
{
    for (int i = 0; i < facts->lamp_count; i++)
        if (!judge_lamp(&facts->lamps[i], err))
            return false;
    return true;
}

static bool pair_under(struct audit_facts *f, const struct spectra *samples, int pair, int matched,
                       int other, struct error *err)
{
    struct audit_metamerism *m = &f->metamerism[f->metamerism_count];
    *m = (struct audit_metamerism){.pair = pair, .matched = matched, .other = other};
    if (!metamerism_of(&samples->spectra[2 * pair], &samples->spectra[2 * pair + 1],
                       &f->lamps[matched].irradiance, &f->lamps[other].irradiance, OBSERVER_1931_2,
                       &m->index, err))
        return while_doing(err, "%s under %s and %s", f->pairs[pair], f->lamps[matched].name,
                           f->lamps[other].name);
    f->metamerism_count++;
    return true;
}

bool audit_metamerism(struct audit_facts *f, const struct spectra *samples, struct error *err)
{
    int lamps = f->lamp_count;
    if (samples->count % 2)
        return fail(err, ERROR_DATA, "%d samples are no pairs: an even number is needed",
                    samples->count);
    f->pair_count = samples->count / 2;
    f->pairs = calloc((size_t)f->pair_count + 1, sizeof *f->pairs);
    f->metamerism = calloc((size_t)(f->pair_count * lamps * lamps) + 1, sizeof *f->metamerism);
    if (!f->pairs || !f->metamerism)
        return fail(err, ERROR_SYSTEM, "out of memory");
    for (int p = 0; p < f->pair_count; p++) {
        snprintf(f->pairs[p], sizeof *f->pairs, "%s / %s", samples->names[2 * p],
                 samples->names[2 * p + 1]);
        for (int a = 0; a < lamps; a++)
            for (int b = 0; b < lamps; b++)
                if (a != b && !pair_under(f, samples, p, a, b, err))
                    return false;
    }
    return true;
}

static struct audit_drift drift_of(int lamp, const struct audit_lamp *now,
                                   const struct audit_lamp *then)
{
    struct audit_drift d = {.lamp = lamp,
                            .level = now->absolute && then->absolute,
                            .uv = hypot(now->uv.u - then->uv.u, now->uv.v - then->uv.v),
                            .cct = now->cct.valid && then->cct.valid,
                            .ra = now->rendered && then->rendered,
                            .shape = lamp_distance(&then->irradiance, &now->irradiance)};
    if (d.level)
        d.lux_percent = 100 * (now->lux / then->lux - 1);
    if (d.cct)
        d.kelvin = now->cct.kelvin - then->cct.kelvin;
    if (d.ra)
        d.ra_by = now->rendering.general - then->rendering.general;
    return d;
}

void audit_compare(struct audit_facts *facts, const struct audit_facts *before)
{
    facts->compared = true;
    memcpy(facts->since, before->made, sizeof facts->since);
    for (int i = 0; i < facts->lamp_count; i++)
        for (int k = 0; k < before->lamp_count; k++)
            if (!strcmp(facts->lamps[i].name, before->lamps[k].name))
                facts->drift[facts->drift_count++] =
                    drift_of(i, &facts->lamps[i], &before->lamps[k]);
}
