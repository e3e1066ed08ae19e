// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>

#include "render/lights.h"

static const int LIGHTS_MOST = 4096;

// Sums over pixels of L, L x, L z and L (x2 + z2), in metres from the centre
// of the region they belong to.
struct moments {
    double energy, x, z, square;
};

struct region {
    int left, top, right, bottom; // right and bottom lie outside
    struct moments all;
    double priority; // of being split next; < 0 when it cannot be
};

struct cutter {
    const struct luminance_map *map;
    enum median_cut how;
    double step_x, step_z; // m
    struct moments *columns, *rows, *before;
};

struct cut {
    bool across_x;
    int at; // first column or row of the second part
    double cost;
};

static void add(struct moments *to, const struct moments *more)
{
    to->energy += more->energy;
    to->x += more->x;
    to->z += more->z;
    to->square += more->square;
}

// Energy-weighted second moment about the centroid.
static double variance(const struct moments *m)
{
    if (!(m->energy > 0))
        return 0;
    return fmax(0, m->square - (m->x * (m->x / m->energy) + m->z * (m->z / m->energy)));
}

// Moments of each column and row of a region, and of all of it.
static void measure(const struct cutter *cutter, struct region *r)
{
    int width = r->right - r->left;
    for (int i = 0; i < width; i++)
        cutter->columns[i] = (struct moments){0};
    r->all = (struct moments){0};
    for (int row = r->top; row < r->bottom; row++) {
        const double *luminance = cutter->map->luminance + (size_t)row * cutter->map->width;
        double z = (row + 0.5 - (r->top + r->bottom) / 2.0) * cutter->step_z;
        struct moments sum = {0};
        for (int i = 0; i < width; i++) {
            double energy = luminance[r->left + i];
            double x = (i + 0.5 - width / 2.0) * cutter->step_x;
            struct moments one = {energy, energy * x, energy * z, energy * (x * x + z * z)};
            add(&cutter->columns[i], &one);
            add(&sum, &one);
        }
        cutter->rows[row - r->top] = sum;
        add(&r->all, &sum);
    }
}

// Cuts dark edges off, so that wherever a region is cut both parts are lit.
// False for a region without light.
static bool trim(const struct cutter *cutter, struct region *r)
{
    measure(cutter, r);
    if (!(r->all.energy > 0))
        return false;
    int left = 0, top = 0, right = r->right - r->left, bottom = r->bottom - r->top;
    while (!(cutter->columns[left].energy > 0))
        left++;
    while (!(cutter->columns[right - 1].energy > 0))
        right--;
    while (!(cutter->rows[top].energy > 0))
        top++;
    while (!(cutter->rows[bottom - 1].energy > 0))
        bottom--;
    *r = (struct region){.left = r->left + left,
                         .top = r->top + top,
                         .right = r->left + right,
                         .bottom = r->top + bottom};
    measure(cutter, r);
    bool single = right - left == 1 && bottom - top == 1;
    double worth = cutter->how == CUT_ENERGY ? r->all.energy : variance(&r->all);
    r->priority = single ? -1 : worth;
    return true;
}

// Replaces *best by any cut of these lines that costs less. Both parts are
// summed from their own end: a small part beside a great one keeps its digits.
static void best_cut(const struct cutter *cutter, const struct moments *lines, int count,
                     bool across_x, struct cut *best)
{
    struct moments after = {0};
    struct cut found = {across_x, 0, INFINITY};
    cutter->before[0] = lines[0];
    for (int i = 1; i < count; i++) {
        cutter->before[i] = cutter->before[i - 1];
        add(&cutter->before[i], &lines[i]);
    }
    for (int i = count - 1; i > 0; i--) {
        const struct moments *before = &cutter->before[i - 1];
        add(&after, &lines[i]);
        double cost = cutter->how == CUT_ENERGY ? fabs(before->energy - after.energy)
                                                : fmax(variance(before), variance(&after));
        if (cost <= found.cost)
            found = (struct cut){across_x, i, cost};
    }
    if (found.at > 0 && (best->at == 0 || found.cost < best->cost))
        *best = found;
}

static struct cut choose_cut(const struct cutter *cutter, struct region *r)
{
    int width = r->right - r->left, height = r->bottom - r->top;
    bool wide = width * cutter->step_x >= height * cutter->step_z;
    bool both = width > 1 && height > 1 && cutter->how == CUT_VARIANCE;
    struct cut best = {0};
    measure(cutter, r);
    if (both || height == 1 || (width > 1 && wide))
        best_cut(cutter, cutter->columns, width, true, &best);
    if (both || width == 1 || (height > 1 && !wide))
        best_cut(cutter, cutter->rows, height, false, &best);
    return best;
}

static void split(const struct cutter *cutter, struct region *first, struct region *second)
{
    struct cut cut = choose_cut(cutter, first);
    *second = *first;
    if (cut.across_x)
        second->left = first->right = first->left + cut.at;
    else
        second->top = first->bottom = first->top + cut.at;
    trim(cutter, first);
    trim(cutter, second);
}

static int next_to_split(const struct region *regions, int count)
{
    int next = -1;
    for (int i = 0; i < count; i++)
        if (regions[i].priority >= 0 && (next < 0 || regions[i].priority > regions[next].priority))
            next = i;
    return next;
}

static int cut_all(const struct cutter *cutter, struct region *regions, int most)
{
    regions[0] = (struct region){.right = cutter->map->width, .bottom = cutter->map->height};
    if (!trim(cutter, &regions[0]))
        return 0;
    int count = 1;
    while (count < most) {
        int next = next_to_split(regions, count);
        if (next < 0)
            break;
        split(cutter, &regions[next], &regions[count]);
        count++;
    }
    return count;
}

static struct light_point point_of(const struct cutter *cutter, const struct region *r)
{
    const struct ceiling *c = &cutter->map->ceiling;
    double x = r->all.x / r->all.energy, z = r->all.z / r->all.energy;
    double middle_x = ((r->left + r->right) / 2.0) * cutter->step_x - c->width_m / 2;
    double middle_z = ((r->top + r->bottom) / 2.0) * cutter->step_z - c->depth_m / 2;
    return (struct light_point){
        {c->centre_m[0] + middle_x + x, c->centre_m[1], c->centre_m[2] + middle_z + z},
        r->all.energy * cutter->step_x * cutter->step_z,
    };
}

bool median_cut(const struct luminance_map *map, enum median_cut how, int most,
                struct light_points *out, struct error *err)
{
    if (most < 1 || most > LIGHTS_MOST)
        return fail(err, ERROR_RANGE, "lights: %d is outside 1..%d", most, LIGHTS_MOST);
    size_t width = map->width, height = map->height;
    size_t longest = width > height ? width : height;
    struct moments *lines = malloc((width + height + longest) * sizeof *lines);
    struct region *regions = malloc(most * sizeof *regions);
    struct light_point *points = malloc(most * sizeof *points);
    bool good = lines && regions && points;
    if (good) {
        struct cutter cutter = {map,
                                how,
                                map->ceiling.width_m / map->width,
                                map->ceiling.depth_m / map->height,
                                lines,
                                lines + width,
                                lines + width + height};
        int count = cut_all(&cutter, regions, most);
        for (int i = 0; i < count; i++)
            points[i] = point_of(&cutter, &regions[i]);
        *out = (struct light_points){count, points};
    } else {
        fail(err, ERROR_SYSTEM, "no memory for %d lights", most);
        free(points);
    }
    free(lines);
    free(regions);
    return good;
}

void light_points_fini(struct light_points *lights)
{
    free(lights->points);
    *lights = (struct light_points){0};
}
