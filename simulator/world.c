// SPDX-License-Identifier: Apache-2.0
#include "simulator/world.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "simulator/head.h"
#include "simulator/stand.h"

struct world {
    struct scenario scenario;
    struct lamp lamps[SCENARIO_LAMPS_MOST];
    double collector_lux[SCENARIO_LAMPS_MOST]; // at level 1, warm
    struct panel panel;
    struct rigid camera_from_booth, tracker_from_booth;
    int64_t start_ns;
    world_pixels *pixels;
    void *pixels_context;
    pthread_mutex_t lock; // guards what follows
    struct event *events;
    int count, room;
    double faults_until_s;
};

static bool make_lamps(struct world *w, struct error *err)
{
    struct easel easel = easel_at(&w->scenario.stand, w->scenario.stand.tilt_deg);
    const double *place = w->scenario.spectrometer.place_m;
    struct vec3 collector = {place[0], place[1], place[2]}, up = {0, 1, 0};
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++) {
        const struct scenario_lamp *settings = &w->scenario.lamps[i];
        if (!settings->name[0])
            continue;
        if (!lamp_make(&w->scenario, settings, easel.centre, easel.normal, &w->lamps[i], err))
            return false;
        w->collector_lux[i] = ceiling_illuminance(&w->lamps[i].image, collector, up);
    }
    return true;
}

static bool add_start(struct world *w, struct error *err)
{
    const struct scenario *s = &w->scenario;
    struct event event;
    const char *lamp = s->world.lamp;
    for (int i = 0; !*lamp; i++)
        lamp = s->lamps[i].name;
    return event_lamp(s, lamp, s->world.level, false, &event, err) && world_add(w, &event, err);
}

static struct rigid tracker_pose(const struct scenario_opentrack *o)
{
    struct scenario_camera camera = {{o->place_m[0], o->place_m[1], o->place_m[2]},
                                     o->pitch_deg,
                                     o->yaw_deg, 0};
    return camera_pose(&camera);
}

struct world *world_create(const struct scenario *scenario, int64_t start_ns, struct error *err)
{
    if (!scenario_check(scenario, err))
        return NULL;
    struct world *w = calloc(1, sizeof *w);
    if (!w) {
        fail(err, ERROR_SYSTEM, "out of memory for the world");
        return NULL;
    }
    pthread_mutex_init(&w->lock, NULL);
    w->scenario = *scenario;
    w->start_ns = start_ns;
    w->faults_until_s = -1;
    w->camera_from_booth = camera_pose(&scenario->camera);
    w->tracker_from_booth = tracker_pose(&scenario->opentrack);
    panel_init(&w->panel, &scenario->panel, scenario->world.seed);
    if (!make_lamps(w, err) || !add_start(w, err)) {
        world_destroy(w);
        return NULL;
    }
    return w;
}

void world_destroy(struct world *world)
{
    if (!world)
        return;
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++)
        lamp_fini(&world->lamps[i]);
    pthread_mutex_destroy(&world->lock);
    free(world->events);
    free(world);
}

void world_set_pixels(struct world *world, world_pixels *pixels, void *context)
{
    world->pixels = pixels;
    world->pixels_context = context;
}

double world_seconds(const struct world *world, int64_t at_ns)
{
    return (double)(at_ns - world->start_ns) / NS_PER_S * world->scenario.world.speed;
}

static bool add_locked(struct world *w, const struct event *event, struct error *err)
{
    if (w->count == w->room) {
        int room = w->room ? 2 * w->room : 64;
        struct event *more = realloc(w->events, room * sizeof *more);
        if (!more)
            return fail(err, ERROR_SYSTEM, "out of memory for events");
        w->events = more;
        w->room = room;
    }
    int at = w->count++;
    for (; at > 0 && w->events[at - 1].at_s > event->at_s; at--)
        w->events[at] = w->events[at - 1];
    w->events[at] = *event;
    return true;
}

bool world_add(struct world *world, const struct event *event, struct error *err)
{
    pthread_mutex_lock(&world->lock);
    bool good = add_locked(world, event, err);
    pthread_mutex_unlock(&world->lock);
    return good;
}

bool world_add_now(struct world *world, int64_t now_ns, struct event event, struct error *err)
{
    event.at_s = fmax(world_seconds(world, now_ns), 0);
    return world_add(world, &event, err);
}

