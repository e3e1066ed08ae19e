// SPDX-License-Identifier: Apache-2.0
#include "daemon/requests.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "render/reference.h"

// The last frame's pointers are about to die.
static void forget_frame(struct booth *b)
{
    b->scene = (struct scene){.kind = SCENE_DARK};
}

static json_t *shown_reply(const struct booth *b)
{
    json_t *reply = json_pack("{s:s, s:f}", "scene",
                              b->scene.kind == SCENE_SURFACE ? "surface"
                              : b->scene.kind == SCENE_PATCH ? "patch"
                                                             : "dark",
                              "out_of_gamut", b->out_of_gamut);
    json_t *warnings = json_array();
    char text[256];
    if (b->scene.kind == SCENE_DARK && b->setup->show == SHOW_MATERIAL)
        json_array_append_new(
            warnings, json_string(b->state.lamp.index < 0
                                      ? "no lamp is known now: the screen stays dark"
                                      : "the proof is not possible: the screen stays dark"));
    for (int i = 0; setup_warning(b->setup, i, text, sizeof text); i++)
        json_array_append_new(warnings, json_string(text));
    json_object_set_new(reply, "warnings", warnings);
    return reply;
}

static void show(struct booth *b, struct job *job, int64_t now_ns)
{
    forget_frame(b);
    if (setup_show(b->setup, job->name, job->patch, &job->err)) {
        if (frame(b, now_ns, true, &job->err)) {
            job->reply = shown_reply(b);
            return;
        }
        b->setup->show = SHOW_NOTHING; // what cannot be drawn is not tried again
    }
    frame(b, now_ns, true, NULL);
}

static void patch(struct booth *b, struct job *job, int64_t now_ns)
{
    forget_frame(b);
    setup_patch(b->setup, job->counts);
    if (frame(b, now_ns, true, &job->err))
        job->reply = shown_reply(b);
}

static void capture(struct booth *b, struct job *job)
{
    const char *end = strrchr(job->name, '.');
    job->width = b->setup->settings.screen.width_px;
    job->height = b->setup->settings.screen.height_px;
    if (end && !strcmp(end, ".png"))
        job->picture = renderer_counts(b->renderer, &job->err);
    else if (b->scene.kind == SCENE_SURFACE)
        job->light = renderer_xyz(b->renderer, &job->err);
    else
        fail(&job->err, ERROR_RANGE, "no material is on the screen: there is no XYZ to capture");
}

static void probe(struct booth *b, struct job *job)
{
    const struct screen *screen = &b->setup->settings.screen;
    if (job->x_px >= screen->width_px || job->y_px >= screen->height_px) {
        fail(&job->err, ERROR_RANGE, "pixel %d, %d is outside the screen's %d x %d", job->x_px,
             job->y_px, screen->width_px, screen->height_px);
        return;
    }
    if (b->scene.kind != SCENE_SURFACE) {
        fail(&job->err, ERROR_RANGE, "no material is on the screen: there is nothing to probe");
        return;
    }
    struct pixel p = reference_pixel(&b->scene, job->x_px, job->y_px);
    job->reply = json_pack(
        "{s:f, s:[f,f,f], s:[f,f,f], s:[f,f,f], s:[f,f,f], s:b}", "lux", p.illuminance, "surface",
        p.surface.X, p.surface.Y, p.surface.Z, "emitted", p.emitted.X, p.emitted.Y, p.emitted.Z,
        "rgb", p.inverse.counts.r, p.inverse.counts.g, p.inverse.counts.b, "linear",
        p.inverse.linear.r, p.inverse.linear.g, p.inverse.linear.b, "in_gamut", p.inverse.in_gamut);
    json_object_set_new(job->reply, "sent", json_pack("[f,f,f]", p.sent.X, p.sent.Y, p.sent.Z));
    json_object_set_new(job->reply, "gains",
                        json_pack("[f,f,f,f]", p.gains.c[0], p.gains.c[1], p.gains.c[2],
                                  p.gains.c[3]));
}

