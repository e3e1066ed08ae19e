// SPDX-License-Identifier: Apache-2.0
#include "calibration/display_choice.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "calibration/residual_fit.h"

// One fold: what is fitted, and where its patches stand among all.
struct fold {
    struct measurements seen;
    const int *part; // fold of each patch, -1 for those that are never left out
    int number;
};

// ---- folds -----------------------------------------------------------------

// A patch and the random-looking place of its colour.
struct dealt {
    uint64_t place;
    int patch;
};

static uint64_t mixed(struct counts c)
{
    // Whole ten-thousandths, so that what a file rounds stays one colour;
    // SplitMix64's finaliser (Steele, Lea, Flood 2014).
    uint64_t z = 0;
    const double v[3] = {c.r, c.g, c.b};
    for (int i = 0; i < 3; i++) {
        z = (z ^ (uint64_t)(v[i] * 10000 + 0.5)) + UINT64_C(0x9e3779b97f4a7c15);
        z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
        z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
        z ^= z >> 31;
    }
    return z;
}

static int by_place(const void *a, const void *b)
{
    const struct dealt *x = a, *y = b;
    if (x->place != y->place)
        return x->place < y->place ? -1 : 1;
    return x->patch - y->patch;
}

static bool corner(struct counts c)
{
    const double v[3] = {c.r, c.g, c.b};
    for (int i = 0; i < 3; i++)
        if (v[i] > 1e-6 && v[i] < 1 - 1e-6)
            return false;
    return true;
}

// Deals colours into folds in the order of their hashes.
static bool deal(const struct measurements *m, int *part, struct error *err)
{
    struct dealt *dealt = malloc(((size_t)m->count + 1) * sizeof *dealt);
    if (!dealt)
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    for (int i = 0; i < m->count; i++)
        dealt[i] = (struct dealt){mixed(m->patches[i].counts), i};
    qsort(dealt, (size_t)m->count, sizeof *dealt, by_place);
    int colours = 0;
    for (int i = 0; i < m->count; i++) {
        bool never = corner(m->patches[dealt[i].patch].counts);
        if (i > 0 && dealt[i].place != dealt[i - 1].place && !never)
            colours++;
        part[dealt[i].patch] = never ? -1 : colours % DISPLAY_FOLDS;
    }
    free(dealt);
    return true;
}

static bool fold_open(const struct measurements *m, const int *part, int number, struct fold *fold,
                      struct error *err)
{
    *fold = (struct fold){.seen = *m, .part = part, .number = number};
    fold->seen.count = 0;
    fold->seen.patches = malloc(((size_t)m->count + 1) * sizeof *fold->seen.patches);
    if (!fold->seen.patches)
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    for (int i = 0; i < m->count; i++)
        if (part[i] != number)
            fold->seen.patches[fold->seen.count++] = m->patches[i];
    return true;
}

static void ask(const struct fold *fold, const struct measurements *m,
                const struct display_model *model, struct display_cross *cross)
{
    for (int i = 0; i < m->count; i++)
        if (fold->part[i] == fold->number)
            cross->predicted[i][model->kind] = display_forward(model, m->patches[i].counts);
}

void display_give_up(struct display_candidate *candidate, const struct error *why)
{
    candidate->fitted = false;
    snprintf(candidate->failed, sizeof candidate->failed, "%.390s", why->text);
}

// Fits a candidate to a fold and asks it for the rest. RESIDUAL starts from the
// plain model that stands in model.
static void try_one(const struct fold *fold, const struct measurements *m, enum display_kind kind,
                    const struct day_fit starts[2], struct display_model *model,
                    struct display_candidate *candidate, struct display_cross *cross)
{
    struct error why;
    struct residual_fit found;
    struct day_fit at = starts[kind == DISPLAY_INTERACTION];
    bool fitted = kind == DISPLAY_RESIDUAL ? residual_fit(&fold->seen, model, &found, NULL, &why)
                                           : day_fit(&fold->seen, kind, &at, model, &why);
    if (fitted)
        ask(fold, m, model, cross);
    else
        display_give_up(candidate, &why);
}

static void fold_run(const struct fold *fold, const struct measurements *m,
                     const struct day_fit starts[2], struct display_model *model,
                     struct display_choice *choice, struct display_cross *cross)
{
    struct display_candidate *c = choice->candidates;
    if (c[DISPLAY_INTERACTION].fitted)
        try_one(fold, m, DISPLAY_INTERACTION, starts, model, &c[DISPLAY_INTERACTION], cross);
    if (c[DISPLAY_DAY].fitted || c[DISPLAY_RESIDUAL].fitted)
        try_one(fold, m, DISPLAY_DAY, starts, model, &c[DISPLAY_DAY], cross);
    if (model->kind == DISPLAY_DAY && c[DISPLAY_RESIDUAL].fitted)
        try_one(fold, m, DISPLAY_RESIDUAL, starts, model, &c[DISPLAY_RESIDUAL], cross);
}