// Faults are told without the lock: replugging senses the world.
void world_faults_due(struct world *world, int64_t now_ns, world_fault *fault, void *context)
{
    double until = world_seconds(world, now_ns);
    pthread_mutex_lock(&world->lock);
    struct event *due = calloc(world->count + 1, sizeof *due);
    int count = 0;
    for (int i = 0; due && i < world->count; i++) {
        const struct event *e = &world->events[i];
        if (e->kind == EVENT_FAULT && e->at_s > world->faults_until_s && e->at_s <= until)
            due[count++] = *e;
    }
    if (due)
        world->faults_until_s = fmax(until, world->faults_until_s);
    pthread_mutex_unlock(&world->lock);
    for (int i = 0; i < count; i++)
        fault(context, due[i].instrument, due[i].fault);
    free(due);
}

// A value on its way from one place to another, gently at both ends.
struct motion {
    struct vec3 from, to;
    double start_s, over_s;
};

static struct vec3 motion_at(const struct motion *m, double at_s)
{
    double share = m->over_s > 0 ? (at_s - m->start_s) / m->over_s : 1;
    share = fmin(fmax(share, 0), 1);
    share *= share * (3 - 2 * share);
    return vec3_add(vec3_scale(m->from, 1 - share), vec3_scale(m->to, share));
}

static void motion_turn(struct motion *m, const struct event *e, struct vec3 to)
{
    *m = (struct motion){motion_at(m, e->at_s), to, e->at_s, e->over_s};
}

static void switch_lamp(struct world_state *s, double *since, int lamp, double level, double at_s)
{
    if (level > 0 && s->level[lamp] <= 0)
        since[lamp] = at_s;
    s->level[lamp] = level;
}

static struct world_state fold(const struct world *w, double at_s)
{
    const struct scenario *sc = &w->scenario;
    const double *eye = sc->head.eye_m;
    struct vec3 e0 = {eye[0], eye[1], eye[2]}, t0 = {sc->stand.tilt_deg, 0, 0};
    struct motion head = {e0, e0, 0, 0}, tilt = {t0, t0, 0, 0};
    double since[SCENARIO_LAMPS_MOST] = {0};
    struct world_state s = {.at_s = at_s};
    s.aim.x = (sc->screen.width_px - 1) / 2.0;
    s.aim.y = (sc->screen.height_px - 1) / 2.0;
    for (int i = 0; i < w->count && w->events[i].at_s <= at_s; i++) {
        const struct event *e = &w->events[i];
        switch (e->kind) {
        case EVENT_LAMP:
            for (int lamp = 0; lamp < SCENARIO_LAMPS_MOST; lamp++)
                switch_lamp(&s, since, lamp, lamp == e->lamp ? e->level : 0, e->at_s);
            break;
        case EVENT_ADD:
            switch_lamp(&s, since, e->lamp, e->level, e->at_s);
            break;
        case EVENT_TILT:
            motion_turn(&tilt, e, (struct vec3){e->tilt_deg, 0, 0});
            break;
        case EVENT_HEAD:
            motion_turn(&head, e, e->eye_m);
            break;
        case EVENT_AIM:
            s.aim = e->aim;
            break;
        case EVENT_FAULT:
            break;
        }
    }
    for (int lamp = 0; lamp < SCENARIO_LAMPS_MOST; lamp++)
        s.on_s[lamp] = s.level[lamp] > 0 ? at_s - since[lamp] : 0;
    s.tilt_deg = motion_at(&tilt, at_s).x;
    s.eye = motion_at(&head, at_s);
    return s;
}

static struct world_state state_at(struct world *w, double at_s)
{
    pthread_mutex_lock(&w->lock);
    struct world_state s = fold(w, fmax(at_s, 0));
    pthread_mutex_unlock(&w->lock);
    return s;
}

void world_state_at(struct world *world, int64_t at_ns, struct world_state *out)
{
    *out = state_at(world, world_seconds(world, at_ns));
}

static double output_of(const struct world *w, const struct world_state *s, int lamp)
{
    if (!w->scenario.world.cold || s->level[lamp] <= 0) // there need be no such lamp
        return s->level[lamp];
    return s->level[lamp] * lamp_warmth(&w->lamps[lamp], s->on_s[lamp]);
}

double world_output(struct world *world, int64_t at_ns, int lamp)
{
    struct world_state s = state_at(world, world_seconds(world, at_ns));
    return world_lamp(world, lamp) ? output_of(world, &s, lamp) : 0;
}

