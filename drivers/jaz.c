// SPDX-License-Identifier: Apache-2.0
#include "drivers/jaz.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/wavelength_refit.h"

enum { PRODUCT = 0x101e, COLUMNS = 3 };

static const double cubic_nm = 0.05;    // files give six decimals
static const double clear_counts = 100; // above the dark: a ratio says something
static const double alike = 1e-3;       // of P, and in per cent
static const double most_unlike = 0.01; // of the pixels
static const double weak_part = 0.01;   // of the highest reference count

bool jaz_is_ratio(const struct vendor_file *f)
{
    size_t looked = 0, unlike = 0;
    for (size_t i = 0; f->reference && i < f->count; i++) {
        double light = f->reference[i] - f->dark[i];
        double ratio = 100 * (f->sample[i] - f->dark[i]) / light;
        if (fabs(light) < clear_counts)
            continue;
        looked++;
        unlike += !(fabs(f->values[i] - ratio) <= alike * (1 + fabs(ratio)));
    }
    return looked > 0 && (double)unlike <= most_unlike * (double)looked;
}

static bool make_unit(const struct vendor_file *f, struct ocean_unit *out, struct error *err)
{
    const struct ocean_model *model = ocean_model(PRODUCT);
    double wavelength[4], worst;
    if (!f->sample || !f->dark || !f->reference || f->integration_us <= 0)
        return fail(err, ERROR_DATA, "%s: holds no raw counts, or not how long they took", f->path);
    if (f->count != (size_t)model->pixels)
        return fail(err, ERROR_DATA, "%s: %zu pixels; raw counts are taken of %d", f->path,
                    f->count, model->pixels);
    *out = (struct ocean_unit){.model = model, .order = -1, .saturation = model->full_counts};
    snprintf(out->serial, sizeof out->serial, "%.15s", f->serial);
    if (!refit_axis(f->nm, model->pixels, wavelength, &worst, err))
        return while_doing(err, "%s", f->path);
    return (worst <= cubic_nm && ocean_unit_rewave(out, wavelength)) ||
           fail(err, ERROR_DATA, "%s: the wavelengths are no cubic of the pixel", f->path);
}

static struct ocean_dark dark_of(const struct vendor_file *f, const struct ocean_unit *unit)
{
    struct ocean_dark d = {.averaged = f->averaged > 0 ? f->averaged : 1};
    memcpy(d.raw, f->dark, sizeof *d.raw * f->count);
    d.black = ocean_black_mean(unit->model, d.raw);
    return d;
}

static double linear_at(const struct vendor_file *f, double nm)
{
    size_t low = 0, high = f->count - 1;
    if (nm < f->nm[0] || nm > f->nm[high])
        return 0;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (f->nm[middle] <= nm)
            low = middle;
        else
            high = middle;
    }
    double part = (nm - f->nm[low]) / (f->nm[high] - f->nm[low]);
    return (1 - part) * f->values[low] + part * f->values[high];
}

// R less D, D following R's black pixels; *highest of the active ones.
static void reference_counts(const struct vendor_file *f, const struct ocean_unit *unit,
                             const struct ocean_dark *dark, double *counts, double *highest)
{
    const struct ocean_model *m = unit->model;
    double black = ocean_black_mean(m, f->reference);
    *highest = 0;
    for (int i = 0; i < m->pixels; i++) {
        counts[i] = f->reference[i] - dark->raw[i] - (black - dark->black);
        if (i >= m->active.first)
            *highest = fmax(*highest, counts[i]);
    }
}

// What R makes of the counts, as a calibration file would say it.
static bool reference_axis(const struct vendor_file *f, const struct jaz_worth *worth,
                           const struct ocean_unit *unit, const struct ocean_dark *dark,
                           struct ocean_axis *out, struct error *err)
{
    static char *const names[COLUMNS] = {"nm", "W_per_m2_nm_per_count_per_s", "sigma_percent"};
    const struct ocean_model *m = unit->model;
    const double electron = m->full_counts / m->well_electrons, noise = m->read_noise;
    double counts[OCEAN_PIXELS_MOST], highest;
    struct table table = {.columns = COLUMNS, .rows = f->count, .names = (char **)names};
    double *row = table.values = calloc(COLUMNS * f->count, sizeof *table.values);
    if (!row)
        return fail(err, ERROR_SYSTEM, "%s: out of memory", f->path);
    snprintf(table.path, sizeof table.path, "%s", worth->reference->path);
    reference_counts(f, unit, dark, counts, &highest);
    for (int i = 0; i < m->pixels; i++, row += COLUMNS) {
        double light = fmax(linear_at(worth->reference, f->nm[i]), 0) * worth->reference_scale;
        double variance = 2 * noise * noise + fmax(counts[i], 0) * electron;
        bool told = counts[i] > weak_part * highest && highest > clear_counts;
        row[0] = ocean_wavelength(unit, i);
        row[1] = told ? light * f->integration_us * 1e-6 / counts[i] : 0;
        row[2] = told ? fmin(100 * sqrt(variance / dark->averaged) / counts[i], 100) : 0;
    }
    bool fine = ocean_axis_make(unit, &table, 1, out, err);
    free(table.values);
    return fine;
}

bool jaz_irradiance(const struct vendor_file *f, const struct jaz_worth *worth, int boxcar,
                    struct jaz_light *out, struct error *err)
{
    struct ocean_unit unit;
    struct ocean_axis axis;
    if (!make_unit(f, &unit, err))
        return false;
    struct ocean_dark dark = dark_of(f, &unit);
    if (worth->calibration
            ? !ocean_axis_make(&unit, worth->calibration, worth->collector_mm2, &axis, err)
            : !reference_axis(f, worth, &unit, &dark, &axis, err))
        return false;
    struct ocean_reading reading = {.averaged = dark.averaged, .integration_us = f->integration_us};
    *out = (struct jaz_light){.peak = 0};
    for (int i = 0; i < unit.model->pixels; i++) {
        reading.raw[i] = f->sample[i] * dark.averaged;
        if (i >= axis.used.first && i <= axis.used.last)
            out->peak = fmax(out->peak, f->sample[i] / unit.saturation);
    }
    out->saturated = out->peak >= 1;
    out->peak = fmin(out->peak, 1);
    const struct ocean_process process = {BEND_OFF, boxcar, &dark};
    ocean_irradiance(&unit, &axis, &process, &reading, &out->irradiance, &out->sigma, NULL);
    return true;
}
