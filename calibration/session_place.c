// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>

#include "calibration/session.h"

static void take_chart(const struct material *chart, struct session_facts *f)
{
    f->chart_count = 0;
    for (int i = 0; i < chart->palette_count && f->chart_count < FACTS_PATCHES; i++) {
        struct chart_report *c = &f->chart[f->chart_count];
        if (!strcmp(chart->palette_names[i], "background"))
            continue;
        snprintf(c->name, sizeof c->name, "%s", chart->palette_names[i]);
        c->reflectance = chart->palette[i];
        f->chart_count++;
    }
}

bool session_place(struct session *s, const struct material *chart, struct error *err)
{
    const struct booth_settings *b = &s->settings;
    struct session_facts *f = s->facts;
    json_t *status = bench_status(&s->bench, err);
    if (!status)
        return false;
    const json_t *eye = json_object_get(json_object_get(status, "eye"), "eye_m");
    const json_t *tilt = json_object_get(json_object_get(status, "tilt"), "tilt_deg");
    f->place = (struct place_report){.screen = b->screen,
                                     .stand = b->stand.stand,
                                     .tilt_deg = json_number_value(tilt),
                                     .eye = {json_number_value(json_array_get(eye, 0)),
                                             json_number_value(json_array_get(eye, 1)),
                                             json_number_value(json_array_get(eye, 2))},
                                     .width_m = b->ceiling.width_m,
                                     .depth_m = b->ceiling.depth_m,
                                     .reflectance = b->display.reflectance,
                                     .bits = booth_bits(b),
                                     .dither = b->display.dither};
    memcpy(f->place.centre_m, b->ceiling.centre_m, sizeof f->place.centre_m);
    snprintf(f->material, sizeof f->material, "%s", s->material);
    take_chart(chart, f);
    json_decref(status);
    return true;
}
