// SPDX-License-Identifier: Apache-2.0
#include "calibration/compare.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "colorimetry/colour.h"
#include "config/display_file.h"
#include "config/geometry.h"

enum { GRID = 9, GREYS = 33, COLOURS = GRID * GRID * GRID + GREYS };
static const double TILT_STEP_DEG = 15, TILT_MOST_DEG = 90;

void difference_fini(struct difference *d)
{
    free(d->files);
    *d = (struct difference){0};
}

// ---- files ------------------------------------------------------------------

static void note_change(struct difference *d, enum file_change_kind kind, const char *path)
{
    struct file_change *f = &d->files[d->file_count++];
    f->kind = kind;
    snprintf(f->path, sizeof f->path, "%s", path);
}

// Both lists are in order.
static bool compare_files(const struct store_version *a, const struct store_version *b,
                          struct difference *d, struct error *err)
{
    int i = 0, k = 0;
    d->files = calloc((size_t)(a->count + b->count + 1), sizeof *d->files);
    if (!d->files)
        return fail(err, ERROR_SYSTEM, "out of memory for the files of two calibrations");
    while (i < a->count || k < b->count) {
        int order = i == a->count   ? 1
                    : k == b->count ? -1
                                    : strcmp(a->files[i].path, b->files[k].path);
        if (order < 0)
            note_change(d, FILE_REMOVED, a->files[i++].path);
        else if (order > 0)
            note_change(d, FILE_ADDED, b->files[k++].path);
        else if (strcmp(a->files[i].path, "manifest.ini") &&
                 strcmp(a->files[i].sum.hex, b->files[k].sum.hex))
            note_change(d, FILE_CHANGED, a->files[i].path), i++, k++;
        else
            i++, k++;
    }
    return true;
}

static bool both_hold(const struct store_version *a, const struct store_version *b,
                      const char *path)
{
    return store_sum(a, path) && store_sum(b, path);
}

// ---- display ----------------------------------------------------------------

static struct counts colour_of(int i)
{
    double grey = (double)(i - GRID * GRID * GRID) / (GREYS - 1), step = 1.0 / (GRID - 1);
    if (i >= GRID * GRID * GRID)
        return (struct counts){grey, grey, grey};
    return (struct counts){i / (GRID * GRID) * step, i / GRID % GRID * step, i % GRID * step};
}

bool compare_displays(const struct display_model *a, const struct display_model *b,
                      struct display_change *out, struct error *err)
{
    double *de00 = malloc(COLOURS * sizeof *de00);
    struct xyz white = display_forward(a, (struct counts){1, 1, 1});
    bool fine = de00 || fail(err, ERROR_SYSTEM, "out of memory for %d colours", COLOURS);
    for (int i = 0; fine && i < COLOURS; i++) {
        struct lab one, other;
        struct counts c = colour_of(i);
        fine = lab_of(display_forward(a, c), white, &one, err) &&
               lab_of(display_forward(b, c), white, &other, err);
        de00[i] = fine ? delta_e_2000(one, other) : 0;
    }
    if (fine)
        *out = (struct display_change){
            .there = true,
            .de00 = summarise(de00, COLOURS),
            .white_percent = 100 * (display_forward(b, (struct counts){1, 1, 1}).Y / white.Y - 1),
            .black_cdm2 = display_black(b).Y - display_black(a).Y};
    free(de00);
    return fine;
}

static bool compare_display_files(const struct store_version *a, const struct store_version *b,
                                  struct display_change *out, struct error *err)
{
    char paths[2][PATH_MAX];
    struct display_model *models = calloc(2, sizeof *models);
    snprintf(paths[0], sizeof paths[0], "%s/" STORE_DISPLAY, a->folder);
    snprintf(paths[1], sizeof paths[1], "%s/" STORE_DISPLAY, b->folder);
    bool fine = models || fail(err, ERROR_SYSTEM, "out of memory for two display models");
    fine = fine && display_load(paths[0], &models[0], NULL, err) &&
           display_load(paths[1], &models[1], NULL, err) &&
           compare_displays(&models[0], &models[1], out, err);
    free(models);
    return fine;
}

// ---- lamps ------------------------------------------------------------------

struct map_facts {
    double mean, x_m, z_m; // luminance, and where its centre lies on the ceiling
};

static bool map_facts(const struct lamp *lamp, const struct ceiling *ceiling, struct map_facts *out,
                      struct error *err)
{
    struct luminance_map map = {0};
    double sum = 0, x = 0, z = 0;
    if (!luminance_map_load(lamp->file.map, ceiling, &map, err))
        return false;
    for (int row = 0; row < map.height; row++)
        for (int column = 0; column < map.width; column++) {
            double l = map.luminance[(size_t)row * map.width + column];
            sum += l;
            x += l * ((column + 0.5) / map.width - 0.5);
            z += l * ((row + 0.5) / map.height - 0.5);
        }
    *out = (struct map_facts){sum * lamp->file.map_scale / map.width / map.height,
                              sum > 0 ? x / sum * map.ceiling.width_m : 0,
                              sum > 0 ? z / sum * map.ceiling.depth_m : 0};
    luminance_map_fini(&map);
    return true;
}

static bool compare_maps(const struct lamp *a, const struct lamp *b, const struct ceiling *ceiling,
                         struct lamp_change *out, struct error *err)
{
    struct map_facts one, other;
    if (!*a->file.map || !*b->file.map)
        return true;
    if (!map_facts(a, ceiling, &one, err) || !map_facts(b, ceiling, &other, err))
        return false;
    out->maps = true;
    out->map_percent = one.mean > 0 ? 100 * (other.mean / one.mean - 1) : 0;
    out->map_shift_m = hypot(other.x_m - one.x_m, other.z_m - one.z_m);
    return true;
}

