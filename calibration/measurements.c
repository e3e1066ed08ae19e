// SPDX-License-Identifier: Apache-2.0
#include "calibration/measurements.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "files/cgats.h"

static const char *const field_names[6] = {"RGB_R", "RGB_G", "RGB_B", "XYZ_X", "XYZ_Y", "XYZ_Z"};
static const double BELOW_ZERO_MOST = 0.01;  // part of white: an instrument's noise at black
static const double ABOVE_WHITE_MOST = 10;   // panels that dim large white patches stay below
static const double WHITE_ERROR_MOST = 0.10; // beyond, it is no drift but another unit or order
static const double WHITE_LEAST = 1, WHITE_MOST = 100000; // cd/m2

void measurements_fini(struct measurements *m)
{
    free(m->patches);
    *m = (struct measurements){0};
}

static void keep(char *to, size_t size, const struct cgats *file, const char *name)
{
    const char *value = cgats_keyword(file, name);
    snprintf(to, size, "%s", value ? value : "");
}

static bool find_fields(const struct table *t, int column[6], struct error *err)
{
    for (int f = 0; f < 6; f++) {
        column[f] = table_column(t, field_names[f]);
        if (column[f] < 0)
            return fail(err, ERROR_DATA,
                        "%s: field %s is missing; needed are RGB_R RGB_G RGB_B XYZ_X "
                        "XYZ_Y XYZ_Z",
                        t->path, field_names[f]);
    }
    if (t->rows < 1)
        return fail(err, ERROR_DATA, "%s: NUMBER_OF_SETS: no patches", t->path);
    return true;
}

static bool take_row(const struct table *t, size_t row, const int column[6],
                     struct measured_patch *p, struct error *err)
{
    double v[6];
    for (int f = 0; f < 6; f++) {
        v[f] = table_at(t, row, (size_t)column[f]);
        if (!isfinite(v[f]))
            return fail(err, ERROR_DATA, "%s:%d: %s: no finite number", t->path, t->lines[row],
                        field_names[f]);
        if (f < 3 && (v[f] < 0 || v[f] > 100))
            return fail(err, ERROR_DATA, "%s:%d: %s: %g is outside 0..100", t->path, t->lines[row],
                        field_names[f], v[f]);
    }
    *p = (struct measured_patch){
        {v[0] / 100, v[1] / 100, v[2] / 100}, {v[3], v[4], v[5]}, t->lines[row]};
    return true;
}

static bool is_white(struct counts c)
{
    const double full = 1 - 1e-6;
    return c.r > full && c.g > full && c.b > full;
}

// Mean and drift of the white rows, in the file's own units.
static struct xyz mean_white(struct measurements *m)
{
    struct xyz sum = {0, 0, 0};
    double least = INFINITY;
    double most = -INFINITY;
    for (int i = 0; i < m->count; i++) {
        struct xyz c = m->patches[i].xyz;
        if (!is_white(m->patches[i].counts))
            continue;
        m->whites++;
        sum = (struct xyz){sum.X + c.X, sum.Y + c.Y, sum.Z + c.Z};
        least = fmin(least, c.Y);
        most = fmax(most, c.Y);
    }
    if (!m->whites)
        return sum;
    m->white_drift = (most - least) * m->whites / sum.Y;
    return (struct xyz){sum.X / m->whites, sum.Y / m->whites, sum.Z / m->whites};
}

static bool normalised(const struct cgats *file, bool *yes, struct error *err)
{
    const char *value = cgats_keyword(file, "NORMALIZED_TO_Y_100");
    *yes = !value || strcmp(value, "NO");
    if (value && strcmp(value, "NO") && strcmp(value, "YES"))
        return fail(err, ERROR_DATA, "%s:%d: NORMALIZED_TO_Y_100: \"%s\" is neither YES nor NO",
                    file->table.path, cgats_line(file, "NORMALIZED_TO_Y_100"), value);
    return true;
}

static const char LUMINANCE[] = "LUMINANCE_XYZ_CDM2";

// Where white comes from: the keyword, else its first row.
static int white_line(const struct cgats *file, const struct measurements *m)
{
    if (cgats_keyword(file, LUMINANCE))
        return cgats_line(file, LUMINANCE);
    for (int i = 0; i < m->count; i++)
        if (is_white(m->patches[i].counts))
            return m->patches[i].line;
    return 0;
}

static bool take_white(const struct cgats *file, struct measurements *m, struct xyz shown,
                       struct error *err)
{
    double v[3];
    bool known = cgats_keyword(file, LUMINANCE);
    if (known && !cgats_numbers(file, LUMINANCE, v, 3, err))
        return false;
    if (!known && !m->whites)
        return fail(err, ERROR_DATA,
                    "%s: no white: neither LUMINANCE_XYZ_CDM2 nor a patch of 100 100 100", m->path);
    m->white = known ? (struct xyz){v[0], v[1], v[2]} : shown;
    if (!(m->white.X > 0 && m->white.Y > 0 && m->white.Z > 0))
        return fail(err, ERROR_DATA, "%s:%d: white: %g %g %g is not above zero", m->path,
                    white_line(file, m), m->white.X, m->white.Y, m->white.Z);
    return true;
}

