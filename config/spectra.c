// SPDX-License-Identifier: Apache-2.0
#include "config/spectra.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "colorimetry/illuminant.h"
#include "files/cgats.h"
#include "files/table.h"
#include "files/text.h"

#define FIELD_SLACK_NM 0.51 // field names carry whole nanometres
#define LAMP_NOISE 0.05     // of its peak: an instrument's noise where it sees badly
#define LAMP_LEAST 1e-30    // a peak beyond these is no power in any unit,
#define LAMP_MOST 1e30      // and sums of it leave what a double holds
#define SURFACE_LEAST -0.02 // noise
#define SURFACE_SURE 1.05   // noise; beyond it the surface fluoresces
#define SURFACE_MOST 1.3    // beyond it a "reflectance" is per cent or counts
#define NEEDED_FIRST_NM 420.0
#define NEEDED_LAST_NM 680.0

enum { FIELDS_LEAST = 2, NEEDED_SAMPLES = 8 };

void spectra_fini(struct spectra *s)
{
    free(s->spectra);
    free(s->names);
    *s = (struct spectra){0};
}

static bool make_room(struct spectra *s, size_t count, struct error *err)
{
    s->spectra = calloc(count, sizeof *s->spectra);
    s->names = calloc(count, sizeof *s->names);
    if (!s->spectra || !s->names)
        return fail(err, ERROR_SYSTEM, "out of memory for %zu spectra", count);
    s->count = (int)count;
    return true;
}

static void name_one(struct spectra *s, size_t i, const char *name)
{
    if (name && *name)
        snprintf(s->names[i], sizeof s->names[i], "%s", name);
    else
        snprintf(s->names[i], sizeof s->names[i], "%zu", i + 1);
}

// One spectrum as read; of_line[i * line_step] is the line of sample i.
struct samples {
    const char *path, *name;
    const double *nm, *values;
    size_t count, line_step;
    const int *of_line;
};

static bool bad_value(const struct samples *s, size_t i, const char *must, struct error *err)
{
    return fail(err, ERROR_DATA, "%s:%d: %s: %g at %g nm; %s", s->path,
                s->of_line[i * s->line_step], s->name, s->values[i], s->nm[i], must);
}

static bool on_grid(double nm)
{
    return nm >= SPECTRUM_FIRST_NM && nm <= SPECTRUM_LAST_NM;
}

// A lamp's power is not negative but for noise, and of a size that sums keep.
static bool check_lamp(const struct samples *s, struct error *err)
{
    size_t top = 0;
    for (size_t i = 0; i < s->count; i++)
        if (s->values[i] > s->values[top])
            top = i;
    double peak = fmax(s->values[top], 0);
    if (peak > 0 && !(peak >= LAMP_LEAST && peak <= LAMP_MOST))
        return bad_value(s, top, "allowed: a largest power of 1e-30..1e30", err);
    for (size_t i = 0; i < s->count; i++)
        if (on_grid(s->nm[i]) && s->values[i] < -LAMP_NOISE * peak)
            return bad_value(s, i, "a lamp's power must be 0 or more", err);
    return true;
}

// What lies outside the grid is not looked at.
static bool check_surface(const struct samples *s, struct spectra *out, struct error *err)
{
    for (size_t i = 0; i < s->count; i++) {
        double v = s->values[i];
        if (!on_grid(s->nm[i]) || (v >= SURFACE_LEAST && v <= SURFACE_SURE))
            continue;
        if (!(v >= SURFACE_LEAST && v <= SURFACE_MOST))
            return bad_value(s, i,
                             "allowed: a reflectance -0.02..1.3, 1 for the perfect white (is it "
                             "per cent?)",
                             err);
        if (!*out->warning)
            snprintf(out->warning, sizeof out->warning,
                     "%.150s:%d: %.30s: %g at %g nm is above 1.05; does the surface fluoresce?",
                     s->path, s->of_line[i * s->line_step], s->name, v, s->nm[i]);
    }
    return true;
}

// Enough of the visible range, closely enough. Few samples tell an even
// spectrum only.
static bool check_range(const struct samples *s, struct error *err)
{
    double first = s->nm[0], last = s->nm[s->count - 1];
    size_t within = 0;
    bool even = true;
    for (size_t i = 0; i < s->count; i++) {
        within += s->nm[i] >= NEEDED_FIRST_NM && s->nm[i] <= NEEDED_LAST_NM;
        even &= s->values[i] == s->values[0];
    }
    if (!(first <= NEEDED_FIRST_NM && last >= NEEDED_LAST_NM))
        return fail(err, ERROR_DATA,
                    "%s: %s: wavelengths %g..%g; needed are %g or below to %g or above, in "
                    "nanometres",
                    s->path, s->name, first, last, NEEDED_FIRST_NM, NEEDED_LAST_NM);
    if (within < NEEDED_SAMPLES && !even)
        return fail(err, ERROR_DATA,
                    "%s: %s: %zu samples from %g to %g nm; needed are at least %d, unless all are "
                    "equal",
                    s->path, s->name, within, NEEDED_FIRST_NM, NEEDED_LAST_NM, NEEDED_SAMPLES);
    return true;
}

