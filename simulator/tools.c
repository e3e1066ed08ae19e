// SPDX-License-Identifier: Apache-2.0
#include "simulator/tools.h"

#include "simulator/chance.h"
#include "simulator/stand.h"

// Another reading, another error.
static struct chance slip(const struct world *world, const char *tool, int64_t at_ns)
{
    return chance_start((uint64_t)world_scenario(world)->world.seed, tool, (uint64_t)at_ns);
}

double tools_protractor(struct world *world, int64_t at_ns)
{
    struct world_state s;
    struct chance c = slip(world, "protractor", at_ns);
    world_state_at(world, at_ns, &s);
    return s.tilt_deg + world_scenario(world)->tools.protractor_deg * chance_normal(&c);
}

struct vec3 tools_tape(struct world *world, int64_t at_ns, double x_m, double y_m)
{
    const struct scenario *scenario = world_scenario(world);
    struct world_state s;
    struct chance c = slip(world, "tape", at_ns);
    double off = scenario->tools.tape_m;
    world_state_at(world, at_ns, &s);
    struct easel easel = easel_at(&scenario->stand, s.tilt_deg);
    struct vec3 error = {off * chance_normal(&c), off * chance_normal(&c), off * chance_normal(&c)};
    struct vec3 along = vec3_add(vec3_scale(easel.right, x_m), vec3_scale(easel.up, y_m));
    return vec3_add(vec3_add(easel.centre, along), error);
}
