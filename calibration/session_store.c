// SPDX-License-Identifier: Apache-2.0
#include <glob.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/session.h"
#include "config/booth_store.h"
#include "config/lamps.h"

bool session_store_begin(struct session *s, struct error *err)
{
    struct booth_settings *b = &s->settings;
    struct store_draft trial;
    s->stored = *b->calibration.store;
    if (!s->stored)
        return true;
    if (!booth_store_place(b, &s->store, err) || !store_begin(&s->store, true, &trial, err))
        return false;
    store_abandon(&trial);
    if (!(b->given & 1u << STORED_LAMPS))
        snprintf(b->lamps.folder, sizeof b->lamps.folder, "%s/" STORE_LAMPS, s->out);
    if (!(b->given & 1u << STORED_VIEW))
        snprintf(b->display.view, sizeof b->display.view, "%s/" STORE_VIEW, s->out);
    if (!(b->given & 1u << STORED_MODEL))
        snprintf(b->display.model, sizeof b->display.model, "%s/" STORE_DISPLAY, s->out);
    return true;
}

// With its map, so that the version stands alone.
static bool put_lamp(struct store_draft *d, const char *folder, const char *name, struct error *err)
{
    struct lamp lamp;
    char path[PATH_MAX], inside[128];
    snprintf(path, sizeof path, "%s/%s.ini", folder, name);
    if (!lamp_load(path, &lamp, err))
        return false;
    snprintf(inside, sizeof inside, STORE_LAMPS "/%s.exr", name);
    if (*lamp.file.map && !store_put(d, lamp.file.map, inside, err))
        return false;
    if (*lamp.file.map)
        snprintf(lamp.file.map, sizeof lamp.file.map, "%s.exr", name);
    snprintf(path, sizeof path, "%s/" STORE_LAMPS, d->folder);
    return lamp_save(path, &lamp, err);
}

static bool put_beside(struct store_draft *d, const char *folder, const char *name,
                       struct error *err)
{
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return store_put(d, path, name, err);
}

static bool put_report(struct store_draft *d, const char *out, struct error *err)
{
    char pattern[PATH_MAX];
    glob_t found = {0};
    bool fine = true;
    snprintf(pattern, sizeof pattern, "%s/report.*", out);
    if (glob(pattern, 0, NULL, &found))
        return fail(err, ERROR_DATA, "%s: there is no report", out);
    for (size_t i = 0; fine && i < found.gl_pathc; i++)
        fine = store_put(d, found.gl_pathv[i], strrchr(found.gl_pathv[i], '/') + 1, err);
    globfree(&found);
    return fine;
}

static bool put_all(struct session *s, enum session_stage stage, struct store_draft *d,
                    struct error *err)
{
    const struct booth_settings *b = &s->settings;
    for (int i = 0; i < s->facts->lamp_count; i++)
        if (!put_lamp(d, b->lamps.folder, s->facts->lamps[i].name, err))
            return false;
    if (stage >= STAGE_CHARACTERISED && (!store_put(d, b->display.model, STORE_DISPLAY, err) ||
                                         !put_beside(d, s->out, STORE_MEASUREMENTS, err) ||
                                         !put_beside(d, s->out, STORE_VERIFICATION, err)))
        return false;
    if (s->facts->view.measured && !store_put(d, b->display.view, STORE_VIEW, err))
        return false;
    return stage < STAGE_REPORTED || put_report(d, s->out, err);
}

static const char *note_of(enum session_stage stage)
{
    switch (stage) {
    case STAGE_TAUGHT:
        return "session: lamps taught";
    case STAGE_CHARACTERISED:
        return "session: display characterised";
    case STAGE_REPORTED:
        return "session: proofed and reported";
    }
    return "";
}

static struct store_manifest facts_of(const struct session *s, enum session_stage stage,
                                      const struct store_draft *d)
{
    struct store_manifest m = {.version = 0};
    clock_utc(m.created);
    snprintf(m.software, sizeof m.software, "boothcal %s", BOOTHD_VERSION);
    snprintf(m.note, sizeof m.note, "%s%s", note_of(stage), s->rehearse ? " (rehearsed)" : "");
    if (stage == STAGE_TAUGHT && d->base.version)
        memcpy(m.valid_until, d->base.valid_until, sizeof m.valid_until);
    else
        booth_valid_until(&s->settings, clock_utc_s(), m.valid_until);
    return m;
}

bool session_store(struct session *s, enum session_stage stage, struct error *err)
{
    struct store_draft d;
    if (!s->stored)
        return true;
    if (!store_begin(&s->store, true, &d, err))
        return false;
    struct store_manifest facts = facts_of(s, stage, &d);
    if (put_all(s, stage, &d, err) && store_commit(&d, &facts, NULL, err))
        return true;
    store_abandon(&d);
    return while_doing(err, "keeping the calibration");
}