// Settings that were given away at the start.
static bool counts_at_start_only(const char *section, const char *key)
{
    static const char *const sections[] = {"screen", "spectrometer", "accelerometer", "radiometer",
                                           "control"};
    static const char *const keys[] = {
        "display.output", "display.monitor", "display.fullscreen", "display.bits",
        "tracker.driver", "tracker.serial",  "tracker.fov_deg",    "tracker.sensitivity",
        "tracker.format", "tracker.marker",  "tracker.fourth_m",   "tracker.eye_from_marker_m"};
    char whole[96];
    snprintf(whole, sizeof whole, "%s.%s", section, key);
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
        if (!strcmp(section, sections[i]))
            return strcmp(whole, "screen.width_m") && strcmp(whole, "screen.height_m") &&
                   strcmp(whole, "accelerometer.turned_deg");
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (!strcmp(whole, keys[i]))
            return true;
    return false;
}

static void keep_given(const struct booth_settings *old, struct booth_settings *next,
                       json_t *changed)
{
    struct booth_tables tables;
    booth_tables_init(&tables, next);
    for (const struct settings_section *s = tables.sections; s->name; s++)
        for (const struct setting *row = s->rows; row->name; row++) {
            char was[1024], is[1024], whole[96];
            settings_get(row, old, was, sizeof was);
            settings_get(row, next, is, sizeof is);
            if (!strcmp(was, is) || !counts_at_start_only(s->name, row->name))
                continue;
            snprintf(whole, sizeof whole, "%s.%s", s->name, row->name);
            json_array_append_new(changed, json_string(whole));
            settings_set(s->rows, next, row->name, was, NULL);
        }
}

// The old setup takes over from the new one again; no generation comes twice.
static void take_back(struct booth *b, struct setup *old, const struct estimator *before,
                      int64_t now_ns)
{
    old->generations = b->setup->generations;
    forget_frame(b);
    setup_free(b->setup);
    b->setup = old;
    b->estimator = *before;
    frame(b, now_ns, true, NULL);
}

bool booth_take(struct booth *b, struct setup *next, int64_t now_ns, json_t **restart,
                struct error *err)
{
    struct setup *old = b->setup;
    struct estimator before = b->estimator;
    struct classifier taught;
    json_t *changed = json_array();
    keep_given(&old->settings, &next->settings, changed);
    forget_frame(b);
    b->setup = next;
    lamps_teach(&next->lamps, &taught);
    estimator_change(&b->estimator, &next->settings, &taught);
    bool fine = frame(b, now_ns, true, err);
    if (fine)
        setup_free(old);
    else
        take_back(b, old, &before, now_ns);
    if (restart && fine)
        *restart = json_incref(changed);
    json_decref(changed);
    return fine;
}

bool booth_reload(struct booth *b, const struct setup_source *source, int64_t now_ns,
                  json_t **restart, struct error *err)
{
    struct setup *next;
    return (setup_reload(source, clock_utc_s(), b->setup, &next, err) &&
            booth_take(b, next, now_ns, restart, err)) ||
           while_doing(err, "reload");
}

static void reload(struct booth *b, const struct setup_source *source, struct job *job,
                   int64_t now_ns)
{
    json_t *restart = NULL;
    if (!booth_reload(b, source, now_ns, &restart, &job->err)) {
        json_decref(restart);
        return;
    }
    job->reply = shown_reply(b);
    json_object_set_new(job->reply, "restart", restart);
    log_line(LOG_LEVEL_NOTICE, "reloaded %s", source->path);
}

void request_do(struct booth *b, const struct setup_source *source, struct job *job, int64_t now_ns)
{
    switch (job->kind) {
    case JOB_SHOW:
        show(b, job, now_ns);
        return;
    case JOB_PATCH:
        patch(b, job, now_ns);
        return;
    case JOB_CAPTURE:
        capture(b, job);
        return;
    case JOB_PROBE:
        probe(b, job);
        return;
    case JOB_RELOAD:
        reload(b, source, job, now_ns);
        return;
    case JOB_QUIT:
        job->reply = json_object();
        return;
    case JOB_MEASURE:
    case JOB_TEACH:
    case JOB_RAW:
        fail(&job->err, ERROR_RANGE, "not the main thread's");
        return;
    }
}
