// SPDX-License-Identifier: Apache-2.0
#include "simulator/lamps.h"

#include <stdlib.h>
#include <string.h>

#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "files/cgats.h"
#include "files/text.h"

static bool powers_to_spectrum(const char *path, const double *nm, const double *power,
                               size_t count, struct spectrum *out, struct error *err)
{
    for (size_t i = 0; i < count; i++)
        if (!(power[i] >= 0))
            return fail(err, ERROR_CONFIG, "%s: power %g at %g nm is negative", path, power[i],
                        nm[i]);
    if (!spectrum_from_samples(nm, power, count, false, out, err)) {
        if (err)
            err->code = ERROR_CONFIG;
        return while_doing(err, "%s", path);
    }
    return true;
}

static bool from_csv(const char *path, struct spectrum *out, struct error *err)
{
    struct table table = {0};
    if (!csv_load(path, &table, err))
        return false;
    double *nm = calloc(table.rows + 1, sizeof *nm), *power = calloc(table.rows + 1, sizeof *power);
    bool good = false;
    if (!nm || !power)
        fail(err, ERROR_SYSTEM, "out of memory");
    else if (table.columns < 2 || table.rows < 2)
        fail(err, ERROR_CONFIG, "%s: needs two columns (nm, power) and two rows at least", path);
    else {
        for (size_t i = 0; i < table.rows; i++) {
            nm[i] = table_at(&table, i, 0);
            power[i] = table_at(&table, i, 1);
        }
        good = powers_to_spectrum(path, nm, power, table.rows, out, err);
    }
    free(nm);
    free(power);
    table_fini(&table);
    return good;
}

enum { SP_BANDS_MOST = 601 };

static bool sp_powers(const struct cgats *file, double *nm, double *power, size_t *count,
                      struct error *err)
{
    const char *path = file->table.path;
    double bands, start, end, norm = 1;
    if (!cgats_numbers(file, "SPECTRAL_BANDS", &bands, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_START_NM", &start, 1, err) ||
        !cgats_numbers(file, "SPECTRAL_END_NM", &end, 1, err))
        return false;
    if (cgats_keyword(file, "SPECTRAL_NORM") &&
        !cgats_numbers(file, "SPECTRAL_NORM", &norm, 1, err))
        return false;
    size_t fields = 0;
    for (size_t c = 0; c < file->table.columns; c++)
        fields += !strncmp(file->table.names[c], "SPEC_", 5);
    if (bands != (double)fields || fields < 2 || fields > SP_BANDS_MOST)
        return fail(err, ERROR_CONFIG, "%s: SPECTRAL_BANDS is %g, but there are %zu SPEC_ fields",
                    path, bands, fields);
    if (!file->table.rows || !(norm > 0) || !(end > start))
        return fail(err, ERROR_CONFIG, "%s: no spectrum, or SPECTRAL_NORM %g, or %g..%g nm", path,
                    norm, start, end);
    *count = fields;
    for (size_t i = 0; i < fields; i++) {
        nm[i] = start + (end - start) * (double)i / (double)(fields - 1);
        char name[32];
        snprintf(name, sizeof name, "SPEC_%03d", (int)(nm[i] + 0.5));
        int column = table_column(&file->table, name);
        if (column < 0)
            return fail(err, ERROR_CONFIG, "%s: there is no field %s for %g nm", path, name, nm[i]);
        power[i] = table_at(&file->table, 0, column) / norm;
    }
    return true;
}

static bool from_sp(const char *path, struct spectrum *out, struct error *err)
{
    struct cgats file = {0};
    double nm[SP_BANDS_MOST], power[SP_BANDS_MOST];
    size_t count = 0;
    if (!cgats_load_as(path, "SPECT", &file, err))
        return false;
    bool good = sp_powers(&file, nm, power, &count, err) &&
                powers_to_spectrum(path, nm, power, count, out, err);
    cgats_fini(&file);
    return good;
}

bool lamp_spectrum_load(const char *name_or_path, struct spectrum *out, struct error *err)
{
    if (text_ends_with(name_or_path, ".sp"))
        return from_sp(name_or_path, out, err);
    if (strchr(name_or_path, '/') || text_ends_with(name_or_path, ".csv"))
        return from_csv(name_or_path, out, err);
    return illuminant(name_or_path, out, err);
}

bool lamp_make(const struct scenario *scenario, const struct scenario_lamp *settings,
               struct vec3 centre, struct vec3 normal, struct lamp *out, struct error *err)
{
    struct lamp lamp = {.warmup_drop = settings->warmup_drop, .warmup_s = settings->warmup_s};
    strcpy(lamp.name, settings->name);
    if (!lamp_spectrum_load(settings->spectrum, &lamp.per_lux, err))
        return while_doing(err, "lamp %s", settings->name);
    double y = xyz_absolute(&lamp.per_lux, OBSERVER_1931_2).Y;
    if (!(y > 0))
        return fail(err, ERROR_CONFIG, "lamp %s: %s gives no visible light", settings->name,
                    settings->spectrum);
    spectrum_scale(&lamp.per_lux, 1 / y);
    if (!ceiling_make(&scenario->ceiling, settings, scenario->world.seed, &lamp.image, err))
        return while_doing(err, "lamp %s", settings->name);
    double lux = ceiling_illuminance(&lamp.image, centre, normal);
    if (!(lux > 0)) {
        lamp_fini(&lamp);
        return fail(err, ERROR_CONFIG, "lamp %s: sheds no light on the screen's centre",
                    settings->name);
    }
    ceiling_scale(&lamp.image, settings->lux / lux);
    *out = lamp;
    return true;
}

void lamp_fini(struct lamp *lamp)
{
    ceiling_fini(&lamp->image);
}

double lamp_warmth(const struct lamp *lamp, double on_s)
{
    return 1 - lamp->warmup_drop * exp(-fmax(on_s, 0) / lamp->warmup_s);
}
