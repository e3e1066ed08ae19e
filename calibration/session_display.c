// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "calibration/budget.h"
#include "calibration/display_fit.h"
#include "calibration/measuring.h"
#include "calibration/session.h"
#include "config/display_file.h"

enum { VERIFY_MOST = 40 };

static bool save(struct measuring *m, struct session *s, const char *verify_path, struct error *err)
{
    struct display_report *d = &s->facts->display;
    const json_t *readings = s->bench.readings;
    d->white = m->white;
    d->patches = m->fit.count;
    d->verified = m->verify.count;
    d->white_drift_percent = 100 * m->drift.white;
    d->warm_up_s = m->warm_up_s;
    d->warm_up_percent_h = 100 * m->warm_up_slope;
    d->settle_s = m->settle.seconds;
    return patch_set_save(&m->fit, d->measurements, m->white, m->instrument, readings, err) &&
           patch_set_save(&m->verify, verify_path, m->white, m->instrument, readings, err);
}

static bool measure(struct session *s, const char *verify_path, struct error *err)
{
    struct measuring_plan plan = s->rehearse ? MEASURING_REHEARSAL : MEASURING_WHOLE;
    struct measuring m = {0};
    char journal[512];
    snprintf(journal, sizeof journal, "%s/display.journal", s->out);
    if (s->bench.booth) // the emulated panel has been on for hours, and answers at once
        plan.warm_up_s = plan.settle_s = 0;
    unlink(journal); // a session is one whole: nothing of an older one is taken over
    bool fine = bench_aim_screen(&s->bench, s->settings.screen.width_px / 2.0,
                                 s->settings.screen.height_px / 2.0, err) &&
                measuring_run(&s->bench, &plan, s->settings.booth.name, journal, &m, err) &&
                save(&m, s, verify_path, err);
    measuring_fini(&m);
    return fine;
}

static struct vec3 residual_of(const struct measurements *m, const struct display_model *model)
{
    struct xyz predicted[VERIFY_MOST], measured[VERIFY_MOST];
    for (int i = 0; i < m->count; i++) {
        predicted[i] = display_forward(model, m->patches[i].counts);
        measured[i] = m->patches[i].xyz;
    }
    return budget_residual(predicted, measured, m->count, m->white);
}

static bool check(struct display_report *d, const struct display_model *model, const char *path,
                  struct error *err)
{
    struct measurements apart;
    if (!measurements_load(path, &apart, err))
        return false;
    double differences[VERIFY_MOST];
    bool fine = apart.count <= VERIFY_MOST && display_differences(&apart, model, differences, err);
    if (fine) {
        d->verification = summarise(differences, apart.count);
        d->residual = residual_of(&apart, model);
    }
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
    bool fine = display_fit(&m, NULL, &model, &found, err) && check(d, &model, verify_path, err);
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
    origin.uncertainty = found.uncertainty;
    return display_save(d->model, &model, &origin, err);
}

bool session_characterise(struct session *s, struct error *err)
{
    struct display_report *d = &s->facts->display;
    char verify_path[512];
    snprintf(d->measurements, sizeof d->measurements, "%s/display.ti3", s->out);
    snprintf(verify_path, sizeof verify_path, "%s/verify.ti3", s->out);
    snprintf(d->model, sizeof d->model, "%s", s->settings.display.model);
    bool fine = bench_lamp(&s->bench, "none", err) && bench_await_lamp(&s->bench, "", 30, err) &&
                measure(s, verify_path, err) && fit_model(s, verify_path, err) &&
                session_store(s, STAGE_CHARACTERISED, err) && bench_reload(&s->bench, err);
    return fine || while_doing(err, "characterising the display");
}
