// SPDX-License-Identifier: Apache-2.0
#include "calibration/store_keep.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "config/booth_store.h"
#include "config/display_file.h"
#include "config/geometry.h"
#include "config/lamps.h"

bool store_settings(const char *config, struct booth_settings *booth, bool *placed,
                    struct error *err)
{
    struct booth_calibration calibration;
    struct booth_settings b;
    if (!booth_load(config, NULL, 0, &b, err))
        return false;
    int rule = b.calibration.expired;
    b.calibration.expired = EXPIRED_WARN;
    unsigned given = b.given;
    booth_from_store(&b, clock_utc_s(), &calibration, NULL);
    *placed = booth_is_placed(&b);
    b.calibration.expired = rule;
    b.given = given;
    *booth = b;
    return true;
}

struct store_manifest store_facts(const struct booth_settings *booth, const struct store_draft *d,
                                  bool renews, const char *note)
{
    struct store_manifest m = {.version = 0};
    clock_utc(m.created);
    snprintf(m.software, sizeof m.software, "boothcal %s", BOOTHD_VERSION);
    snprintf(m.note, sizeof m.note, "%s", note);
    if (d->base.version && !renews)
        memcpy(m.valid_until, d->base.valid_until, sizeof m.valid_until);
    else
        booth_valid_until(booth, clock_utc_s(), m.valid_until);
    return m;
}

bool store_keep_lamp(struct store_draft *d, const char *ini, struct error *err)
{
    struct lamp lamp;
    char path[PATH_MAX];
    if (!lamp_load(ini, &lamp, err))
        return false;
    size_t length = strlen(d->folder);
    bool inside = !strncmp(lamp.file.map, d->folder, length) && lamp.file.map[length] == '/';
    if (*lamp.file.map && !inside) {
        snprintf(path, sizeof path, STORE_LAMPS "/%s.exr", lamp.file.name);
        if (!store_put(d, lamp.file.map, path, err))
            return false;
        snprintf(lamp.file.map, sizeof lamp.file.map, "%s.exr", lamp.file.name);
    }
    snprintf(path, sizeof path, "%s/" STORE_LAMPS, d->folder);
    return lamp_save(path, &lamp, err);
}

bool store_keep_display(struct store_draft *d, const char *path, struct error *err)
{
    struct display_model *model = malloc(sizeof *model);
    bool fine = model
                    ? display_load(path, model, NULL, err) && store_put(d, path, STORE_DISPLAY, err)
                    : fail(err, ERROR_SYSTEM, "out of memory for a display model");
    free(model);
    return fine;
}

bool store_keep_geometry(struct store_draft *d, const char *path, struct error *err)
{
    struct geometry geometry;
    return geometry_load(path, &geometry, err) && store_put(d, path, STORE_GEOMETRY, err);
}

bool store_keep_file(struct store_draft *d, const char *path, struct error *err)
{
    const char *slash = strrchr(path, '/');
    return store_put(d, path, slash ? slash + 1 : path, err);
}