static void add_light(const struct world *w, int lamp, double k, struct spectrum *out)
{
    for (int i = 0; k != 0 && i < SPECTRUM_COUNT; i++)
        out->v[i] += k * w->lamps[lamp].per_lux.v[i];
}

static double next_event_s(struct world *w, double after_s)
{
    double next = HUGE_VAL;
    pthread_mutex_lock(&w->lock);
    for (int i = 0; i < w->count && next == HUGE_VAL; i++)
        if (w->events[i].at_s > after_s)
            next = w->events[i].at_s;
    pthread_mutex_unlock(&w->lock);
    return next;
}

// Piece by piece between events, since a lamp may switch in between.
static void sense_irradiance(void *context, int64_t from_ns, int64_t to_ns, struct spectrum *out)
{
    struct world *w = context;
    double from = world_seconds(w, from_ns), to = world_seconds(w, to_ns), whole = to - from;
    memset(out, 0, sizeof *out);
    do {
        double end = fmin(next_event_s(w, from), to);
        struct world_state s = state_at(w, (from + end) / 2);
        double share = whole > 0 ? (end - from) / whole : 1;
        for (int lamp = 0; lamp < SCENARIO_LAMPS_MOST; lamp++)
            add_light(w, lamp, share * output_of(w, &s, lamp) * w->collector_lux[lamp], out);
        from = end;
    } while (from < to);
}

static struct vec3 sense_gravity(void *context, int64_t at_ns)
{
    struct world *w = context;
    struct world_state s = state_at(w, world_seconds(w, at_ns));
    struct easel easel = easel_at(&w->scenario.stand, s.tilt_deg);
    return easel_gravity(&easel, w->scenario.inclinometer.turned_deg);
}

static void sense_markers(void *context, int64_t at_ns, struct vec3 out[3])
{
    struct world *w = context;
    struct world_state s = state_at(w, world_seconds(w, at_ns));
    struct easel easel = easel_at(&w->scenario.stand, s.tilt_deg);
    clip_markers(&w->scenario.head, s.eye, easel.centre, out);
    for (int i = 0; i < 3; i++)
        out[i] = rigid_apply(w->camera_from_booth, out[i]);
}

static struct rigid sense_head(void *context, int64_t at_ns)
{
    struct world *w = context;
    struct world_state s = state_at(w, world_seconds(w, at_ns));
    struct easel easel = easel_at(&w->scenario.stand, s.tilt_deg);
    return rigid_mul(w->tracker_from_booth, head_pose(&w->scenario.head, s.eye, easel.centre));
}

static bool sense_fourth_marker(void *context, int64_t at_ns, struct vec3 *out)
{
    struct world *w = context;
    struct world_state s = state_at(w, world_seconds(w, at_ns));
    struct easel easel = easel_at(&w->scenario.stand, s.tilt_deg);
    if (!head_fourth_marker(&w->scenario.head, s.eye, easel.centre, out))
        return false;
    *out = rigid_apply(w->camera_from_booth, *out);
    return true;
}

// Four points at r / sqrt(2) give the mean over a disc of any quadratic.
static double spot_illuminance(const struct world *w, const struct easel *easel, int lamp,
                               double x_px, double y_px)
{
    const struct scenario_screen *screen = &w->scenario.screen;
    double r = w->scenario.radiometer.screen_spot_m / 2 * M_SQRT1_2, sum = 0;
    double dx = r / screen->width_m * screen->width_px,
           dy = r / screen->height_m * screen->height_px;
    const double around[4][2] = {{dx, 0}, {-dx, 0}, {0, dy}, {0, -dy}};
    for (int i = 0; i < 4; i++) {
        struct vec3 p = easel_point(easel, screen, x_px + around[i][0], y_px + around[i][1]);
        sum += ceiling_illuminance(&w->lamps[lamp].image, p, easel->normal);
    }
    return sum / 4;
}

static void screen_irradiance(const struct world *w, const struct world_state *s, double x_px,
                              double y_px, struct spectrum *out)
{
    struct easel easel = easel_at(&w->scenario.stand, s->tilt_deg);
    memset(out, 0, sizeof *out);
    for (int lamp = 0; lamp < SCENARIO_LAMPS_MOST; lamp++) {
        double output = output_of(w, s, lamp);
        if (output > 0)
            add_light(w, lamp, output * spot_illuminance(w, &easel, lamp, x_px, y_px), out);
    }
}

