// SPDX-License-Identifier: Apache-2.0
#include "config/materials.h"

#include <limits.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "base/settings.h"
#include "config/paths.h"
#include "config/spectra.h"
#include "files/ini.h"

#define AT(field) offsetof(struct material_file, field)
#define ROOM(field) SETTING_SIZE(struct material_file, field)

static const char *const kind_names[] = {"chart", "flat", "bands", NULL};

const struct setting material_file_settings[] = {
    {"name", SETTING_TEXT, AT(name), ROOM(name), 0, 0, "", NULL, NULL, "Name of the material."},
    {"kind", SETTING_ENUM, AT(kind), 0, 0, 0, "", kind_names, NULL,
     "Patches of known spectra, one uniform surface, or an image of band coefficients."},
    {"source", SETTING_TEXT, AT(source), ROOM(source), 0, 0, "", NULL, "",
     "Table of reflectance spectra (chart, flat) or EXR image (bands)."},
    {"reflectance", SETTING_DOUBLE, AT(reflectance), 0, 0, 1, "", NULL, "1",
     "Of a flat material without a source, the same at all wavelengths."},
    {"columns", SETTING_INT, AT(columns), 0, 1, 64, "", NULL, "1", "Patches across a chart."},
    {"rows", SETTING_INT, AT(rows), 0, 1, 64, "", NULL, "1", "Patches down a chart."},
    {"gap", SETTING_DOUBLE, AT(gap), 0, 0, 0.5, "", NULL, "0",
     "Gap between and around a chart's patches, in widths of a patch."},
    {"background", SETTING_TEXT, AT(background), ROOM(background), 0, 0, "", NULL, "0.05",
     "What shows in the gaps: a spectrum of the source by name, or a reflectance 0..1."},
    {"width_m", SETTING_DOUBLE, AT(width_m), 0, 0, 100, "m", NULL, "0",
     "Width on the screen; 0 fills it."},
    {"height_m", SETTING_DOUBLE, AT(height_m), 0, 0, 100, "m", NULL, "0",
     "Height on the screen; 0 fills it."},
    {0}};

static struct spectrum grey(double reflectance)
{
    struct spectrum s;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        s.v[i] = reflectance;
    return s;
}

static bool reflectances_load(const char *path, struct spectra *out, struct error *err)
{
    if (!*path)
        return fail(err, ERROR_CONFIG, "source: must name a table of spectra");
    return spectra_load(path, true, out, err);
}

// Index of the background among the spectra; a number is added as a grey.
static bool background(struct spectra *s, const char *text, int *index, struct error *err)
{
    const char *end;
    double value;
    for (int i = 0; i < s->count; i++)
        if (!strcmp(s->names[i], text)) {
            *index = i;
            return true;
        }
    if (!number_parse(text, &end, &value) || *end || !(value >= 0 && value <= 1))
        return fail(err, ERROR_CONFIG,
                    "background: \"%s\" is neither a spectrum of the source nor a reflectance "
                    "0..1",
                    text);
    void *spectra = realloc(s->spectra, (s->count + 1) * sizeof *s->spectra);
    s->spectra = spectra ? spectra : s->spectra;
    void *names = realloc(s->names, (s->count + 1) * sizeof *s->names);
    s->names = names ? names : s->names;
    if (!spectra || !names)
        return fail(err, ERROR_SYSTEM, "no memory for the background");
    s->spectra[s->count] = grey(value);
    snprintf(s->names[s->count], sizeof *s->names, "background");
    *index = s->count++;
    return true;
}

static bool chart(const struct material_file *f, struct material *out, struct error *err)
{
    struct spectra s = {0};
    int behind = 0, patches = f->columns * f->rows;
    if (!reflectances_load(f->source, &s, err))
        return false;
    bool fine =
        patches <= s.count ||
        fail(err, ERROR_CONFIG, "columns and rows: %d x %d is more than the %d spectra of %s",
             f->columns, f->rows, s.count, f->source);
    fine = fine && background(&s, f->background, &behind, err) &&
           material_chart(f->name, s.spectra, s.names, s.count, f->columns, f->rows, f->gap, behind,
                          out, err);
    spectra_fini(&s);
    return fine;
}

