// SPDX-License-Identifier: Apache-2.0
#include "render/dither.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

static const double SIGMA_PX = 1.5; // Ulichney's choice
enum { FIRST_POINTS = DITHER_LEVELS / 10, MASK = DITHER_SIDE - 1 };

// A pattern of points on a torus and how crowded every place of it is.
struct pattern {
    bool point[DITHER_LEVELS];
    float crowd[DITHER_LEVELS];
};

struct bell {
    float at[DITHER_LEVELS];
};

static void make_bell(struct bell *bell)
{
    for (int i = 0; i < DITHER_LEVELS; i++) {
        int x = i & MASK, y = i / DITHER_SIDE;
        double dx = x < DITHER_SIDE / 2 ? x : DITHER_SIDE - x;
        double dy = y < DITHER_SIDE / 2 ? y : DITHER_SIDE - y;
        bell->at[i] = (float)exp(-(dx * dx + dy * dy) / (2 * SIGMA_PX * SIGMA_PX));
    }
}

static void put(struct pattern *pattern, const struct bell *bell, int place, bool point)
{
    int x0 = place & MASK, y0 = place / DITHER_SIDE;
    float sign = point ? 1 : -1;
    pattern->point[place] = point;
    for (int y = 0; y < DITHER_SIDE; y++) {
        const float *row = bell->at + ((y - y0) & MASK) * DITHER_SIDE;
        for (int x = 0; x < DITHER_SIDE; x++)
            pattern->crowd[y * DITHER_SIDE + x] += sign * row[(x - x0) & MASK];
    }
}

static int tightest_cluster(const struct pattern *pattern)
{
    int found = -1;
    for (int i = 0; i < DITHER_LEVELS; i++)
        if (pattern->point[i] && (found < 0 || pattern->crowd[i] > pattern->crowd[found]))
            found = i;
    return found;
}

static int largest_void(const struct pattern *pattern)
{
    int found = -1;
    for (int i = 0; i < DITHER_LEVELS; i++)
        if (!pattern->point[i] && (found < 0 || pattern->crowd[i] < pattern->crowd[found]))
            found = i;
    return found;
}

// Scattered points, moved from the tightest cluster to the largest void until
// that is the same place.
static void first_pattern(struct pattern *pattern, const struct bell *bell)
{
    uint32_t random = 1;
    memset(pattern, 0, sizeof *pattern);
    for (int placed = 0; placed < FIRST_POINTS;) {
        random = random * 1664525u + 1013904223u;
        int place = (int)(random >> 20);
        if (pattern->point[place])
            continue;
        put(pattern, bell, place, true);
        placed++;
    }
    for (int moves = 0; moves < DITHER_LEVELS; moves++) {
        int from = tightest_cluster(pattern);
        put(pattern, bell, from, false);
        int to = largest_void(pattern);
        put(pattern, bell, to, true);
        if (from == to)
            break;
    }
}

// A threshold's rank is the order in which its pixel goes out as the value
// falls, so the earliest points take the highest thresholds.
void dither_tile(uint16_t rank[DITHER_LEVELS])
{
    struct bell bell;
    struct pattern first, pattern;
    make_bell(&bell);
    first_pattern(&first, &bell);
    pattern = first;
    for (int order = FIRST_POINTS - 1; order >= 0; order--) {
        int place = tightest_cluster(&pattern);
        put(&pattern, &bell, place, false);
        rank[place] = (uint16_t)(DITHER_LEVELS - 1 - order);
    }
    pattern = first;
    for (int order = FIRST_POINTS; order < DITHER_LEVELS; order++) {
        int place = largest_void(&pattern);
        put(&pattern, &bell, place, true);
        rank[place] = (uint16_t)(DITHER_LEVELS - 1 - order);
    }
}
