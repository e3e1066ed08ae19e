// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>

#include "calibration/session.h"
#include "calibration/teach.h"

void session_map(const struct session *s, int lamp, char *path, size_t size)
{
    snprintf(path, size, "%s/ceiling-%s.exr", s->maps, s->facts->lamps[lamp].name);
}

static void report(struct lamp_report *lamp, const struct teaching *t, int readings)
{
    lamp->irradiance = t->taught.irradiance;
    lamp->spread = t->taught.spread;
    lamp->lux = t->taught.lux;
    lamp->teach_readings = readings;
    lamp->chromaticity = xy_of(xyz_absolute(&lamp->irradiance, OBSERVER_1931_2));
    lamp->cct = cct_of(lamp->chromaticity);
    lamp->map_scale = t->map_scale;
    lamp->spots = t->spots.count;
    memcpy(lamp->spot_ratios, t->spots.ratios, sizeof lamp->spot_ratios);
    memcpy(lamp->spot_x_m, t->spots.x_m, sizeof lamp->spot_x_m);
    memcpy(lamp->spot_z_m, t->spots.z_m, sizeof lamp->spot_z_m);
}

bool session_teach(struct session *s, int index, struct error *err)
{
    struct lamp_report *lamp = &s->facts->lamps[index];
    struct teach_plan plan = s->rehearse ? TEACH_REHEARSAL : TEACH_WHOLE;
    struct teaching teaching;
    char map[512];
    session_map(s, index, map, sizeof map);
    if (s->lamp_drift > 0 && !s->rehearse)
        plan.drift = s->lamp_drift;
    if (!teach_lamp(&s->bench, &s->settings, lamp->name, map, &plan, &teaching, err))
        return false;
    report(lamp, &teaching, plan.readings);
    memcpy(lamp->map, map, sizeof lamp->map);
    return true;
}
