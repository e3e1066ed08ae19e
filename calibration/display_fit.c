// SPDX-License-Identifier: Apache-2.0
#include "calibration/display_fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "calibration/uncertainty_fit.h"

static const double CONDITION_WARN = 10;
static const double MISFIT_MEAN = 0.6;
static const double MISFIT_P95 = 2;
static const double DRIFT_WARN = 0.03;

// ---- what to say about it --------------------------------------------------

bool display_differences(const struct measurements *m, const struct display_model *model,
                         double *de00, struct error *err)
{
    for (int i = 0; i < m->count; i++) {
        struct lab measured, modelled;
        if (!lab_of(m->patches[i].xyz, m->white, &measured, err) ||
            !lab_of(display_forward(model, m->patches[i].counts), m->white, &modelled, err))
            return while_doing(err, "%s", m->path);
        de00[i] = delta_e_2000(measured, modelled);
    }
    return true;
}

// Mean luminance of the patches of a given colour; false when there is none.
static bool luminance_of(const struct measurements *m, double r, double g, double b, double *Y)
{
    int n = 0;
    *Y = 0;
    for (int i = 0; i < m->count; i++) {
        struct counts c = m->patches[i].counts;
        if (fmax(fmax(fabs(c.r - r), fabs(c.g - g)), fabs(c.b - b)) < 1e-6) {
            *Y += m->patches[i].xyz.Y;
            n++;
        }
    }
    *Y /= n ? n : 1;
    return n;
}

static void look_at_primaries(const struct measurements *m, struct display_fit *found)
{
    double r, g, b, white, black;
    found->primaries = luminance_of(m, 1, 0, 0, &r) && luminance_of(m, 0, 1, 0, &g) &&
                       luminance_of(m, 0, 0, 1, &b) && luminance_of(m, 1, 1, 1, &white) &&
                       luminance_of(m, 0, 0, 0, &black);
    found->additivity = found->primaries ? (r + g + b - 2 * black) / white - 1 : 0;
}

// Of any additive display red is the reddest primary, green the brightest, and
// blue has most of Z.
static bool disordered(const struct display_model *model)
{
    struct xyz p[3];
    struct xy xy[3];
    for (int c = 0; c < 3; c++) {
        p[c] = (struct xyz){model->matrix[0][c], model->matrix[1][c], model->matrix[2][c]};
        xy[c] = xy_of(p[c]);
    }
    return xy[0].x < fmax(xy[1].x, xy[2].x) || p[1].Y < fmax(p[0].Y, p[2].Y) ||
           p[2].Z < fmax(p[0].Z, p[1].Z);
}

static bool summary_of(const struct measurements *m, const struct display_model *model,
                       struct summary *out, struct error *err)
{
    double *de00 = malloc((size_t)m->count * sizeof *de00);
    if (!de00)
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    bool compared = display_differences(m, model, de00, err);
    if (compared)
        *out = summarise(de00, m->count);
    free(de00);
    return compared;
}

static bool judge(const struct measurements *m, const struct display_model *kept,
                  const struct display_model *day, struct display_fit *found, struct error *err)
{
    if (!summary_of(m, kept, &found->de00, err) || !summary_of(m, day, &found->day, err))
        return false;
    look_at_primaries(m, found);
    found->ill_conditioned = kept->condition > CONDITION_WARN;
    found->misfit = found->day.mean > MISFIT_MEAN || found->day.p95 > MISFIT_P95;
    found->disordered = disordered(kept);
    found->drifted = m->white_drift > DRIFT_WARN;
    return true;
}

// ---- candidates ------------------------------------------------------------

// Every kind fitted to all patches.
struct fitted {
    struct day_fit starts[2]; // DAY, INTERACTION
    struct display_model models[DISPLAY_KIND_COUNT];
    // Of L*, a*, b* at the places of display_uncertainty, by the residual's fit.
    double spread[3 * UNCERTAINTY_PLACES * 3 * UNCERTAINTY_PLACES];
    struct counts places[UNCERTAINTY_PLACES];
};

static void try_interaction(const struct measurements *m, struct fitted *f,
                            struct display_candidate *c)
{
    struct error why;
    f->starts[DISPLAY_INTERACTION] = f->starts[DISPLAY_DAY];
    c->tried = true;
    c->fitted = day_fit(m, DISPLAY_INTERACTION, &f->starts[DISPLAY_INTERACTION],
                        &f->models[DISPLAY_INTERACTION], &why);
    if (!c->fitted)
        display_give_up(c, &why);
}

