// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>

#include "base/clock.h"
#include "simulator/chance.h"
#include "tests/whole/day.h"

enum { QUIET_S = 90, REST_LEAST_S = 75, REST_MEAN_S = 350 };
static const double MEANWHILE = 0.3; // of the longer faults, in which the light changes as well
static const double LONG_S = 1;

const char *day_fault_name(int fault)
{
    static const char *const wire[] = {
#define X(name, text, wires) text,
        WIRE_FAULTS(X)
#undef X
    };
    static const char *const here[] = {
#define X(name, text) text,
        DAY_FAULTS(X)
#undef X
    };
    return fault > DAY_FAULTS_BEGIN ? here[fault - DAY_FAULTS_BEGIN - 1] : wire[fault];
}

struct drawing {
    struct happening *plan;
    int count, room;
    struct chance chance;
    struct world *world;
    int64_t start_ns;
};

static double between(struct chance *c, double least, double most)
{
    return least + (most - least) * chance_uniform(c);
}

// The short ones as often as the long ones.
static double duration(struct chance *c, const struct day_kind *kind)
{
    if (!(kind->most_s > 0))
        return 0;
    return exp(between(c, log(kind->least_s), log(kind->most_s)));
}

static void add(struct drawing *d, double at_s, int fault)
{
    if (d->count == d->room) {
        d->room = d->room ? 2 * d->room : 64;
        d->plan = realloc(d->plan, (size_t)d->room * sizeof *d->plan);
        if (!d->plan)
            abort();
    }
    int64_t at_ns = at_s < INFINITY ? d->start_ns + (int64_t)(at_s * NS_PER_S) : INT64_MAX;
    d->plan[d->count++] = (struct happening){at_ns, fault};
}

static void change_world(struct drawing *d, double at_s, int what)
{
    static const char *const lamps[] = {"A", "D50", "D65", "D50", "D65", "none"};
    struct chance *c = &d->chance;
    struct event event;
    bool fine = false;
    if (what == DAY_LAMP)
        fine = event_lamp(world_scenario(d->world), lamps[(int)between(c, 0, 6)],
                          between(c, 0.3, 1.2), false, &event, NULL);
    else if (what == DAY_TILT)
        fine = event_tilt(between(c, 5, 80), between(c, 0, 3), &event, NULL);
    else if (what == DAY_HEAD)
        fine = event_head(
            (struct vec3){between(c, -0.12, 0.12), between(c, 0.48, 0.58), between(c, 0.60, 0.80)},
            between(c, 0.5, 4), &event, NULL);
    event.at_s = at_s;
    if (!fine || !world_add(d->world, &event, NULL))
        abort();
}

// Returns when it is over.
static double draw(struct drawing *d, double at_s, const struct day_kind *kind, bool sees_light)
{
    double lasts_s = duration(&d->chance, kind);
    if (kind->fault == DAY_LAMP || kind->fault == DAY_TILT || kind->fault == DAY_HEAD)
        change_world(d, at_s, kind->fault);
    else if (sees_light && lasts_s > LONG_S && chance_uniform(&d->chance) < MEANWHILE)
        change_world(d, at_s + lasts_s / 2, DAY_LAMP);
    if (kind->fault == DAY_AWAY_UPSET) {
        add(d, at_s, DAY_AWAY);
        add(d, at_s + between(&d->chance, 0.8, 0.95) * lasts_s, DAY_AWAY_UPSET);
    } else {
        add(d, at_s, kind->fault);
    }
    add(d, at_s + lasts_s, WIRE_FINE);
    return at_s + lasts_s;
}

struct happening *day_plan(const struct day_kind *kinds, int count, const char *lane,
                           struct world *world, int64_t start_ns)
{
    struct drawing d = {
        .chance = chance_start(SEED, lane, 0), .world = world, .start_ns = start_ns};
    double at_s = 0, apart_s = (HOUR_S - 4.0 * QUIET_S) / count;
    bool sees_light = kinds[0].fault == DAY_LAMP;
    for (int i = 0; i < count; i++)
        at_s = draw(&d, fmax(at_s + REST_LEAST_S, QUIET_S + i * apart_s), &kinds[i], sees_light);
    if (at_s > HOUR_S - QUIET_S)
        abort();
    for (at_s = HOUR_S + QUIET_S;;) {
        const struct day_kind *kind = &kinds[(int)between(&d.chance, 0, count)];
        at_s += REST_LEAST_S - REST_MEAN_S * log(1 - chance_uniform(&d.chance));
        if (at_s + kind->most_s > DAY_S - QUIET_S)
            break;
        at_s = draw(&d, at_s, kind, sees_light);
    }
    add(&d, INFINITY, WIRE_FINE);
    return d.plan;
}
