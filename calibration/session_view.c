// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "calibration/session.h"
#include "calibration/view_measure.h"

static void take_facts(const struct view_measured *m, struct view_report *out)
{
    const struct view_fit *f = &m->fit;
    *out = (struct view_report){.measured = true,
                                .directions = f->directions,
                                .places = f->places,
                                .before_de00 = f->before_de00,
                                .after_de00 = f->after_de00,
                                .before_percent = f->before_percent,
                                .after_percent = f->after_percent,
                                .place_de00 = f->place_de00,
                                .place_percent = f->place_percent};
}

static bool measure(struct session *s, struct view_measured *m, struct error *err)
{
    char journal[512];
    struct view_plan plan = VIEW_PLAN;
    snprintf(journal, sizeof journal, "%s/view.journal", s->out);
    unlink(journal); // a session is one whole: nothing of an older one is taken over
    plan.places = !s->rehearse;
    if (s->rehearse)
        plan.azimuths = 4;
    return view_measured(&s->bench, &s->settings, &plan, journal, m, err) &&
           view_save(s->settings.display.view, &m->view, &m->origin, err);
}

bool session_view(struct session *s, struct error *err)
{
    struct view_measured m;
    if (!*s->settings.display.view)
        return true;
    if (!measure(s, &m, err))
        return while_doing(err, "the display from other directions");
    take_facts(&m, &s->facts->view);
    return session_store(s, STAGE_CHARACTERISED, err) && bench_reload(&s->bench, err);
}

struct vec3 session_eye(const struct session *s)
{
    const double *eye = s->settings.tracker.default_eye_m;
    return (struct vec3){eye[0], eye[1], eye[2]};
}

bool session_aim(struct session *s, struct vec3 eye, struct error *err)
{
    double x = s->settings.screen.width_px / 2.0, y = s->settings.screen.height_px / 2.0;
    return s->facts->view.measured ? bench_aim_screen_from(&s->bench, x, y, eye, err)
                                   : bench_aim_screen(&s->bench, x, y, err);
}
