// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/display_fit.h"
#include "calibration/patches.h"
#include "calibration/session.h"
#include "config/display_file.h"

enum { VERIFY_MOST = 40 };

// Sizes of the patch sets.
struct sizes {
    int ramp_steps, random, white_every, verify;
};
static const struct sizes WHOLE = {16, 60, 25, VERIFY_MOST}, REHEARSAL = {6, 10, 25, 8};
static const uint64_t SEED = 20040912;

static bool measure_set(struct session *s, struct patch_set *set, const char *step, struct error *err)
{
    for (int i = 0; i < set->count; i++) {
        struct display_patch *p = &set->patches[i];
        char what[96];
        snprintf(what, sizeof what, "%s %.4f %.4f %.4f", step, p->counts.r, p->counts.g, p->counts.b);
        if (!bench_patch(&s->bench, p->counts, err) ||
            !bench_measure(&s->bench, what, &p->xyz, &p->reading, err))
            return false;
        bench_progress(&s->bench, step, i + 1, set->count);
    }
    return true;
}

static bool measure(struct session *s, struct patch_set *fit, struct patch_set *verify,
                    const char *verify_path, struct error *err)
{
    struct display_report *d = &s->facts->display;
    char instrument[128];
    if (!bench_aim_screen(&s->bench, s->settings.screen.width_px / 2.0,
                          s->settings.screen.height_px / 2.0, err) ||
        !measure_set(s, fit, "characterise", err) || !measure_set(s, verify, "verify", err))
        return false;
    bench_instrument(json_array_get(s->bench.readings, json_array_size(s->bench.readings) - 1),
                     instrument, sizeof instrument);
    if (!patch_set_white(fit, &d->white))
        return fail(err, ERROR_DATA, "no white was measured");
    d->patches = fit->count;
    d->verified = verify->count;
    d->white_drift_percent = 100 * patch_set_white_drift(fit);
    return patch_set_save(fit, d->measurements, d->white, instrument, err) &&
           patch_set_save(verify, verify_path, d->white, instrument, err);
}

static bool check(struct display_report *d, const struct display_model *model, const char *path,
                  struct error *err)
{
    struct measurements apart;
    if (!measurements_load(path, &apart, err))
        return false;
    double differences[VERIFY_MOST];
    bool fine = apart.count <= VERIFY_MOST && display_differences(&apart, model, differences, err);
    if (fine)
        d->verification = summarise(differences, apart.count);
    measurements_fini(&apart);
    return fine;
}

static bool fit_model(struct session *s, const char *verify_path, struct error *err)
{
    struct display_report *d = &s->facts->display;
    struct measurements m;
    struct display_model model;
    struct display_fit found;
    if (!measurements_load(d->measurements, &m, err))
        return false;
    bool fine = display_fit(&m, &model, &found, err) && check(d, &model, verify_path, err);
    struct display_origin origin = {.patches = m.count};
    snprintf(origin.instrument, sizeof origin.instrument, "%s", m.instrument);
    snprintf(origin.source, sizeof origin.source, "%s", d->measurements);
    snprintf(origin.software, sizeof origin.software, "boothd %s", BOOTHD_VERSION);
    clock_utc(origin.date);
    measurements_fini(&m);
    if (!fine)
        return false;
    d->fit = found.de00;
    d->condition = model.condition;
    d->black = display_black(&model);
    origin.fit_mean_de00 = found.de00.mean;
    origin.fit_max_de00 = found.de00.max;
    return display_save(d->model, &model, &origin, err);
}

bool session_characterise(struct session *s, struct error *err)
{
    struct display_report *d = &s->facts->display;
    char verify_path[512];
    snprintf(d->measurements, sizeof d->measurements, "%s/display.ti3", s->out);
    snprintf(verify_path, sizeof verify_path, "%s/verify.ti3", s->out);
    snprintf(d->model, sizeof d->model, "%s", s->settings.display.model);
    const struct sizes *z = s->rehearse ? &REHEARSAL : &WHOLE;
    struct patch_set fit = {0}, verify = {0};
    bool fine = bench_lamp(&s->bench, "none", err) && bench_await_lamp(&s->bench, "", 30, err) &&
                patch_set_characterise(z->ramp_steps, z->random, z->white_every, SEED, &fit, err) &&
                patch_set_verify(z->verify, SEED + 1, &verify, err) &&
                measure(s, &fit, &verify, verify_path, err) &&
                fit_model(s, verify_path, err) && bench_reload(&s->bench, err);
    patch_set_fini(&fit);
    patch_set_fini(&verify);
    return fine || while_doing(err, "characterising the display");
}
