// SPDX-License-Identifier: Apache-2.0
#include "calibration/patches.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/random.h"
#include "calibration/statistics.h"

static const double FULL = 255;

enum {
    GREYS = 2,      // greys a step of the ramps: errors of a neutral are seen first
    NEAR_BLACK = 16 // codes: below it a ramp's steps are wide
};

static double code(double fraction)
{
    return rint(fmin(fmax(fraction, 0), 1) * FULL) / FULL;
}

void patch_set_fini(struct patch_set *set)
{
    free(set->patches);
    *set = (struct patch_set){0};
}

static void add(struct patch_set *set, double r, double g, double b)
{
    set->patches[set->count++] = (struct display_patch){.counts = {code(r), code(g), code(b)}};
}

static void shuffle(struct display_patch *patches, int count, struct random *state)
{
    for (int i = count - 1; i > 0; i--) {
        int j = (int)(random_bits(state) % (uint64_t)(i + 1));
        struct display_patch swap = patches[i];
        patches[i] = patches[j];
        patches[j] = swap;
    }
}

static void add_ramps(struct patch_set *set, int steps)
{
    for (int i = 1; i <= steps; i++) {
        double v = pow((double)i / steps, 1.4);
        add(set, v, 0, 0);
        add(set, 0, v, 0);
        add(set, 0, 0, v);
    }
    for (int i = 1; i < GREYS * steps; i++) {
        double v = pow((double)i / (GREYS * steps), 1.4);
        add(set, v, v, v);
    }
    add(set, 0, 0, 0);
    add(set, 0, 0, 0);
}

static void add_near_black(struct patch_set *set, int count, struct random *state)
{
    for (int i = 0; i < count; i++) {
        double r = random_uniform(state), g = random_uniform(state), b = random_uniform(state);
        add(set, r * NEAR_BLACK / FULL, g * NEAR_BLACK / FULL, b * NEAR_BLACK / FULL);
    }
}

static void add_random(struct patch_set *set, int count, struct random *state)
{
    for (int i = 0; i < count; i++) {
        double r = random_uniform(state), g = random_uniform(state), b = random_uniform(state);
        double grey = (r + g + b) / 3, pull = i % 3 ? 0.6 : 0; // surfaces are seldom saturated
        add(set, r + pull * (grey - r), g + pull * (grey - g), b + pull * (grey - b));
    }
}

// With white and black in between.
static void interleave(const struct patch_set *plain, int white_every, struct patch_set *out)
{
    for (int i = 0; i < plain->count; i++) {
        if (i % white_every == 0) {
            add(out, 1, 1, 1);
            if (i / white_every % 2)
                add(out, 0, 0, 0);
        }
        out->patches[out->count++] = plain->patches[i];
    }
    add(out, 1, 1, 1);
}

bool patch_set_characterise(const struct patch_sizes *z, uint64_t seed, struct patch_set *out,
                            struct error *err)
{
    if (z->ramp_steps < 1 || z->near_black < 0 || z->random < 0 || z->white_every < 1)
        return fail(err, ERROR_RANGE,
                    "no patch set of %d steps, %d near black, %d random, white every %d",
                    z->ramp_steps, z->near_black, z->random, z->white_every);
    int body = (3 + GREYS) * z->ramp_steps + 1 + z->near_black + z->random;
    struct patch_set plain = {.patches = calloc((size_t)body, sizeof *plain.patches)};
    struct patch_set set = {.patches = calloc((size_t)(3 * body + 2), sizeof *set.patches)};
    if (!plain.patches || !set.patches) {
        patch_set_fini(&plain);
        patch_set_fini(&set);
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", body);
    }
    struct random state = {seed};
    add_ramps(&plain, z->ramp_steps);
    add_random(&plain, z->random, &state);
    add_near_black(&plain, z->near_black, &state);
    shuffle(plain.patches, plain.count, &state);
    interleave(&plain, z->white_every, &set);
    patch_set_fini(&plain);
    *out = set;
    return true;
}

bool patch_set_verify(int random, uint64_t seed, struct patch_set *out, struct error *err)
{
    struct patch_set set = {.patches = calloc((size_t)random, sizeof *set.patches)};
    if (!set.patches)
        return fail(err, ERROR_SYSTEM, "out of memory");
    struct random state = {seed};
    for (int i = 0; i < random; i++) {
        double level = 0.8 * random_uniform(&state), span = i % 2 ? 0.2 : 1;
        double base = i % 2 ? level : 0;
        double r = random_uniform(&state), g = random_uniform(&state), b = random_uniform(&state);
        add(&set, base + span * r, base + span * g, base + span * b);
    }
    *out = set;
    return true;
}

static bool is_grey(const struct display_patch *p, double level)
{
    return p->counts.r == level && p->counts.g == level && p->counts.b == level;
}

bool patch_set_white(const struct patch_set *set, struct xyz *white)
{
    struct xyz sum = {0};
    int n = 0;
    for (int i = 0; i < set->count; i++) {
        if (!is_grey(&set->patches[i], 1))
            continue;
        sum.X += set->patches[i].xyz.X;
        sum.Y += set->patches[i].xyz.Y;
        sum.Z += set->patches[i].xyz.Z;
        n++;
    }
    if (!n)
        return false;
    *white = (struct xyz){sum.X / n, sum.Y / n, sum.Z / n};
    return true;
}

// Hours and luminances of the greys of a level; returns how many.
static int greys_over_time(const struct patch_set *set, double level, double *hours, double *Y)
{
    int n = 0;
    for (int i = 0; i < set->count; i++)
        if (is_grey(&set->patches[i], level)) {
            hours[n] = set->patches[i].elapsed_s / 3600;
            Y[n++] = set->patches[i].xyz.Y;
        }
    return n;
}

static double range_of(const double *values, int n)
{
    double least = INFINITY, most = -INFINITY;
    for (int i = 0; i < n; i++) {
        least = fmin(least, values[i]);
        most = fmax(most, values[i]);
    }
    return n ? most - least : 0;
}

struct patch_drift patch_set_drift(const struct patch_set *set)
{
    struct patch_drift d = {0};
    double *hours = calloc((size_t)(2 * set->count) + 1, sizeof *hours);
    if (!hours)
        return d;
    double *Y = hours + set->count;
    d.blacks = greys_over_time(set, 0, hours, Y);
    d.black_cdm2 = range_of(Y, d.blacks);
    d.whites = greys_over_time(set, 1, hours, Y);
    double mean = summarise(Y, d.whites).mean;
    if (mean > 0) {
        struct line_fit line = line_through(hours, Y, d.whites);
        d.white = range_of(Y, d.whites) / mean;
        d.white_per_hour = line.slope / mean;
        d.white_per_hour_u = line.slope_u / mean;
    }
    free(hours);
    return d;
}