static void try_residual(const struct measurements *m, struct fitted *f, struct display_fit *found,
                         struct display_candidate *c)
{
    struct error why;
    const struct residual_spread spread = {f->places, UNCERTAINTY_PLACES, f->spread};
    f->models[DISPLAY_RESIDUAL] = f->models[DISPLAY_DAY];
    c->tried = true;
    c->fitted = residual_fit(m, &f->models[DISPLAY_RESIDUAL], &found->residual, &spread, &why);
    if (!c->fitted)
        display_give_up(c, &why);
}

// Fits what is wished for (NULL: everything) to all patches.
static bool fit_candidates(const struct measurements *m, const enum display_kind *only,
                           struct fitted *f, struct display_fit *found, struct error *err)
{
    struct display_candidate *c = found->choice.candidates;
    int intervals;
    if (!day_fit_intervals(m, &intervals, err))
        return false;
    f->starts[DISPLAY_DAY] = day_fit_start(intervals);
    if (!day_fit(m, DISPLAY_DAY, &f->starts[DISPLAY_DAY], &f->models[DISPLAY_DAY], err))
        return false;
    if (!only || *only == DISPLAY_DAY)
        c[DISPLAY_DAY].tried = c[DISPLAY_DAY].fitted = true;
    if (!only || *only == DISPLAY_INTERACTION)
        try_interaction(m, f, &c[DISPLAY_INTERACTION]);
    if (!only || *only == DISPLAY_RESIDUAL)
        try_residual(m, f, found, &c[DISPLAY_RESIDUAL]);
    return !only || c[*only].fitted || fail(err, ERROR_DATA, "%s", c[*only].failed);
}

static void keep_simplest(struct display_fit *found, const struct error *why)
{
    int kind = 0;
    while (kind < DISPLAY_RESIDUAL && !found->choice.candidates[kind].tried)
        kind++;
    found->choice.kind = found->choice.best = (enum display_kind)kind;
    found->choice.scored = 0;
    snprintf(found->not_validated, sizeof found->not_validated, "%.190s", why->text);
}

// Covariance of the parameters; without it what left-out patches say stands
// alone.
static void find_modes(const struct measurements *m, struct fitted *f, struct display_fit *found)
{
    const enum display_kind kind = found->choice.kind;
    if (kind == DISPLAY_RESIDUAL || day_fit_covariance(m, kind, &f->starts[kind], f->places,
                                                       UNCERTAINTY_PLACES, f->spread, NULL))
        uncertainty_modes(f->spread, &found->uncertainty, NULL);
}

static bool choose(const struct measurements *m, struct fitted *f, struct display_fit *found,
                   struct error *err)
{
    struct display_cross cross;
    struct error why;
    if (!display_choose(m, f->starts, &found->choice, &cross, &why)) {
        keep_simplest(found, &why);
        find_modes(m, f, found);
        return true;
    }
    find_modes(m, f, found);
    bool ok = uncertainty_rest(m, &cross, &f->models[found->choice.kind], &found->uncertainty, err);
    display_cross_fini(&cross);
    return ok;
}

bool display_fit(const struct measurements *m, const enum display_kind *only,
                 struct display_model *model, struct display_fit *found, struct error *err)
{
    struct display_fit facts = {.patches = m->count};
    struct fitted *f = calloc(1, sizeof *f);
    if (!f)
        return fail(err, ERROR_SYSTEM, "out of memory for display models");
    for (int p = 0; p < UNCERTAINTY_PLACES; p++)
        f->places[p] = uncertainty_place(p);
    bool ok = fit_candidates(m, only, f, &facts, err) && choose(m, f, &facts, err);
    struct display_model *kept = &f->models[facts.choice.kind];
    ok = ok && judge(m, kept, &f->models[DISPLAY_DAY], &facts, err);
    if (ok) {
        const struct day_fit *at = &f->starts[facts.choice.kind == DISPLAY_INTERACTION];
        facts.iterations = at->iterations;
        facts.pooled = at->pooled;
        snprintf(kept->name, sizeof kept->name, "%s", m->display);
        *model = *kept;
        *found = facts;
    }
    free(f);
    return ok;
}
