// SPDX-License-Identifier: Apache-2.0
#include "daemon/renew.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"

static const int64_t LOOK_EVERY_NS = NS_PER_S / 4;

// What a link may name besides versions: none, and no version at all.
enum { LINK_NONE = 0, LINK_BROKEN = -1, NEVER = -2 };

// One load, on its thread until done.
struct load {
    const struct setup_source *source;
    int64_t utc_s;
    struct setup shown; // show, names, counts and generations of the one in force; no more of it
    char lamp[64];      // it is shown under, "" = none
    struct setup *next; // NULL: refused, err says why
    struct error err;
    atomic_bool done;
};

struct renewal {
    struct booth *booth;
    const struct setup_source *source;
    int64_t look_ns;
    int tried;                // what the link named when it was last loaded or refused
    const struct setup *from; // in force when the load began
    struct load *load;        // NULL: none under way
    pthread_t thread;
};

struct renewal *renewal_begin(struct booth *booth, const struct setup_source *source,
                              struct error *err)
{
    struct renewal *r = calloc(1, sizeof *r);
    if (!r) {
        fail(err, ERROR_SYSTEM, "no memory for calibrations");
        return NULL;
    }
    r->booth = booth;
    r->source = source;
    r->tried = NEVER;
    return r;
}

static void *work(void *argument)
{
    struct load *l = argument;
    if (setup_reload(l->source, l->utc_s, &l->shown, &l->next, &l->err))
        setup_bake_for(l->next, l->lamp, NULL); // what cannot be baked says so when shown
    atomic_store(&l->done, true);
    return NULL;
}

static void copy_shown(struct setup *to, const struct setup *from)
{
    to->generations = from->generations;
    to->show = from->show;
    to->counts = from->counts;
    memcpy(to->material_name, from->material_name, sizeof to->material_name);
    memcpy(to->patch_name, from->patch_name, sizeof to->patch_name);
}

static bool same_shown(const struct setup *a, const struct setup *b)
{
    return a->show == b->show && !memcmp(&a->counts, &b->counts, sizeof a->counts) &&
           !strcmp(a->material_name, b->material_name) && !strcmp(a->patch_name, b->patch_name);
}

static void start_load(struct renewal *r, int64_t utc_s)
{
    const struct setup *setup = r->booth->setup;
    int lamp = r->booth->state.lamp.index;
    struct load *l = calloc(1, sizeof *l);
    if (!l)
        return;
    l->source = r->source;
    l->utc_s = utc_s;
    copy_shown(&l->shown, setup);
    if (lamp >= 0 && lamp < setup->lamps.count)
        memcpy(l->lamp, setup->lamps.lamps[lamp].file.name, sizeof l->lamp);
    r->from = setup;
    r->load = l;
    if (!pthread_create(&r->thread, NULL, work, l))
        return;
    free(l);
    r->load = NULL;
}

// What was asked for while the new one was being loaded.
static bool show_as_now(struct setup *next, const struct setup *shown, const struct setup *now,
                        struct error *err)
{
    if (same_shown(shown, now))
        return true;
    if (now->show == SHOW_MATERIAL)
        return setup_show(next, now->material_name, now->patch_name, err);
    next->show = now->show;
    next->counts = now->counts;
    return true;
}

static bool take(struct renewal *r, struct load *l, int64_t now_ns, struct error *err)
{
    struct setup *next = l->next;
    if (!next)
        return fail(err, l->err.code, "%s", l->err.text);
    setup_renumber(next, r->booth->setup->generations);
    if (show_as_now(next, &l->shown, r->booth->setup, err))
        return booth_take(r->booth, next, now_ns, NULL, err);
    setup_free(next);
    return false;
}

static void refuse(struct renewal *r, const struct error *err)
{
    struct setup *setup = r->booth->setup;
    setup->refused = *err;
    if (setup->calibration.number)
        log_line(LOG_LEVEL_ERROR, "%s; version %04d stays in force", err->text,
                 setup->calibration.number);
    else
        log_line(LOG_LEVEL_ERROR, "%s", err->text);
}

static void finish_load(struct renewal *r, int64_t now_ns)
{
    struct load *l = r->load;
    struct error err = {0};
    pthread_join(r->thread, NULL);
    r->load = NULL;
    if (r->booth->setup != r->from) // somebody reloaded meanwhile
        setup_free(l->next);
    else if (!take(r, l, now_ns, &err))
        refuse(r, &err);
    else
        log_line(LOG_LEVEL_NOTICE, "calibration %04d is in force: %s",
                 r->booth->setup->calibration.number, r->booth->setup->calibration.manifest.note);
    free(l);
}

// What the link names; false when there is none to look at.
static bool link_names(const struct setup *setup, int *named)
{
    struct store_place place;
    if (!*setup->settings.calibration.store || !booth_store_place(&setup->settings, &place, NULL))
        return false;
    if (!store_current(&place, named, NULL))
        *named = LINK_BROKEN;
    return true;
}

static void look(struct renewal *r, int64_t utc_s)
{
    struct setup *setup = r->booth->setup;
    struct error err;
    int named;
    if (!link_names(setup, &named) || named == r->tried)
        return;
    r->tried = named;
    if (named == setup->calibration.named) {
        if (setup->calibration.number) // as after a refused one was taken back
            setup->refused = (struct error){0};
    } else if (named == LINK_NONE) {
        fail(&err, ERROR_DATA, "calibration refused: %s holds none any more",
             setup->settings.calibration.store);
        refuse(r, &err);
    } else {
        start_load(r, utc_s);
    }
}

void renewal_step(struct renewal *r, int64_t now_ns, int64_t utc_s)
{
    if (r->load && atomic_load(&r->load->done))
        finish_load(r, now_ns);
    if (now_ns < r->look_ns)
        return;
    r->look_ns = now_ns + LOOK_EVERY_NS;
    struct setup *setup = r->booth->setup;
    if (setup_age(setup, utc_s) && setup->expired)
        log_line(LOG_LEVEL_ERROR, "calibration %04d has expired: it was valid until %s",
                 setup->calibration.number, setup->calibration.manifest.valid_until);
    if (!r->load)
        look(r, utc_s);
}

void renewal_end(struct renewal *r)
{
    if (!r)
        return;
    if (r->load) {
        pthread_join(r->thread, NULL);
        setup_free(r->load->next);
        free(r->load);
    }
    free(r);
}