void world_truth(struct world *world, int64_t at_ns, double x_px, double y_px,
                 struct spectrum *irradiance)
{
    struct world_state s = state_at(world, world_seconds(world, at_ns));
    screen_irradiance(world, &s, x_px, y_px, irradiance);
}

static double view_sin2(const struct world *w, const struct world_state *s,
                        const struct easel *easel)
{
    if (!s->aim.from_given)
        return 0;
    struct vec3 p = easel_point(easel, &w->scenario.screen, s->aim.x, s->aim.y);
    double cosine = vec3_dot(vec3_unit(vec3_sub(s->aim.from_m, p)), easel->normal);
    return cosine > 0 ? 1 - cosine * cosine : 1;
}

static void gather_pixels(const struct world *w, const struct world_state *s, double sin2,
                          struct panel_light *light)
{
    const struct scenario_screen *screen = &w->scenario.screen;
    double r = w->scenario.radiometer.screen_spot_m / 2;
    double mx = screen->width_m / screen->width_px, my = screen->height_m / screen->height_px;
    int left = (int)ceil(s->aim.x - r / mx), right = (int)floor(s->aim.x + r / mx);
    int top = (int)ceil(s->aim.y - r / my), bottom = (int)floor(s->aim.y + r / my);
    for (int y = top < 0 ? 0 : top; y <= bottom && y < screen->height_px; y++)
        for (int x = left < 0 ? 0 : left; x <= right && x < screen->width_px; x++) {
            double dx = (x - s->aim.x) * mx, dy = (y - s->aim.y) * my, code[3] = {0};
            if (dx * dx + dy * dy > r * r)
                continue;
            if (w->pixels)
                w->pixels(w->pixels_context, x, y, code);
            struct panel_view view = {2 * (x + 0.5) / screen->width_px - 1,
                                      1 - 2 * (y + 0.5) / screen->height_px, sin2};
            panel_add(&w->panel, code, &view, light);
        }
}

static void look_at_screen(const struct world *w, const struct world_state *s, struct spectrum *out)
{
    struct easel easel = easel_at(&w->scenario.stand, s->tilt_deg);
    struct panel_light light = {0};
    struct spectrum irradiance, reflected;
    gather_pixels(w, s, view_sin2(w, s, &easel), &light);
    panel_emission(&w->panel, &light, w->scenario.panel.on_s + s->at_s, out);
    screen_irradiance(w, s, s->aim.x, s->aim.y, &irradiance);
    panel_reflection(&w->panel, &irradiance, &reflected);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] += reflected.v[i];
}

static void look_at_ceiling(const struct world *w, const struct world_state *s,
                            struct spectrum *out)
{
    memset(out, 0, sizeof *out);
    for (int lamp = 0; lamp < SCENARIO_LAMPS_MOST; lamp++) {
        double output = output_of(w, s, lamp);
        if (output > 0)
            add_light(w, lamp,
                      output * ceiling_spot(&w->lamps[lamp].image, s->aim.x, s->aim.y,
                                            w->scenario.radiometer.ceiling_spot_m),
                      out);
    }
}

static void sense_radiance(void *context, int64_t at_ns, struct spectrum *out)
{
    struct world *w = context;
    struct world_state s = state_at(w, world_seconds(w, at_ns));
    switch (s.aim.target) {
    case AIM_SCREEN:
        look_at_screen(w, &s, out);
        break;
    case AIM_CEILING:
        look_at_ceiling(w, &s, out);
        break;
    }
}

struct around world_around(struct world *world)
{
    return (struct around){.context = world,
                           .irradiance = sense_irradiance,
                           .gravity = sense_gravity,
                           .markers = sense_markers,
                           .radiance = sense_radiance,
                           .fourth_marker = sense_fourth_marker,
                           .head = sense_head};
}

const struct scenario *world_scenario(const struct world *world)
{
    return &world->scenario;
}

const struct panel *world_panel(const struct world *world)
{
    return &world->panel;
}

const struct lamp *world_lamp(const struct world *world, int index)
{
    bool there = index >= 0 && index < SCENARIO_LAMPS_MOST && world->lamps[index].name[0];
    return there ? &world->lamps[index] : NULL;
}
