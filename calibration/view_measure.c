// SPDX-License-Identifier: Apache-2.0
#include "calibration/view_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/journal.h"

static const double RADIANS = M_PI / 180;
enum { SPOTS_MOST = 1 + 3 * 36 + VIEW_GRID * VIEW_GRID };

const struct view_plan VIEW_PLAN = {{15, 30, 45}, 6, 0.6, true};

static const struct {
    const char *name;
    struct counts counts;
} PATCHES[VIEW_PATCHES] = {
    {"red", {1, 0, 0}},   {"green", {0, 1, 0}}, {"blue", {0, 0, 1}},
    {"black", {0, 0, 0}}, {"white", {1, 1, 1}},
};

// What was planned, and which of it was read.
struct run {
    struct bench *bench;
    const struct booth_settings *settings;
    const struct view_plan *plan;
    struct journal journal;
    struct rigid booth_from_screen;
    struct view_spot spots[SPOTS_MOST];
    bool read[SPOTS_MOST][VIEW_PATCHES];
    int count, kept;
    char instrument[128];
};

// ---- the plan --------------------------------------------------------------

static void add_spot(struct run *r, double u, double v, double x, double y)
{
    r->spots[r->count++] = (struct view_spot){.u = u, .v = v, .x = x, .y = y};
}

static void plan_spots(struct run *r)
{
    const struct view_plan *p = r->plan;
    add_spot(r, 0, 0, 0.5, 0.5);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < p->azimuths; i++) {
            double turn = 2 * M_PI * i / p->azimuths, sine = sin(p->angles_deg[k] * RADIANS);
            add_spot(r, sine * cos(turn), sine * sin(turn), 0.5, 0.5);
        }
    for (int i = 0; p->places && i < VIEW_GRID * VIEW_GRID; i++)
        add_spot(r, 0, 0, VIEW_PLACES[i % VIEW_GRID], VIEW_PLACES[i / VIEW_GRID]);
}

static json_t *head_of(const struct view_plan *p, const char *booth, const char *model)
{
    return json_pack("{s:s,s:s,s:s,s:{s:[f,f,f],s:i,s:f,s:b}}", "journal", "display view", "booth",
                     booth, "model", model, "plan", "angles_deg", p->angles_deg[0],
                     p->angles_deg[1], p->angles_deg[2], "azimuths", p->azimuths, "distance_m",
                     p->distance_m, "places", p->places);
}

// ---- the journal -----------------------------------------------------------

static bool take_line(struct run *r, const json_t *line, int number, struct error *err)
{
    int spot = -1, patch = -1;
    struct view_spot s = {0};
    struct xyz c = {0};
    json_t *reading = NULL;
    if (json_unpack((json_t *)line, "{s:i,s:i,s:[FF],s:[FF],s:o}", "spot", &spot, "patch", &patch,
                    "uv", &s.u, &s.v, "place", &s.x, &s.y, "reading", &reading) ||
        json_unpack(reading, "{s:[FFF]}", "XYZ", &c.X, &c.Y, &c.Z) || spot < 0 ||
        spot >= SPOTS_MOST || patch < 0 || patch >= VIEW_PATCHES || r->read[spot][patch] ||
        !isfinite(c.X + c.Y + c.Z) || !(hypot(s.u, s.v) < 1))
        return fail(err, ERROR_DATA, "%s:%d: is no reading of a direction or place",
                    r->journal.path, number);
    memcpy(s.xyz, r->spots[spot].xyz, sizeof s.xyz);
    s.xyz[patch] = c;
    r->spots[spot] = s;
    r->read[spot][patch] = true;
    r->count = spot >= r->count ? spot + 1 : r->count;
    r->kept++;
    bench_instrument(reading, r->instrument, sizeof r->instrument);
    return true;
}

static bool take_journal(struct run *r, struct error *err)
{
    size_t i;
    json_t *line;
    json_array_foreach(r->journal.lines, i,
                       line) if (!take_line(r, line, (int)i + 2, err)) return false;
    return true;
}

// ---- reading ---------------------------------------------------------------

static bool aim(struct run *r, const struct view_spot *s, struct error *err)
{
    const struct screen *screen = &r->settings->screen;
    double x_px = s->x * screen->width_px - 0.5, y_px = s->y * screen->height_px - 0.5;
    struct vec3 direction = {s->u, s->v, sqrt(1 - s->u * s->u - s->v * s->v)};
    struct vec3 from =
        vec3_add(screen_point(screen, x_px, y_px), vec3_scale(direction, r->plan->distance_m));
    return bench_aim_screen_from(r->bench, x_px, y_px, rigid_apply(r->booth_from_screen, from),
                                 err);
}