static bool compare_lamps(const struct lamp *a, const struct lamp *b, const struct ceiling *ceiling,
                          struct lamp_change *out, struct error *err)
{
    struct xyz white = xyz_relative(&a->irradiance, NULL, OBSERVER_1931_2), other;
    struct lab one, two;
    memcpy(out->name, a->file.name, sizeof out->name);
    other = xyz_relative(&b->irradiance, NULL, OBSERVER_1931_2);
    if (!lab_of(white, white, &one, err) || !lab_of(other, white, &two, err))
        return while_doing(err, "lamp %s", a->file.name);
    out->white_de00 = delta_e_2000(one, two);
    out->lux_percent = 100 * (xyz_absolute(&b->irradiance, OBSERVER_1931_2).Y /
                                  xyz_absolute(&a->irradiance, OBSERVER_1931_2).Y -
                              1);
    out->shape = lamp_distance(&a->irradiance, &b->irradiance);
    return compare_maps(a, b, ceiling, out, err);
}

// lamps/NAME.ini, of a lamp in both versions any of whose files differ.
static bool is_changed_lamp(const struct store_version *a, const struct store_version *b,
                            const char *ini, char name[64])
{
    static const char *const ENDS[] = {"ini", "sp", "exr"};
    size_t length = strlen(ini), before = strlen(STORE_LAMPS "/");
    bool differs = false;
    if (strncmp(ini, STORE_LAMPS "/", before) || length < before + 5 ||
        strcmp(ini + length - 4, ".ini") || !both_hold(a, b, ini) || length - before - 4 > 63)
        return false;
    snprintf(name, 64, "%.*s", (int)(length - before - 4), ini + before);
    for (int i = 0; i < 3; i++) {
        char path[256];
        snprintf(path, sizeof path, STORE_LAMPS "/%s.%s", name, ENDS[i]);
        const struct sha256 *one = store_sum(a, path), *other = store_sum(b, path);
        differs = differs || !one != !other || (one && strcmp(one->hex, other->hex));
    }
    return differs;
}

static bool compare_all_lamps(const struct store_version *a, const struct store_version *b,
                              const struct ceiling *ceiling, struct difference *d,
                              struct error *err)
{
    for (int i = 0; i < a->count && d->lamp_count < CLASSIFIER_LAMPS_MOST; i++) {
        char name[64], path[PATH_MAX];
        struct lamp one, other;
        if (!is_changed_lamp(a, b, a->files[i].path, name))
            continue;
        snprintf(path, sizeof path, "%s/%s", a->folder, a->files[i].path);
        if (!lamp_load(path, &one, err))
            return false;
        snprintf(path, sizeof path, "%s/%s", b->folder, a->files[i].path);
        if (!lamp_load(path, &other, err) ||
            !compare_lamps(&one, &other, ceiling, &d->lamps[d->lamp_count++], err))
            return false;
    }
    return true;
}

// ---- geometry ---------------------------------------------------------------

double compare_stands(const struct stand *a, const struct stand *b, const struct screen *screen)
{
    double most = 0;
    for (double tilt = 0; tilt <= TILT_MOST_DEG; tilt += TILT_STEP_DEG) {
        struct rigid one = stand_pose(a, tilt), other = stand_pose(b, tilt);
        for (int corner = 0; corner < 4; corner++) {
            struct vec3 p = {(corner & 1 ? 0.5 : -0.5) * screen->width_m,
                             (corner & 2 ? 0.5 : -0.5) * screen->height_m, 0};
            struct vec3 way = vec3_sub(rigid_apply(other, p), rigid_apply(one, p));
            most = fmax(most, vec3_length(way));
        }
    }
    return most;
}

static double compare_trackers(const struct booth_settings *a, const struct booth_settings *b)
{
    const double *eye = a->tracker.default_eye_m;
    struct vec3 at = {eye[0], eye[1], eye[2]};
    struct rigid one = booth_from_tracker(a), other = booth_from_tracker(b);
    struct vec3 seen = rigid_apply(rigid_inverse(one), at);
    return vec3_length(vec3_sub(rigid_apply(other, seen), at));
}

static bool geometry_of(const struct store_version *v, struct booth_settings *booth,
                        struct error *err)
{
    char path[PATH_MAX];
    struct geometry found;
    snprintf(path, sizeof path, "%s/" STORE_GEOMETRY, v->folder);
    if (!store_sum(v, STORE_GEOMETRY))
        return true;
    if (!geometry_load(path, &found, err))
        return false;
    geometry_take(booth, &found.booth, found.rows);
    return true;
}

static bool compare_geometries(const struct store_version *a, const struct store_version *b,
                               const struct booth_settings *booth, struct geometry_change *out,
                               struct error *err)
{
    struct booth_settings one = *booth, other = *booth;
    if (!geometry_of(a, &one, err) || !geometry_of(b, &other, err))
        return false;
    out->there = store_sum(a, STORE_GEOMETRY) || store_sum(b, STORE_GEOMETRY);
    out->screen_m = compare_stands(&one.stand.stand, &other.stand.stand, &booth->screen);
    out->eye_m = compare_trackers(&one, &other);
    return true;
}

bool compare_versions(const struct store_version *a, const struct store_version *b,
                      const struct booth_settings *booth, struct difference *out, struct error *err)
{
    struct difference d = {0};
    bool fine = compare_files(a, b, &d, err) &&
                (!both_hold(a, b, STORE_DISPLAY) || compare_display_files(a, b, &d.display, err)) &&
                compare_all_lamps(a, b, &booth->ceiling, &d, err) &&
                compare_geometries(a, b, booth, &d.geometry, err);
    if (fine)
        *out = d;
    else
        difference_fini(&d);
    return fine;
}
