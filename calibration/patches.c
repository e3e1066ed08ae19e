// SPDX-License-Identifier: Apache-2.0
#include "calibration/patches.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "files/cgats.h"

static const double FULL = 255;

enum { GREYS = 2 }; // greys a step of the ramps: errors of a neutral are seen first

// SplitMix64 (Steele, Lea, Flood 2014).
static uint64_t next_random(uint64_t *state)
{
    uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15));
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

static double uniform(uint64_t *state)
{
    return (double)(next_random(state) >> 11) / 9007199254740992.0;
}

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

static void shuffle(struct display_patch *patches, int count, uint64_t *state)
{
    for (int i = count - 1; i > 0; i--) {
        int j = (int)(next_random(state) % (uint64_t)(i + 1));
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

bool patch_set_characterise(int ramp_steps, int random, int white_every, uint64_t seed,
                            struct patch_set *out, struct error *err)
{
    int body = (3 + GREYS) * ramp_steps + 1 + random;
    struct patch_set plain = {.patches = calloc((size_t)body, sizeof *plain.patches)};
    struct patch_set set = {.patches = calloc((size_t)(2 * body + 2), sizeof *set.patches)};
    if (!plain.patches || !set.patches || white_every < 1) {
        patch_set_fini(&plain);
        patch_set_fini(&set);
        return fail(err, ERROR_RANGE, "no patch set of %d patches", body);
    }
    uint64_t state = seed;
    add_ramps(&plain, ramp_steps);
    for (int i = 0; i < random; i++) {
        double r = uniform(&state), g = uniform(&state), b = uniform(&state);
        double grey = (r + g + b) / 3, pull = i % 3 ? 0.6 : 0; // surfaces are seldom saturated
        add(&plain, r + pull * (grey - r), g + pull * (grey - g), b + pull * (grey - b));
    }
    shuffle(plain.patches, plain.count, &state);
    for (int i = 0; i < plain.count; i++) {
        if (i % white_every == 0)
            add(&set, 1, 1, 1);
        set.patches[set.count++] = plain.patches[i];
    }
    add(&set, 1, 1, 1);
    patch_set_fini(&plain);
    *out = set;
    return true;
}

bool patch_set_verify(int random, uint64_t seed, struct patch_set *out, struct error *err)
{
    struct patch_set set = {.patches = calloc((size_t)random, sizeof *set.patches)};
    if (!set.patches)
        return fail(err, ERROR_SYSTEM, "out of memory");
    uint64_t state = seed;
    for (int i = 0; i < random; i++) {
        double level = 0.8 * uniform(&state), span = i % 2 ? 0.2 : 1;
        double base = i % 2 ? level : 0;
        double r = uniform(&state), g = uniform(&state), b = uniform(&state);
        add(&set, base + span * r, base + span * g, base + span * b);
    }
    *out = set;
    return true;
}

static bool is_white(const struct display_patch *p)
{
    return p->counts.r == 1 && p->counts.g == 1 && p->counts.b == 1;
}

bool patch_set_white(const struct patch_set *set, struct xyz *white)
{
    struct xyz sum = {0};
    int n = 0;
    for (int i = 0; i < set->count; i++) {
        if (!is_white(&set->patches[i]))
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

double patch_set_white_drift(const struct patch_set *set)
{
    double least = INFINITY, most = 0;
    for (int i = 0; i < set->count; i++) {
        if (!is_white(&set->patches[i]))
            continue;
        least = fmin(least, set->patches[i].xyz.Y);
        most = fmax(most, set->patches[i].xyz.Y);
    }
    return least < most ? most / least - 1 : 0;
}

static void fill_row(const struct display_patch *p, double k, double row[6])
{
    const double v[6] = {100 * p->counts.r, 100 * p->counts.g, 100 * p->counts.b,
                         k * p->xyz.X,      k * p->xyz.Y,      k * p->xyz.Z};
    memcpy(row, v, sizeof v);
}

bool patch_set_save(const struct patch_set *set, const char *path, struct xyz white,
                    const char *instrument, struct error *err)
{
    char luminance[96], created[21], by[64];
    snprintf(luminance, sizeof luminance, "%.6f %.6f %.6f", white.X, white.Y, white.Z);
    snprintf(by, sizeof by, "boothd %s", BOOTHD_VERSION);
    clock_utc(created);
    struct cgats_keyword keywords[] = {
        {"DESCRIPTOR", "Display characterisation", 0}, {"ORIGINATOR", by, 0},
        {"CREATED", created, 0},                       {"DEVICE_CLASS", "DISPLAY", 0},
        {"COLOR_REP", "RGB_XYZ", 0},                   {"TARGET_INSTRUMENT", (char *)instrument, 0},
        {"INSTRUMENT_TYPE_SPECTRAL", "YES", 0},        {"LUMINANCE_XYZ_CDM2", luminance, 0},
        {"NORMALIZED_TO_Y_100", "YES", 0},
    };
    char *names[] = {"RGB_R", "RGB_G", "RGB_B", "XYZ_X", "XYZ_Y", "XYZ_Z"};
    struct cgats file = {.identifier = "CTI3",
                         .keyword_count = sizeof keywords / sizeof *keywords,
                         .keywords = keywords,
                         .table = {.columns = 6, .rows = (size_t)set->count, .names = names}};
    file.table.values = malloc((size_t)set->count * 6 * sizeof(double));
    file.table.labels = calloc((size_t)set->count, sizeof(char *));
    char(*ids)[16] = calloc((size_t)set->count, sizeof *ids);
    bool saved = file.table.values && file.table.labels && ids;
    for (int i = 0; saved && i < set->count; i++) {
        fill_row(&set->patches[i], 100 / white.Y, file.table.values + 6 * i);
        snprintf(ids[i], sizeof ids[i], "%d", i + 1);
        file.table.labels[i] = ids[i];
    }
    saved = saved ? cgats_save(path, &file, err) : fail(err, ERROR_SYSTEM, "out of memory");
    free(file.table.values);
    free(file.table.labels);
    free(ids);
    return saved;
}