static bool take_samples(const struct samples *s, bool held, struct spectra *out, size_t i,
                         struct error *err)
{
    if (!(held ? check_surface(s, out, err) : check_lamp(s, err)) || !check_range(s, err))
        return false;
    return spectrum_from_samples(s->nm, s->values, s->count, held, &out->spectra[i], err) ||
           while_doing(err, "%s:%d: %s", s->path, s->of_line[0], s->name);
}

// ---- CSV: wavelengths down, one spectrum a column ----------------------------

static bool check_wavelengths(const struct table *t, struct error *err)
{
    if (t->columns < 2)
        return fail(err, ERROR_DATA, "%s: %zu column; a spectrum needs \"nm, value\"", t->path,
                    t->columns);
    if (t->rows < 2)
        return fail(err, ERROR_DATA, "%s: %zu line(s) of numbers; a spectrum needs at least 2",
                    t->path, t->rows);
    for (size_t i = 1; i < t->rows; i++)
        if (table_at(t, i, 0) <= table_at(t, i - 1, 0))
            return fail(err, ERROR_DATA,
                        "%s:%d: wavelength %g nm does not follow %g nm; wavelengths must rise",
                        t->path, t->lines[i], table_at(t, i, 0), table_at(t, i - 1, 0));
    return true;
}

static bool csv_column(const struct table *t, size_t column, bool held, double *nm,
                       double *values, struct spectra *out, struct error *err)
{
    name_one(out, column - 1, t->names[column]);
    for (size_t i = 0; i < t->rows; i++) {
        nm[i] = table_at(t, i, 0);
        values[i] = table_at(t, i, column);
    }
    struct samples s = {t->path, out->names[column - 1], nm, values, t->rows, 1, t->lines};
    return take_samples(&s, held, out, column - 1, err);
}

static bool from_csv(const struct table *t, bool held, struct spectra *out, struct error *err)
{
    if (!check_wavelengths(t, err) || !make_room(out, t->columns - 1, err))
        return false;
    double *room = calloc(2 * t->rows, sizeof *room);
    bool ok = room || fail(err, ERROR_SYSTEM, "%s: out of memory", t->path);
    for (size_t c = 1; c < t->columns && ok; c++)
        ok = csv_column(t, c, held, room, room + t->rows, out, err);
    free(room);
    return ok;
}

// ---- CGATS: one spectrum a row, fields SPEC_380, SPEC_390, … -----------------

struct fields {
    size_t *columns; // of the SPEC_ fields, in order
    double *nm;      // as their names say
    size_t count;
    double norm;
};

static bool find_fields(const struct table *t, struct fields *f, struct error *err)
{
    f->columns = calloc(t->columns + 1, sizeof *f->columns);
    f->nm = calloc(2 * t->columns + 1, sizeof *f->nm);
    if (!f->columns || !f->nm)
        return fail(err, ERROR_SYSTEM, "%s: out of memory", t->path);
    for (size_t c = 0; c < t->columns; c++) {
        if (strncmp(t->names[c], "SPEC_", 5) != 0)
            continue;
        const char *digits = t->names[c] + 5;
        size_t size = strspn(digits, "0123456789");
        if (digits[size] || !size || size > 5)
            return fail(err, ERROR_DATA,
                        "%s: field %.60s names no wavelength; allowed: SPEC_ and whole nanometres",
                        t->path, t->names[c]);
        f->nm[f->count] = atoi(digits);
        f->columns[f->count++] = c;
    }
    if (f->count < FIELDS_LEAST)
        return fail(err, ERROR_DATA, "%s: %zu SPEC_ field(s); a spectrum needs at least %d",
                    t->path, f->count, FIELDS_LEAST);
    return true;
}

static bool contradicts(const struct cgats *file, const char *key, double value,
                        const char *fields_say, double is, struct error *err)
{
    return fail(err, ERROR_DATA, "%s:%d: %s is %g but %s%g", file->table.path,
                cgats_line(file, key), key, value, fields_say, is);
}