// White rows and keyword, both in cd/m2, against each other.
static bool compare_whites(const struct cgats *file, struct measurements *m, struct xyz shown,
                           struct error *err)
{
    const double is[] = {shown.X, shown.Y, shown.Z};
    const double said[] = {m->white.X, m->white.Y, m->white.Z};
    for (int i = 0; i < 3 && m->whites; i++)
        m->white_error = fmax(m->white_error, fabs(is[i] / said[i] - 1));
    if (m->white_error <= WHITE_ERROR_MOST)
        return true;
    return fail(err, ERROR_DATA,
                "%s:%d: LUMINANCE_XYZ_CDM2: %g %g %g, but the patch 100 100 100 measured %g %g %g "
                "cd/m2; allowed: up to 10 %% apart (NORMALIZED_TO_Y_100 is %s)",
                m->path, cgats_line(file, LUMINANCE), said[0], said[1], said[2], is[0], is[1],
                is[2], cgats_keyword(file, "NORMALIZED_TO_Y_100") ?: "not given, so YES");
}

static bool near_hundred(const struct cgats *file, struct measurements *m, struct error *err)
{
    m->white_error = fabs(m->white.Y / 100 - 1);
    return m->white_error <= WHITE_ERROR_MOST ||
           fail(err, ERROR_DATA,
                "%s:%d: XYZ_Y: the patch 100 100 100 measured %g; allowed: 90..110 where "
                "NORMALIZED_TO_Y_100 is not NO",
                m->path, white_line(file, m), m->white.Y);
}

// The factor from the file's units to cd/m2, and the white in cd/m2.
static bool find_scale(const struct cgats *file, struct measurements *m, double *scale,
                       struct error *err)
{
    struct xyz shown = mean_white(m);
    bool relative;
    if (!normalised(file, &relative, err) || !take_white(file, m, shown, err))
        return false;
    bool known = cgats_keyword(file, LUMINANCE);
    m->absolute = !relative || known;
    if (!m->absolute)
        return near_hundred(file, m, err);
    if (!(m->white.Y >= WHITE_LEAST && m->white.Y <= WHITE_MOST))
        return fail(err, ERROR_DATA, "%s:%d: white: %g cd/m2 is outside %g..%g cd/m2", m->path,
                    white_line(file, m), m->white.Y, WHITE_LEAST, WHITE_MOST);
    *scale = relative ? m->white.Y / 100 : 1;
    struct xyz scaled = {shown.X * *scale, shown.Y * *scale, shown.Z * *scale};
    return compare_whites(file, m, scaled, err);
}

static bool rescale(struct measurements *m, double scale, struct error *err)
{
    const double least = -BELOW_ZERO_MOST * m->white.Y, most = ABOVE_WHITE_MOST * m->white.Y;
    for (int i = 0; i < m->count; i++) {
        struct xyz *c = &m->patches[i].xyz;
        *c = (struct xyz){c->X * scale, c->Y * scale, c->Z * scale};
        if (c->X < least || c->Y < least || c->Z < least)
            return fail(err, ERROR_DATA, "%s:%d: XYZ: %g %g %g cd/m2 is below zero", m->path,
                        m->patches[i].line, c->X, c->Y, c->Z);
        if (!(c->X <= most && c->Y <= most && c->Z <= most))
            return fail(err, ERROR_DATA,
                        "%s:%d: XYZ: %g %g %g cd/m2 is more than ten times white (%g cd/m2)",
                        m->path, m->patches[i].line, c->X, c->Y, c->Z, m->white.Y);
    }
    return true;
}

static bool check_units(const struct measurements *m, struct error *err)
{
    double most = 0;
    for (int i = 0; i < m->count; i++) {
        struct counts c = m->patches[i].counts;
        most = fmax(most, fmax(c.r, fmax(c.g, c.b)));
    }
    return !(most > 0 && most <= 0.01) ||
           fail(err, ERROR_DATA,
                "%s:%d: RGB_R RGB_G RGB_B: no value above %g in the whole file; allowed: per cent, "
                "0..100 (is full code 1 here?)",
                m->path, m->patches[0].line, 100 * most);
}

static bool take(const struct cgats *file, struct measurements *m, struct error *err)
{
    int column[6];
    double scale = 1;
    if (!find_fields(&file->table, column, err))
        return false;
    m->patches = calloc(file->table.rows, sizeof *m->patches);
    if (!m->patches)
        return fail(err, ERROR_SYSTEM, "%s: out of memory for %zu patches", m->path,
                    file->table.rows);
    for (size_t row = 0; row < file->table.rows; row++)
        if (!take_row(&file->table, row, column, &m->patches[m->count++], err))
            return false;
    return check_units(m, err) && find_scale(file, m, &scale, err) && rescale(m, scale, err);
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static int base_size(const char *path)
{
    const char *name = base_name(path);
    const char *point = strrchr(name, '.');
    return (int)(point && point != name ? (size_t)(point - name) : strlen(name));
}

bool measurements_load(const char *path, struct measurements *m, struct error *err)
{
    struct cgats file = {0};
    struct measurements taken = {0};
    if (!cgats_load_as(path, "CTI3", &file, err))
        return false;
    snprintf(taken.path, sizeof taken.path, "%s", path);
    keep(taken.instrument, sizeof taken.instrument, &file, "TARGET_INSTRUMENT");
    keep(taken.created, sizeof taken.created, &file, "CREATED");
    keep(taken.display, sizeof taken.display, &file, "DISPLAY");
    if (!*taken.display)
        snprintf(taken.display, sizeof taken.display, "%.*s", base_size(path), base_name(path));
    bool taken_all = take(&file, &taken, err);
    cgats_fini(&file);
    if (taken_all)
        *m = taken;
    else
        measurements_fini(&taken);
    return taken_all;
}
