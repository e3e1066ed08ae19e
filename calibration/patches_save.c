// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/patches.h"
#include "files/cgats.h"

enum { COLOURS = 6, SPECTRUM_MOST = 401, KEYWORDS_MOST = 16, NAME = 32 };

static const double MILLI = 1000; // W to mW, as ArgyllCMS writes emission

// The wavelengths that all spectra share; count 0 where they do not.
struct spectra {
    const json_t *readings;
    int count;
    double first_nm, last_nm;
};

static const json_t *reading_of(const struct display_patch *p, const json_t *readings)
{
    return json_array_get(readings, (size_t)p->reading);
}

static struct spectra spectra_of(const struct patch_set *set, const json_t *readings)
{
    const json_t *nm = json_object_get(reading_of(&set->patches[0], readings), "nm");
    int count = (int)json_array_size(nm);
    bool same = readings && count > 1 && count <= SPECTRUM_MOST;
    for (int i = 0; same && i < set->count; i++) {
        const json_t *r = reading_of(&set->patches[i], readings);
        same = json_equal(json_object_get(r, "nm"), nm) &&
               json_array_size(json_object_get(r, "values")) == (size_t)count;
    }
    if (!same)
        return (struct spectra){0};
    return (struct spectra){readings, count, json_number_value(json_array_get(nm, 0)),
                            json_number_value(json_array_get(nm, (size_t)count - 1))};
}

static void fill_row(const struct display_patch *p, double k, const struct spectra *spectra,
                     double *row)
{
    const double v[COLOURS] = {100 * p->counts.r, 100 * p->counts.g, 100 * p->counts.b,
                               k * p->xyz.X,      k * p->xyz.Y,      k * p->xyz.Z};
    memcpy(row, v, sizeof v);
    const json_t *values = json_object_get(reading_of(p, spectra->readings), "values");
    for (int i = 0; i < spectra->count; i++)
        row[COLOURS + i] = MILLI * json_number_value(json_array_get(values, (size_t)i));
}

// What a table's rows and names lie in.
struct room {
    double *values;
    char (*ids)[NAME], (*names)[NAME], **labels, **columns;
};

static void room_fini(struct room *room)
{
    free(room->values);
    free(room->ids);
    free(room->names);
    free(room->labels);
    free(room->columns);
}

static bool room_init(struct room *room, size_t rows, size_t columns)
{
    room->values = calloc(rows * columns, sizeof *room->values);
    room->ids = calloc(rows, sizeof *room->ids);
    room->labels = calloc(rows, sizeof *room->labels);
    room->names = calloc(columns, sizeof *room->names);
    room->columns = calloc(columns, sizeof *room->columns);
    return room->values && room->ids && room->labels && room->names && room->columns;
}

static void fill(const struct patch_set *set, double k, const struct spectra *spectra,
                 struct room *room, struct table *table)
{
    static const char *const COLOUR[COLOURS] = {"RGB_R", "RGB_G", "RGB_B",
                                                "XYZ_X", "XYZ_Y", "XYZ_Z"};
    double step =
        spectra->count > 1 ? (spectra->last_nm - spectra->first_nm) / (spectra->count - 1) : 0;
    for (size_t c = 0; c < table->columns; c++) {
        if (c < COLOURS)
            snprintf(room->names[c], NAME, "%s", COLOUR[c]);
        else
            snprintf(room->names[c], NAME, "SPEC_%g",
                     spectra->first_nm + step * (double)(c - COLOURS));
        room->columns[c] = room->names[c];
    }
    for (size_t r = 0; r < table->rows; r++) {
        fill_row(&set->patches[r], k, spectra, room->values + r * table->columns);
        snprintf(room->ids[r], NAME, "%zu", r + 1);
        room->labels[r] = room->ids[r];
    }
    table->values = room->values;
    table->labels = room->labels;
    table->names = room->columns;
}

static bool save(const char *path, const struct table *table, struct xyz white,
                 const char *instrument, const struct spectra *spectra, struct error *err)
{
    char luminance[96], created[21], by[64], bands[16], first[32], last[32];
    snprintf(luminance, sizeof luminance, "%.6f %.6f %.6f", white.X, white.Y, white.Z);
    snprintf(by, sizeof by, "boothd %s", BOOTHD_VERSION);
    snprintf(bands, sizeof bands, "%d", spectra->count);
    snprintf(first, sizeof first, "%g", spectra->first_nm);
    snprintf(last, sizeof last, "%g", spectra->last_nm);
    clock_utc(created);
    struct cgats_keyword keywords[KEYWORDS_MOST] = {
        {"DESCRIPTOR", "Display characterisation", 0},
        {"ORIGINATOR", by, 0},
        {"CREATED", created, 0},
        {"DEVICE_CLASS", "DISPLAY", 0},
        {"COLOR_REP", "RGB_XYZ", 0},
        {"TARGET_INSTRUMENT", (char *)instrument, 0},
        {"LUMINANCE_XYZ_CDM2", luminance, 0},
        {"NORMALIZED_TO_Y_100", "YES", 0},
        {"INSTRUMENT_TYPE_SPECTRAL", spectra->count ? "YES" : "NO", 0},
    };
    size_t n = 9;
    if (spectra->count) {
        keywords[n++] = (struct cgats_keyword){"SPECTRAL_BANDS", bands, 0};
        keywords[n++] = (struct cgats_keyword){"SPECTRAL_START_NM", first, 0};
        keywords[n++] = (struct cgats_keyword){"SPECTRAL_END_NM", last, 0};
    }
    struct cgats file = {
        .identifier = "CTI3", .keyword_count = n, .keywords = keywords, .table = *table};
    return cgats_save(path, &file, err);
}

bool patch_set_save(const struct patch_set *set, const char *path, struct xyz white,
                    const char *instrument, const json_t *readings, struct error *err)
{
    if (set->count < 1)
        return fail(err, ERROR_RANGE, "%s: no patch was measured", path);
    struct spectra spectra = spectra_of(set, readings);
    struct table table = {.columns = COLOURS + (size_t)spectra.count, .rows = (size_t)set->count};
    struct room room = {0};
    bool fine = room_init(&room, table.rows, table.columns) ||
                fail(err, ERROR_SYSTEM, "%s: out of memory", path);
    if (fine) {
        fill(set, 100 / white.Y, &spectra, &room, &table);
        fine = save(path, &table, white, instrument, &spectra, err);
    }
    room_fini(&room);
    return fine;
}
