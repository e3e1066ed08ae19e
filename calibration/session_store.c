// SPDX-License-Identifier: Apache-2.0
#include <glob.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>

#include "calibration/session.h"
#include "calibration/store_keep.h"
#include "config/booth_store.h"

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
    for (int i = 0; i < s->facts->lamp_count; i++) {
        char path[PATH_MAX];
        snprintf(path, sizeof path, "%s/%s.ini", b->lamps.folder, s->facts->lamps[i].name);
        if (!store_keep_lamp(d, path, err))
            return false;
    }
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

bool session_store(struct session *s, enum session_stage stage, struct error *err)
{
    struct store_draft d;
    if (!s->stored)
        return true;
    if (!store_begin(&s->store, true, &d, err))
        return false;
    char note[128];
    snprintf(note, sizeof note, "%s%s", note_of(stage), s->rehearse ? " (rehearsed)" : "");
    struct store_manifest facts = store_facts(&s->settings, &d, stage > STAGE_TAUGHT, note);
    if (put_all(s, stage, &d, err) && store_commit(&d, &facts, NULL, err))
        return true;
    store_abandon(&d);
    return while_doing(err, "keeping the calibration");
}
