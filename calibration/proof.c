// SPDX-License-Identifier: Apache-2.0
#include "calibration/proof.h"

#include <math.h>

const struct xyz proof_white = {0.95047, 1, 1.08883};

const struct published_row published_table[3] = {
    {"D65", {0.4, 0.3, 0.8, 1.7}, {0.8, 0.4, 1.4, 1.6}, {0}},
    {"D50", {0.4, 0.3, 0.7, 1.5}, {0.7, 0.4, 1.1, 1.8}, {0}},
    {"A", {0.8, 0.4, 1.3, 2.1}, {3.8, 4.2, 11.0, 14.0}, {1.8, 1.6, 5.0, 5.9}},
};

static struct xyz divided(struct xyz c, double by)
{
    return (struct xyz){c.X / by, c.Y / by, c.Z / by};
}

struct mat3 proof_adaptation(struct xyz white)
{
    return cat_matrix(CAT_02, white, proof_white, 1);
}

bool proof_published_difference(struct xyz a, struct xyz b, struct xyz white, double *de,
                                struct error *err)
{
    struct mat3 adapt = proof_adaptation(white);
    struct lab la, lb;
    if (!lab_of(xyz_apply(adapt, a), proof_white, &la, err) ||
        !lab_of(xyz_apply(adapt, b), proof_white, &lb, err))
        return false;
    *de = delta_e_2000(la, lb);
    return true;
}

static bool judge_patch(struct lamp_report *lamp, struct patch_report *p, struct error *err)
{
    const struct patch_report *w = &lamp->patches[lamp->white_patch];
    struct xyz white = divided(lamp->white_reference, lamp->white_reference.Y);
    struct xyz taught = divided(lamp->white_taught, lamp->white_taught.Y);
    struct lab reference, measured;
    if (!proof_published_difference(divided(p->full, PROOF_WHITE_PATCH * w->full.Y),
                                    divided(p->bands, PROOF_WHITE_PATCH * w->bands.Y), taught,
                                    &p->de_simulation, err) ||
        !proof_published_difference(divided(p->reference, PROOF_WHITE_PATCH * w->reference.Y),
                                    divided(p->measured, PROOF_WHITE_PATCH * w->measured.Y), white,
                                    &p->de_published, err) ||
        !lab_of(p->reference, lamp->white_reference, &reference, err) ||
        !lab_of(p->measured, lamp->white_reference, &measured, err))
        return while_doing(err, "lamp %s, patch %s", lamp->name, p->name);
    p->de_absolute = delta_e_2000(reference, measured);
    return true;
}

bool proof_judge(struct lamp_report *lamp, struct error *err)
{
    const struct patch_report *w = &lamp->patches[lamp->white_patch];
    if (!(w->measured.Y > 0 && w->reference.Y > 0 && w->full.Y > 0 && w->bands.Y > 0 &&
          lamp->white_reference.Y > 0 && lamp->white_taught.Y > 0))
        return fail(err, ERROR_DATA, "lamp %s: a white whose luminance is not positive",
                    lamp->name);
    double all[3][FACTS_PATCHES], inside[2][FACTS_PATCHES];
    int inside_count = 0;
    for (int i = 0; i < lamp->patch_count; i++) {
        struct patch_report *p = &lamp->patches[i];
        if (!judge_patch(lamp, p, err))
            return false;
        all[0][i] = p->de_simulation;
        all[1][i] = p->de_published;
        all[2][i] = p->de_absolute;
        if (p->in_gamut) {
            inside[0][inside_count] = p->de_published;
            inside[1][inside_count++] = p->de_absolute;
        }
    }
    lamp->proof = (struct proof_summary){
        .simulation = summarise(all[0], lamp->patch_count),
        .published = summarise(all[1], lamp->patch_count),
        .absolute = summarise(all[2], lamp->patch_count),
        .published_in_gamut = summarise(inside[0], inside_count),
        .absolute_in_gamut = summarise(inside[1], inside_count),
    };
    lamp->white_error_percent = 100 * (lamp->white_measured.Y / lamp->white_reference.Y - 1);
    lamp->reached = lamp->proof.published_in_gamut.n > 0 &&
                    lamp->proof.published_in_gamut.mean <= PROOF_MEAN_MOST &&
                    lamp->proof.published_in_gamut.max <= PROOF_MAX_MOST &&
                    fabs(lamp->white_error_percent) <= PROOF_WHITE_PERCENT_MOST;
    return true;
}