static bool flat(const struct material_file *f, struct material *out, struct error *err)
{
    struct spectra s = {0};
    if (!*f->source) {
        struct spectrum even = grey(f->reflectance);
        return material_flat(f->name, &even, out, err);
    }
    if (!reflectances_load(f->source, &s, err))
        return false;
    bool fine = s.count == 1
                    ? material_flat(f->name, &s.spectra[0], out, err)
                    : fail(err, ERROR_CONFIG, "source: %s holds %d spectra where one is wanted",
                           f->source, s.count);
    spectra_fini(&s);
    return fine;
}

static bool make(const struct material_file *f, struct material *out, struct error *err)
{
    switch ((enum material_kind)f->kind) {
    case MATERIAL_CHART:
        return chart(f, out, err);
    case MATERIAL_FLAT:
        return flat(f, out, err);
    case MATERIAL_BANDS:
        if (!*f->source)
            return fail(err, ERROR_CONFIG, "source: must name an EXR image");
        return material_from_exr(f->name, f->source, out, err);
    }
    return fail(err, ERROR_CONFIG, "kind: unknown");
}

static bool unknown(const char *folder, const char *name, struct error *err)
{
    struct dirent **entries = NULL;
    char list[300] = "none";
    int count = scandir(folder, &entries, path_is_ini, alphasort);
    for (int i = 0, used = 0; i < count; i++) {
        if (used < (int)sizeof list)
            used += snprintf(list + used, sizeof list - used, "%s%.*s", i ? ", " : "",
                             (int)strlen(entries[i]->d_name) - 4, entries[i]->d_name);
        free(entries[i]);
    }
    free(entries);
    return fail(err, ERROR_CONFIG, "no material \"%.60s\" in %.100s; there is: %s", name, folder,
                list);
}

bool material_load(const struct booth_settings *booth, const char *name_or_path,
                   struct material *out, struct error *err)
{
    const char *folder =
        *booth->materials.folder ? booth->materials.folder : booth_shipped_materials();
    char path[PATH_MAX];
    struct material_file file;
    const struct settings_section sections[] = {{"material", material_file_settings, &file}, {0}};
    bool named = !strchr(name_or_path, '/');
    int length = named ? snprintf(path, sizeof path, "%s/%s.ini", folder, name_or_path)
                       : snprintf(path, sizeof path, "%s", name_or_path);
    if (length >= (int)sizeof path)
        return fail(err, ERROR_CONFIG, "the path of \"%.200s\" is too long", name_or_path);
    if (named && !path_exists(path))
        return unknown(folder, name_or_path, err);
    if (!ini_load(path, sections, err))
        return false;
    if (!path_beside(path, file.source, file.source, sizeof file.source, err) ||
        !make(&file, out, err))
        return while_doing(err, "%s", path);
    out->width_m = file.width_m;
    out->height_m = file.height_m;
    return true;
}

static bool no_patch(const struct material *chart, const char *patch, struct error *err)
{
    char list[300] = "none, since it is no chart";
    size_t used = 0;
    for (int i = 0; i < chart->palette_count && used < sizeof list; i++)
        used += snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "",
                         chart->palette_names[i]);
    return fail(err, ERROR_RANGE, "%s has no patch \"%.60s\"; there is: %s", chart->name, patch,
                list);
}

bool material_patch(const struct material *chart, const char *patch, struct material *out,
                    struct error *err)
{
    for (int i = 0; i < chart->palette_count; i++)
        if (!strcmp(chart->palette_names[i], patch))
            return material_flat(patch, &chart->palette[i], out, err);
    return no_patch(chart, patch, err);
}
