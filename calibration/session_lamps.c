// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "calibration/ceiling_photo.h"
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

static bool map_of(struct session *s, const char *lamp, const struct ceiling_recipe *recipe,
                   const char *path, struct error *err)
{
    struct ceiling_photo photo = {0};
    struct ceiling_origin origin = {0};
    struct luminance_map map = {0};
    snprintf(origin.lamp, sizeof origin.lamp, "%s", lamp);
    bool fine = ceiling_photo_take(recipe, &photo, err) &&
                ceiling_photo_map(&photo, &recipe->ceiling, &map, err) &&
                spots_scale(&s->bench, lamp, &map, &origin.spots, err) &&
                ceiling_photo_save(path, &photo, &recipe->ceiling, &origin, err);
    luminance_map_fini(&map);
    ceiling_photo_fini(&photo);
    return fine;
}

static bool photograph(struct session *s, const char *lamp, const struct teach_plan *plan,
                       const char *path, struct error *err)
{
    char folder[512], list[544], camera[544];
    struct steadiness steady;
    struct ceiling_recipe recipe = {.list = list, .ceiling = s->settings.ceiling};
    snprintf(folder, sizeof folder, "%s/%s", s->photographs, lamp);
    snprintf(list, sizeof list, "%s/list.csv", folder);
    snprintf(camera, sizeof camera, "%s/camera.ini", folder);
    if (mkdir(folder, 0777) && errno != EEXIST)
        return fail_errno(err, "%s", folder);
    bool fine = teach_await(&s->bench, lamp, plan, &steady, err) &&
                bench_photograph(&s->bench, folder, err) &&
                still_camera_load(camera, &recipe.camera, err) &&
                map_of(s, lamp, &recipe, path, err);
    return fine || while_doing(err, "photographing the ceiling under lamp %s", lamp);
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
    if (*s->photographs && !photograph(s, lamp->name, &plan, map, err))
        return false;
    if (!teach_lamp(&s->bench, &s->settings, lamp->name, map, &plan, &teaching, err))
        return false;
    report(lamp, &teaching, plan.readings);
    memcpy(lamp->map, map, sizeof lamp->map);
    return true;
}
