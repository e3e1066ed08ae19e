// SPDX-License-Identifier: Apache-2.0
#include "render/line_sums.h"

#include <stdlib.h>
#include <string.h>

// A strip's sums about a middle that is d away.
static void add_moved(struct line_sum *to, const struct line_sum *strip, double d)
{
    to->energy += strip->energy;
    to->first += strip->first + d * strip->energy;
    to->second += strip->second + d * (2 * strip->first + d * strip->energy);
}

static void add_pixel(struct line_sum *to, double luminance, double d)
{
    to->energy += luminance;
    to->first += luminance * d;
    to->second += luminance * (d * d);
}

// The pixels `from`..`to` - 1 of a row, d counted from `middle`.
static void add_run(struct line_sum *sum, const double *row, int from, int to, double middle,
                    double step)
{
    struct line_sum run = *sum;
    for (int i = from; i < to; i++)
        add_pixel(&run, row[i], (i + 0.5 - middle) * step);
    *sum = run;
}

static const double *row_of(const struct line_sums *s, int row)
{
    return s->map->luminance + (size_t)row * s->map->width;
}

static double middle_of(int strip)
{
    return (strip + 0.5) * LINE_SUMS_STRIP;
}

bool line_sums_init(struct line_sums *sums, const struct luminance_map *map, struct error *err)
{
    int across = map->width / LINE_SUMS_STRIP, down = map->height / LINE_SUMS_STRIP;
    struct line_sums s = {map, map->ceiling.width_m / map->width,
                          map->ceiling.depth_m / map->height, NULL, NULL};
    s.columns = calloc((size_t)down * map->width + 1, sizeof *s.columns);
    s.rows = calloc((size_t)across * map->height + 1, sizeof *s.rows);
    *sums = s;
    if (!s.columns || !s.rows) {
        line_sums_fini(sums);
        return fail(err, ERROR_SYSTEM, "no memory for the sums of %d x %d pixels", map->width,
                    map->height);
    }
    for (int row = 0; row < map->height; row++) {
        const double *pixels = row_of(&s, row);
        int strip = row / LINE_SUMS_STRIP;
        double z = (row + 0.5 - middle_of(strip)) * s.step_z;
        for (int i = 0; strip < down && i < map->width; i++)
            add_pixel(&s.columns[(size_t)strip * map->width + i], pixels[i], z);
        for (int k = 0; k < across; k++)
            add_run(&s.rows[(size_t)k * map->height + row], pixels, k * LINE_SUMS_STRIP,
                    (k + 1) * LINE_SUMS_STRIP, middle_of(k), s.step_x);
    }
    return true;
}

void line_sums_fini(struct line_sums *sums)
{
    free(sums->columns);
    free(sums->rows);
    *sums = (struct line_sums){0};
}

// The whole strips inside from..to - 1: *first..*end - 1, and where they begin
// and end; without one, all of it lies before them.
static void strips_in(int from, int to, int *first, int *end, int *begins, int *ends)
{
    *first = (from + LINE_SUMS_STRIP - 1) / LINE_SUMS_STRIP;
    *end = to / LINE_SUMS_STRIP;
    if (*end <= *first)
        *end = *first;
    *begins = *end > *first ? *first * LINE_SUMS_STRIP : to;
    *ends = *end > *first ? *end * LINE_SUMS_STRIP : to;
}

static void add_rows(const struct line_sums *s, struct pixels of, int from, int to,
                     struct line_sum *columns)
{
    double middle = (of.top + of.bottom) / 2.0;
    for (int row = from; row < to; row++) {
        const double *pixels = row_of(s, row);
        for (int i = of.left; i < of.right; i++)
            add_pixel(&columns[i - of.left], pixels[i], (row + 0.5 - middle) * s->step_z);
    }
}

static void sum_columns(const struct line_sums *s, struct pixels of, struct line_sum *columns)
{
    int first, end, begins, ends;
    double middle = (of.top + of.bottom) / 2.0;
    strips_in(of.top, of.bottom, &first, &end, &begins, &ends);
    memset(columns, 0, (size_t)(of.right - of.left) * sizeof *columns);
    add_rows(s, of, of.top, begins, columns);
    for (int k = first; k < end; k++) {
        const struct line_sum *strip = s->columns + (size_t)k * s->map->width;
        double d = (middle_of(k) - middle) * s->step_z;
        for (int i = of.left; i < of.right; i++)
            add_moved(&columns[i - of.left], &strip[i], d);
    }
    add_rows(s, of, ends, of.bottom, columns);
}

static void sum_rows(const struct line_sums *s, struct pixels of, struct line_sum *rows)
{
    int first, end, begins, ends;
    double middle = (of.left + of.right) / 2.0;
    strips_in(of.left, of.right, &first, &end, &begins, &ends);
    for (int row = of.top; row < of.bottom; row++) {
        const double *pixels = row_of(s, row);
        struct line_sum sum = {0};
        add_run(&sum, pixels, of.left, begins, middle, s->step_x);
        for (int k = first; k < end; k++)
            add_moved(&sum, &s->rows[(size_t)k * s->map->height + row],
                      (middle_of(k) - middle) * s->step_x);
        add_run(&sum, pixels, ends, of.right, middle, s->step_x);
        rows[row - of.top] = sum;
    }
}

void line_sums_of(const struct line_sums *sums, struct pixels of, struct line_sum *columns,
                  struct line_sum *rows)
{
    sum_columns(sums, of, columns);
    sum_rows(sums, of, rows);
}