static bool all_folds(const struct measurements *m, const struct day_fit starts[2], const int *part,
                      struct display_choice *choice, struct display_cross *cross, struct error *err)
{
    struct display_model *model = calloc(1, sizeof *model);
    bool ok = model || fail(err, ERROR_SYSTEM, "out of memory for a display model");
    for (int k = 0; ok && k < DISPLAY_FOLDS; k++) {
        struct fold fold = {0};
        ok = fold_open(m, part, k, &fold, err);
        if (ok)
            fold_run(&fold, m, starts, model, choice, cross);
        free(fold.seen.patches);
    }
    free(model);
    return ok;
}

// ---- judgement -------------------------------------------------------------

// CIEDE2000 of a left-out patch by each candidate.
static bool differences(const struct measurements *m, const struct display_cross *cross, int i,
                        double de00[DISPLAY_KIND_COUNT], struct error *err)
{
    struct lab measured, predicted;
    if (!lab_of(m->patches[i].xyz, m->white, &measured, err))
        return false;
    for (int k = 0; k < DISPLAY_KIND_COUNT; k++) {
        if (!lab_of(cross->predicted[i][k], m->white, &predicted, err))
            return false;
        de00[k] = delta_e_2000(measured, predicted);
    }
    return true;
}

static bool find_means(const struct measurements *m, const struct display_cross *cross,
                       struct display_choice *choice, struct error *err)
{
    double de00[DISPLAY_KIND_COUNT];
    for (int i = 0; i < m->count; i++) {
        if (!cross->scored[i])
            continue;
        if (!differences(m, cross, i, de00, err))
            return false;
        for (int k = 0; k < DISPLAY_KIND_COUNT; k++)
            choice->candidates[k].mean += de00[k] / choice->scored;
    }
    return true;
}

static bool find_best(struct display_choice *choice, struct error *err)
{
    double least = INFINITY;
    for (int k = 0; k < DISPLAY_KIND_COUNT; k++) {
        struct display_candidate *c = &choice->candidates[k];
        if (!c->fitted)
            c->mean = 0;
        if (c->fitted && c->mean < least) {
            least = c->mean;
            choice->best = (enum display_kind)k;
        }
    }
    return least < INFINITY || fail(err, ERROR_DATA, "no display model can be cross-validated");
}

static bool compare(const struct measurements *m, const struct display_cross *cross,
                    struct display_choice *choice, struct error *err)
{
    double squares[DISPLAY_KIND_COUNT] = {0};
    double de00[DISPLAY_KIND_COUNT];
    const int n = choice->scored;
    double least = choice->candidates[choice->best].mean;
    for (int k = 0; k < DISPLAY_KIND_COUNT; k++)
        choice->candidates[k].worse =
            choice->candidates[k].fitted ? choice->candidates[k].mean - least : 0;
    for (int i = 0; i < m->count; i++) {
        if (!cross->scored[i])
            continue;
        if (!differences(m, cross, i, de00, err))
            return false;
        for (int k = 0; k < DISPLAY_KIND_COUNT; k++) {
            double off = de00[k] - de00[choice->best] - choice->candidates[k].worse;
            squares[k] += off * off;
        }
    }
    for (int k = 0; k < DISPLAY_KIND_COUNT; k++)
        choice->candidates[k].worse_se =
            choice->candidates[k].fitted ? sqrt(squares[k] / n / (n - 1)) : 0;
    return true;
}

bool display_worse(const struct display_candidate *c)
{
    return c->worse > DISPLAY_MATTERS && c->worse > DISPLAY_SIGNIFICANT * c->worse_se;
}

static void keep_simplest(struct display_choice *choice)
{
    int k = 0;
    for (; k < (int)choice->best; k++) {
        const struct display_candidate *c = &choice->candidates[k];
        if (c->fitted && !display_worse(c))
            break;
    }
    choice->kind = (enum display_kind)k;
}

void display_cross_fini(struct display_cross *cross)
{
    free(cross->scored);
    free(cross->predicted);
    *cross = (struct display_cross){0};
}

bool display_choose(const struct measurements *m, const struct day_fit starts[2],
                    struct display_choice *choice, struct display_cross *cross, struct error *err)
{
    int *part = malloc(((size_t)m->count + 1) * sizeof *part);
    *cross =
        (struct display_cross){.scored = calloc((size_t)m->count + 1, sizeof *cross->scored),
                               .predicted = calloc((size_t)m->count + 1, sizeof *cross->predicted)};
    bool ok = (part && cross->scored && cross->predicted) ||
              fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    ok = ok && deal(m, part, err) && all_folds(m, starts, part, choice, cross, err);
    choice->scored = 0;
    for (int i = 0; ok && i < m->count; i++) {
        cross->scored[i] = part[i] >= 0;
        choice->scored += cross->scored[i];
    }
    free(part);
    ok = ok && (choice->scored > 1 || fail(err, ERROR_DATA, "no patches to leave out")) &&
         find_means(m, cross, choice, err) && find_best(choice, err) &&
         compare(m, cross, choice, err);
    if (ok)
        keep_simplest(choice);
    else
        display_cross_fini(cross);
    return ok;
}