static bool read_one(struct run *r, int spot, int patch, struct error *err)
{
    struct view_spot *s = &r->spots[spot];
    int index = 0;
    char what[96];
    snprintf(what, sizeof what, "view %s from %.3f %.3f at %.3f %.3f", PATCHES[patch].name, s->u,
             s->v, s->x, s->y);
    if (!bench_patch(r->bench, PATCHES[patch].counts, err) ||
        !bench_measure(r->bench, what, &s->xyz[patch], &index, err))
        return false;
    json_t *reading = json_array_get(r->bench->readings, (size_t)index);
    bench_instrument(reading, r->instrument, sizeof r->instrument);
    r->read[spot][patch] = true;
    return journal_add(&r->journal,
                       json_pack("{s:i,s:i,s:[f,f],s:[f,f],s:O}", "spot", spot, "patch", patch,
                                 "uv", s->u, s->v, "place", s->x, s->y, "reading", reading),
                       err);
}

static bool read_spot(struct run *r, int spot, struct error *err)
{
    bool aimed = false;
    for (int p = 0; p < VIEW_PATCHES; p++) {
        if (r->read[spot][p])
            continue;
        if (!aimed && !aim(r, &r->spots[spot], err))
            return false;
        aimed = true;
        if (!read_one(r, spot, p, err))
            return false;
    }
    return true;
}

static bool find_pose(struct run *r, struct error *err)
{
    json_t *status = bench_status(r->bench, err);
    if (!status)
        return false;
    const json_t *tilt = json_object_get(json_object_get(status, "tilt"), "tilt_deg");
    bool known = json_is_number(tilt);
    if (known)
        r->booth_from_screen = stand_pose(&r->settings->stand.stand, json_number_value(tilt));
    json_decref(status);
    return known || fail(err, ERROR_RETRY, "boothd does not know the screen's tilt");
}

static bool read_all(struct run *r, struct error *err)
{
    if (!find_pose(r, err))
        return false;
    for (int i = 0; i < r->count; i++) {
        if (!read_spot(r, i, err))
            return false;
        bench_progress(r->bench, "directions and places", i + 1, r->count);
    }
    return true;
}

// ---- the result ------------------------------------------------------------

static bool all_read(const struct run *r, struct error *err)
{
    for (int i = 0; i < r->count; i++)
        for (int p = 0; p < VIEW_PATCHES; p++)
            if (!r->read[i][p])
                return fail(err, ERROR_DATA, "%s: %s of spot %d was not read", r->journal.path,
                            PATCHES[p].name, i);
    return true;
}

static bool conclude(const struct run *r, struct view_measured *out, struct error *err)
{
    if (!all_read(r, err) || !view_fit(r->spots, r->count, &out->view, &out->fit, err))
        return false;
    struct view_origin *o = &out->origin;
    const char *model = json_string_value(json_object_get(r->journal.head, "model"));
    snprintf(o->instrument, sizeof o->instrument, "%s", r->instrument);
    snprintf(o->software, sizeof o->software, "boothd %s", BOOTHD_VERSION);
    snprintf(o->model, sizeof o->model, "%s", model ? model : "");
    clock_utc(o->date);
    o->directions = out->fit.directions;
    o->places = out->fit.places;
    o->before_de00 = out->fit.before_de00;
    o->after_de00 = out->fit.after_de00;
    out->kept = r->kept;
    return true;
}

bool view_measured(struct bench *b, const struct booth_settings *settings,
                   const struct view_plan *plan, const char *journal, struct view_measured *out,
                   struct error *err)
{
    struct run *r = calloc(1, sizeof *r);
    if (!r)
        return fail(err, ERROR_SYSTEM, "out of memory");
    *r = (struct run){.bench = b, .settings = settings, .plan = plan};
    json_t *head = head_of(plan, settings->booth.name, settings->display.model);
    bool fine = journal_open(&r->journal, journal, head, err);
    if (fine && !json_equal(r->journal.head, head))
        fine =
            fail(err, ERROR_CONFIG,
                 "%s:1: was begun with another booth, model or plan; use another file, or delete "
                 "it",
                 journal);
    plan_spots(r);
    fine = fine && take_journal(r, err) && read_all(r, err) && conclude(r, out, err);
    json_decref(head);
    journal_close(&r->journal);
    free(r);
    return fine;
}

bool view_from_journal(const char *journal, struct view_measured *out, struct error *err)
{
    struct run *r = calloc(1, sizeof *r);
    if (!r)
        return fail(err, ERROR_SYSTEM, "out of memory");
    bool fine =
        journal_read(&r->journal, journal, err) && take_journal(r, err) && conclude(r, out, err);
    journal_close(&r->journal);
    free(r);
    return fine;
}
