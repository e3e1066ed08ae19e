// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>
#include <string.h>

#include "render/lights.h"
#include "render/line_sums.h"

static const double TIE = 1e-12; // costs that differ less, of the whole, are equal but for rounding

// Sums over pixels of L, L x, L z and L (x2 + z2), in metres from the centre
// of the region they belong to.
struct moments {
    double energy, x, z, square;
};

struct cut {
    bool across_x;
    int at; // first column or row of the second part; 0 = none
    double cost;
};

struct region {
    struct pixels at;
    struct moments all; // about the middle of `at`
    bool divisible;
    double rank;    // the greatest is split next
    struct cut cut; // how
};

struct cutter {
    const struct luminance_map *map;
    enum median_cut how;
    struct line_sums sums;
    struct line_sum *columns, *rows; // of the region at hand
    struct moments *before;
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

// Of column or row i of `count`, about the middle of the region.
static struct moments line_moments(const struct cutter *c, bool across_x, int i, int count)
{
    const struct line_sum *line = across_x ? &c->columns[i] : &c->rows[i];
    double d = (i + 0.5 - count / 2.0) * (across_x ? c->sums.step_x : c->sums.step_z);
    double e = line->energy, to = e * d, square = to * d + line->second;
    return across_x ? (struct moments){e, to, line->first, square}
                    : (struct moments){e, line->first, to, square};
}

// Replaces *best by the cheapest of these cuts, if that costs less. Both parts
// are summed from their own end: a small part beside a great one keeps its
// digits.
static void best_cut(const struct cutter *c, bool across_x, int count, double tie, struct cut *best)
{
    struct moments after = {0}, before = {0};
    struct cut found = {across_x, 0, INFINITY};
    for (int i = 0; i < count; i++) {
        struct moments line = line_moments(c, across_x, i, count);
        add(&before, &line);
        c->before[i] = before;
    }
    for (int i = count - 1; i > 0; i--) {
        struct moments line = line_moments(c, across_x, i, count);
        add(&after, &line);
        double cost = c->how == CUT_ENERGY ? fabs(c->before[i - 1].energy - after.energy)
                                           : fmax(variance(&c->before[i - 1]), variance(&after));
        if (found.at == 0 || cost <= found.cost + tie)
            found = (struct cut){across_x, i, cost};
    }
    if (found.at > 0 && (best->at == 0 || found.cost < best->cost - tie))
        *best = found;
}

static struct cut choose_cut(const struct cutter *c, const struct region *r, double worth)
{
    int width = r->at.right - r->at.left, height = r->at.bottom - r->at.top;
    bool wide = width * c->sums.step_x >= height * c->sums.step_z;
    bool both = width > 1 && height > 1 && c->how == CUT_VARIANCE;
    struct cut best = {0};
    if (both || height == 1 || (width > 1 && wide))
        best_cut(c, true, width, TIE * worth, &best);
    if (both || width == 1 || (height > 1 && !wide))
        best_cut(c, false, height, TIE * worth, &best);
    return best;
}

// Whether the region lost dark lines at its edges.
static bool shrink(const struct cutter *c, struct pixels *at)
{
    int left = 0, top = 0, right = at->right - at->left, bottom = at->bottom - at->top;
    while (!(c->columns[left].energy > 0))
        left++;
    while (!(c->columns[right - 1].energy > 0))
        right--;
    while (!(c->rows[top].energy > 0))
        top++;
    while (!(c->rows[bottom - 1].energy > 0))
        bottom--;
    struct pixels lit = {at->left + left, at->top + top, at->left + right, at->top + bottom};
    bool smaller = memcmp(&lit, at, sizeof lit);
    *at = lit;
    return smaller;
}

// To 40 bits.
static double rounded(double v)
{
    int exponent;
    double mantissa = frexp(v, &exponent);
    return ldexp(rint(ldexp(mantissa, 40)), exponent - 40);
}

static void sum_up(const struct cutter *c, struct region *r)
{
    int width = r->at.right - r->at.left;
    r->all = (struct moments){0};
    line_sums_of(&c->sums, r->at, c->columns, c->rows);
    for (int i = 0; i < width; i++) {
        struct moments column = line_moments(c, true, i, width);
        add(&r->all, &column);
    }
}

// Cuts dark edges off, so that wherever a region is cut both parts are lit, and
// says how it would be cut. False for a region without light.
static bool prepare(const struct cutter *c, struct region *r)
{
    sum_up(c, r);
    if (!(r->all.energy > 0))
        return false;
    if (shrink(c, &r->at))
        sum_up(c, r);
    double worth = c->how == CUT_ENERGY ? r->all.energy : variance(&r->all);
    r->divisible = r->at.right - r->at.left > 1 || r->at.bottom - r->at.top > 1;
    r->rank = rounded(worth);
    r->cut = choose_cut(c, r, worth);
    return true;
}

static void split(const struct cutter *c, struct region *first, struct region *second)
{
    struct cut cut = first->cut;
    *second = *first;
    if (cut.across_x)
        second->at.left = first->at.right = first->at.left + cut.at;
    else
        second->at.top = first->at.bottom = first->at.top + cut.at;
    prepare(c, first);
    prepare(c, second);
}

// Of two that are equal but for rounding, the lower index.
static bool sooner(const struct region *regions, int a, int b)
{
    double x = regions[a].rank, y = regions[b].rank;
    return x > y || (x == y && a < b);
}

// A heap of the regions that can be split, the next one on top.
struct queue {
    const struct region *regions;
    int count, *at;
};

static void queue_exchange(struct queue *q, int i, int j)
{
    int kept = q->at[i];
    q->at[i] = q->at[j];
    q->at[j] = kept;
}

static void queue_add(struct queue *q, int region)
{
    int i = q->count++;
    q->at[i] = region;
    for (int up = (i - 1) / 2; i > 0 && sooner(q->regions, q->at[i], q->at[up]); up = (i - 1) / 2) {
        queue_exchange(q, i, up);
        i = up;
    }
}

static int queue_take(struct queue *q)
{
    int first = q->at[0], i = 0;
    q->at[0] = q->at[--q->count];
    for (int down = 1; down < q->count; down = 2 * i + 1) {
        if (down + 1 < q->count && sooner(q->regions, q->at[down + 1], q->at[down]))
            down++;
        if (!sooner(q->regions, q->at[down], q->at[i]))
            break;
        queue_exchange(q, i, down);
        i = down;
    }
    return first;
}

static int cut_all(const struct cutter *c, struct region *regions, int *room, int most)
{
    struct queue queue = {regions, 0, room};
    int count = 1;
    regions[0] = (struct region){.at = {0, 0, c->map->width, c->map->height}};
    if (!prepare(c, &regions[0]))
        return 0;
    if (regions[0].divisible)
        queue_add(&queue, 0);
    for (; count < most && queue.count > 0; count++) {
        int next = queue_take(&queue);
        split(c, &regions[next], &regions[count]);
        if (regions[next].divisible)
            queue_add(&queue, next);
        if (regions[count].divisible)
            queue_add(&queue, count);
    }
    return count;
}

static struct light_point point_of(const struct cutter *cutter, const struct region *r)
{
    const struct ceiling *c = &cutter->map->ceiling;
    double step_x = cutter->sums.step_x, step_z = cutter->sums.step_z;
    double x = r->all.x / r->all.energy, z = r->all.z / r->all.energy;
    double middle_x = (r->at.left + r->at.right) / 2.0 * step_x - c->width_m / 2;
    double middle_z = (r->at.top + r->at.bottom) / 2.0 * step_z - c->depth_m / 2;
    return (struct light_point){
        {c->centre_m[0] + middle_x + x, c->centre_m[1], c->centre_m[2] + middle_z + z},
        r->all.energy * step_x * step_z,
    };
}

static bool take_points(const struct cutter *c, const struct region *regions, int count,
                        struct light_points *out, struct pixels **pixels)
{
    struct light_points made = {count, malloc((size_t)(count + 1) * sizeof *made.points)};
    struct pixels *at = malloc((size_t)(count + 1) * sizeof *at);
    if (!made.points || !at) {
        light_points_fini(&made);
        free(at);
        return false;
    }
    for (int i = 0; i < count; i++) {
        made.points[i] = point_of(c, &regions[i]);
        at[i] = regions[i].at;
    }
    *out = made;
    *pixels = at;
    return true;
}

bool median_cut_regions(const struct luminance_map *map, enum median_cut how, int most,
                        struct light_points *out, struct pixels **pixels, struct error *err)
{
    if (most < 1 || most > MEDIAN_CUT_MOST)
        return fail(err, ERROR_RANGE, "lights: %d is outside 1..%d", most, MEDIAN_CUT_MOST);
    size_t width = (size_t)map->width, height = (size_t)map->height;
    size_t longest = width > height ? width : height;
    if ((size_t)most > width * height)
        most = (int)(width * height);
    struct cutter cutter = {.map = map, .how = how};
    if (!line_sums_init(&cutter.sums, map, err))
        return false;
    struct region *regions = malloc((size_t)most * sizeof *regions);
    int *room = malloc((size_t)most * sizeof *room);
    cutter.columns = malloc((width + height) * sizeof *cutter.columns);
    cutter.rows = cutter.columns + width;
    cutter.before = malloc(longest * sizeof *cutter.before);
    bool good = regions && room && cutter.columns && cutter.before &&
                take_points(&cutter, regions, cut_all(&cutter, regions, room, most), out, pixels);
    line_sums_fini(&cutter.sums);
    free(cutter.columns);
    free(cutter.before);
    free(regions);
    free(room);
    return good || fail(err, ERROR_SYSTEM, "no memory for %d lights", most);
}

bool median_cut(const struct luminance_map *map, enum median_cut how, int most,
                struct light_points *out, struct error *err)
{
    struct pixels *regions = NULL;
    if (!median_cut_regions(map, how, most, out, &regions, err))
        return false;
    free(regions);
    return true;
}

void light_points_fini(struct light_points *lights)
{
    free(lights->points);
    *lights = (struct light_points){0};
}