// The header against the fields; wavelengths of full precision from the header.
static bool check_header(const struct cgats *file, struct fields *f, struct error *err)
{
    double bands, start, end, norm;
    if (!cgats_numbers(file, "SPECTRAL_BANDS", &bands, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_START_NM", &start, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_END_NM", &end, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_NORM", &norm, 1, err))
        return false;
    double first = f->nm[0], last = f->nm[f->count - 1];
    const char *first_is = "the first field is SPEC_", *last_is = "the last field is SPEC_";
    if (bands != (double)f->count)
        return contradicts(file, "SPECTRAL_BANDS", bands, "the number of SPEC_ fields is ",
                           (double)f->count, err);
    if (fabs(start - first) > FIELD_SLACK_NM)
        return contradicts(file, "SPECTRAL_START_NM", start, first_is, first, err);
    if (fabs(end - last) > FIELD_SLACK_NM)
        return contradicts(file, "SPECTRAL_END_NM", end, last_is, last, err);
    if (!(norm > 0))
        return fail(err, ERROR_DATA, "%s:%d: SPECTRAL_NORM is %g; it must be above 0",
                    file->table.path, cgats_line(file, "SPECTRAL_NORM"), norm);
    f->norm = norm;
    for (size_t i = 0; i < f->count; i++) {
        double nm = start + (end - start) * (double)i / (double)(f->count - 1);
        if (fabs(nm - f->nm[i]) > FIELD_SLACK_NM)
            return fail(err, ERROR_DATA,
                        "%s: field SPEC_%g stands where SPECTRAL_START_NM %g, SPECTRAL_END_NM %g "
                        "and SPECTRAL_BANDS %g put %g nm",
                        file->table.path, f->nm[i], start, end, bands, nm);
        f->nm[i] = nm;
    }
    return true;
}

static bool cgats_row(const struct table *t, size_t row, const struct fields *f, bool held,
                      struct spectra *out, struct error *err)
{
    double *values = f->nm + f->count;
    name_one(out, row, t->labels ? t->labels[row] : NULL);
    for (size_t i = 0; i < f->count; i++)
        values[i] = table_at(t, row, f->columns[i]) / f->norm;
    struct samples s = {t->path, out->names[row], f->nm, values, f->count, 0, &t->lines[row]};
    return take_samples(&s, held, out, row, err);
}

static bool from_cgats(const struct cgats *file, bool held, struct spectra *out, struct error *err)
{
    const struct table *t = &file->table;
    struct fields f = {0};
    bool ok = find_fields(t, &f, err) && check_header(file, &f, err);
    if (ok && t->rows == 0)
        ok = fail(err, ERROR_DATA, "%s: no spectrum between BEGIN_DATA and END_DATA", t->path);
    ok = ok && make_room(out, t->rows, err);
    for (size_t row = 0; row < t->rows && ok; row++)
        ok = cgats_row(t, row, &f, held, out, err);
    free(f.columns);
    free(f.nm);
    return ok;
}

// ---- either ------------------------------------------------------------------

static bool load_cgats(const char *path, bool held, struct spectra *out, struct error *err)
{
    struct cgats file = {0};
    bool ok = cgats_load(path, &file, err) && from_cgats(&file, held, out, err);
    cgats_fini(&file);
    return ok;
}

static bool load_csv(const char *path, bool held, struct spectra *out, struct error *err)
{
    struct table table = {0};
    bool ok = csv_load(path, &table, err) && from_csv(&table, held, out, err);
    table_fini(&table);
    return ok;
}

bool spectra_load(const char *path, bool held, struct spectra *out, struct error *err)
{
    struct spectra loaded = {0};
    bool cgats = text_ends_with(path, ".sp") || text_ends_with(path, ".ti3");
    bool ok = cgats ? load_cgats(path, held, &loaded, err) : load_csv(path, held, &loaded, err);
    if (!ok) {
        spectra_fini(&loaded);
        return false;
    }
    *out = loaded;
    return true;
}

bool spectra_is_path(const char *text)
{
    struct spectrum cie;
    if (strchr(text, '/') || text_ends_with(text, ".csv") || text_ends_with(text, ".sp"))
        return true;
    return !illuminant(text, &cie, NULL) && access(text, F_OK) == 0;
}

static bool cie_lamp(const char *name, struct spectrum *out, struct error *err)
{
    struct error why;
    return illuminant(name, out, &why) ||
           fail(err, why.code, "%s (a file is named by a path that exists, or ./%.40s)", why.text,
                name);
}

bool lamp_spectrum(const char *name_or_path, struct spectrum *out, struct error *err)
{
    if (!spectra_is_path(name_or_path))
        return cie_lamp(name_or_path, out, err);
    struct spectra loaded = {0};
    if (!spectra_load(name_or_path, false, &loaded, err))
        return false;
    bool lit = spectrum_sum(&loaded.spectra[0]) > 0;
    if (lit)
        *out = loaded.spectra[0];
    spectra_fini(&loaded);
    return lit || fail(err, ERROR_DATA, "%s: no light from %d to %d nm", name_or_path,
                       SPECTRUM_FIRST_NM, SPECTRUM_LAST_NM);
}
