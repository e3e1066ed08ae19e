// SPDX-License-Identifier: Apache-2.0
#include "drivers/irradiance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- calibration ---------------------------------------------------------------

enum worth_unit { WORTH_UJ, WORTH_UW_CM2, WORTH_W_M2 };

static bool worth_unit(const struct table *t, enum worth_unit *out, struct error *err)
{
    static const struct {
        const char *name;
        enum worth_unit unit;
    } names[] = {{"", WORTH_UJ},
                 {"uJ_per_count", WORTH_UJ},
                 {"[uJoule/count]", WORTH_UJ},
                 {"uW_per_cm2_nm_per_count_per_s", WORTH_UW_CM2},
                 {"W_per_m2_nm_per_count_per_s", WORTH_W_M2}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(t->names[1], names[i].name)) {
            *out = names[i].unit;
            return true;
        }
    return fail(err, ERROR_DATA,
                "%s: column \"%s\" is none of uJ_per_count, uW_per_cm2_nm_per_count_per_s, "
                "W_per_m2_nm_per_count_per_s",
                t->path, t->names[1]);
}

static bool check_calibration(const struct table *t, struct error *err)
{
    bool third = t->columns == 3 && !strcmp(t->names[2], "sigma_percent");
    if ((t->columns != 2 && !third) || t->rows < 2)
        return fail(err, ERROR_DATA,
                    "%s: %zu columns and %zu rows instead of nm,uJ_per_count[,sigma_percent]",
                    t->path, t->columns, t->rows);
    for (size_t row = 0; row < t->rows; row++) {
        double nm = table_at(t, row, 0), k = table_at(t, row, 1);
        int line = t->lines ? t->lines[row] : (int)row + 1;
        if (row && !(nm > table_at(t, row - 1, 0)))
            return fail(err, ERROR_DATA, "%s:%d: %g nm does not ascend", t->path, line, nm);
        if (!(k >= 0))
            return fail(err, ERROR_DATA, "%s:%d: %g per count is negative", t->path, line, k);
        if (third && !(table_at(t, row, 2) >= 0 && table_at(t, row, 2) <= 100))
            return fail(err, ERROR_DATA, "%s:%d: sigma_percent: %g is outside 0..100", t->path,
                        line, table_at(t, row, 2));
    }
    return true;
}

static double calibration_at(const struct table *t, double nm, size_t column)
{
    size_t low = 0, high = t->rows - 1;
    if (nm < table_at(t, 0, 0) || nm > table_at(t, high, 0))
        return 0;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (table_at(t, middle, 0) <= nm)
            low = middle;
        else
            high = middle;
    }
    double a = table_at(t, low, 0), b = table_at(t, high, 0), f = (nm - a) / (b - a);
    return (1 - f) * table_at(t, low, column) + f * table_at(t, high, column);
}

static double worth_of(enum worth_unit unit, double value, double width_nm, double collector_mm2)
{
    switch (unit) {
    case WORTH_UJ: // uJ / (mm2 nm s) is W m-2 nm-1
        return value / (collector_mm2 * width_nm);
    case WORTH_UW_CM2:
        return value * 1e-2;
    case WORTH_W_M2:
        return value;
    }
    return 0;
}

bool ocean_axis_make(const struct ocean_unit *unit, const struct table *calibration,
                     double collector_mm2, struct ocean_axis *out, struct error *err)
{
    enum worth_unit kind = WORTH_UJ;
    if (!check_calibration(calibration, err) || !worth_unit(calibration, &kind, err))
        return false;
    const struct ocean_model *m = unit->model;
    struct pixel_range used = {m->pixels, -1};
    memset(out, 0, sizeof *out);
    out->edge_nm[0] = ocean_wavelength(unit, -0.5);
    for (int i = 0; i < m->pixels; i++) {
        double nm = ocean_wavelength(unit, i), *edge = &out->edge_nm[i];
        edge[1] = ocean_wavelength(unit, i + 0.5);
        double k = calibration_at(calibration, nm, 1);
        out->worth[i] = worth_of(kind, k, edge[1] - edge[0], collector_mm2);
        if (calibration->columns == 3)
            out->worth_sigma[i] = calibration_at(calibration, nm, 2) / 100;
        if (i < m->active.first || i > m->active.last || out->worth[i] <= 0 ||
            edge[1] <= SPECTRUM_FIRST_NM - 0.5 || edge[0] >= SPECTRUM_LAST_NM + 0.5)
            continue;
        used.last = i;
        if (used.first > i)
            used.first = i;
    }
    out->used = used;
    return used.last >= used.first ||
           fail(err, ERROR_DATA, "%s: calibrates no pixel of %s", calibration->path, unit->serial);
}

// ---- stored darks --------------------------------------------------------------

void ocean_darks_fini(struct ocean_darks *darks)
{
    free(darks->integration_us);
    free(darks->darks);
    *darks = (struct ocean_darks){0};
}

static bool dark_name(const char *name, int *us, int *averaged)
{
    char more;
    *averaged = 1;
    int read = sscanf(name, "us%dx%d%c", us, averaged, &more);
    bool plain = read == 1 && strspn(name + 2, "0123456789") == strlen(name + 2);
    return (plain || read == 2) && *us > 0 && *averaged > 0;
}

static bool take_dark(const struct ocean_unit *unit, const struct table *t, size_t column,
                      struct ocean_dark *out, struct error *err)
{
    for (size_t row = 0; row < t->rows; row++) {
        double counts = table_at(t, row, column);
        if (!(counts >= 0 && counts < unit->saturation))
            return fail(err, ERROR_DATA, "%s:%d: %g is no dark count of %s", t->path,
                        t->lines ? t->lines[row] : (int)row + 1, counts, unit->serial);
        out->raw[row] = counts;
    }
    out->black = ocean_black_mean(unit->model, out->raw);
    return true;
}

bool ocean_darks_make(const struct ocean_unit *unit, const struct table *t, struct ocean_darks *out,
                      struct error *err)
{
    struct ocean_darks darks = {0};
    *out = darks;
    if (t->rows != (size_t)unit->model->pixels)
        return fail(err, ERROR_DATA, "%s: %zu rows, but %s has %d pixels", t->path, t->rows,
                    unit->serial, unit->model->pixels);
    darks.integration_us = calloc(t->columns, sizeof *darks.integration_us);
    darks.darks = calloc(t->columns, sizeof *darks.darks);
    bool ok = (darks.integration_us && darks.darks) ||
              fail(err, ERROR_SYSTEM, "%s: out of memory", t->path);
    for (size_t c = 0; ok && c < t->columns; c++) {
        int *us = &darks.integration_us[c];
        ok = (dark_name(t->names[c], us, &darks.darks[c].averaged) && (c == 0 || us[0] > us[-1])) ||
             fail(err, ERROR_DATA, "%s: column \"%s\" names no ascending exposure in us", t->path,
                  t->names[c]);
        ok = ok && take_dark(unit, t, c, &darks.darks[c], err);
    }
    darks.count = (int)t->columns;
    if (ok)
        *out = darks;
    else
        ocean_darks_fini(&darks);
    return ok;
}

bool ocean_dark_at(const struct ocean_darks *darks, const struct ocean_unit *unit, int us,
                   struct ocean_dark *out)
{
    int high = 0;
    while (high < darks->count && darks->integration_us[high] < us)
        high++;
    if (high == darks->count || (high == 0 && darks->integration_us[0] != us))
        return false;
    *out = darks->darks[high];
    if (darks->integration_us[high] == us)
        return true;
    const struct ocean_dark *low = &darks->darks[high - 1];
    double from = darks->integration_us[high - 1], to = darks->integration_us[high];
    double f = (us - from) / (to - from);
    for (int i = 0; i < unit->model->pixels; i++)
        out->raw[i] = (1 - f) * low->raw[i] + f * out->raw[i];
    out->black = (1 - f) * low->black + f * out->black;
    if (low->averaged < out->averaged)
        out->averaged = low->averaged;
    return true;
}

// ---- counts --------------------------------------------------------------------

struct pixels {
    double value[OCEAN_PIXELS_MOST]; // W m-2 nm-1
    double shot[OCEAN_PIXELS_MOST], read[OCEAN_PIXELS_MOST], dark[OCEAN_PIXELS_MOST];
    double offset[OCEAN_PIXELS_MOST]; // what one count of common dark is worth
};

static double bent(const struct ocean_unit *unit, double counts)
{
    return counts / ocean_bend(unit, counts);
}

double ocean_linear_counts(const struct ocean_unit *unit, enum bend bend, double light, double dark,
                           double *slope)
{
    const double scale = unit->model->full_counts / unit->saturation;
    double counts = (light - dark) * scale, none;
    slope = slope ? slope : &none;
    *slope = 1;
    if (bend == BEND_OFF || unit->order < 0)
        return counts;
    *slope = 1 / ocean_bend(unit, bend == BEND_ABOVE_DARK ? counts : light * scale);
    if (bend == BEND_ABOVE_DARK)
        return bent(unit, counts);
    return bent(unit, light * scale) - bent(unit, dark * scale);
}

static double stray(const struct ocean_unit *unit, const double *counts)
{
    const struct pixel_range a = unit->model->active;
    double sum = 0;
    for (int i = a.first; unit->stray > 0 && i <= a.last; i++)
        sum += counts[i];
    return unit->stray * sum / (a.last - a.first + 1);
}

static void process_pixels(const struct ocean_unit *unit, const struct ocean_axis *axis,
                           const struct ocean_process *process, const struct ocean_reading *reading,
                           struct pixels *out)
{
    const struct ocean_model *m = unit->model;
    const double scale = m->full_counts / unit->saturation;
    const double electron = m->full_counts / m->well_electrons;
    const double black = ocean_black(unit, reading), n = reading->averaged;
    const double seconds = reading->integration_us * 1e-6, noise = m->read_noise;
    double counts[OCEAN_PIXELS_MOST], slope[OCEAN_PIXELS_MOST];
    for (int i = 0; i < m->pixels; i++) {
        double dark = process->dark ? process->dark->raw[i] + black - process->dark->black : black;
        counts[i] = ocean_linear_counts(unit, process->bend, reading->raw[i] / n, dark, &slope[i]);
    }
    double haze = stray(unit, counts);
    for (int i = 0; i < m->pixels; i++) {
        double worth = axis->worth[i] / seconds, above = (reading->raw[i] / n - black) * scale;
        out->value[i] = worth * (counts[i] - haze);
        out->offset[i] = worth * slope[i];
        out->shot[i] = out->offset[i] * sqrt(fmax(above, 0) * electron / n);
        out->read[i] = out->offset[i] * noise / sqrt(n);
        out->dark[i] = process->dark ? out->offset[i] * noise / sqrt(process->dark->averaged) : 0;
    }
}

// ---- bins ----------------------------------------------------------------------

// How much each pixel counts in one bin.
struct bin {
    double weight[OCEAN_PIXELS_MOST];
    int first, last;
    double width; // nm seen
};

static void add_weight(const struct ocean_axis *axis, int pixel, int boxcar, double overlap,
                       struct bin *bin)
{
    int from = pixel - boxcar, to = pixel + boxcar;
    from = from < axis->used.first ? axis->used.first : from;
    to = to > axis->used.last ? axis->used.last : to;
    for (int i = from; i <= to; i++) {
        while (bin->last < i)
            bin->weight[++bin->last] = 0;
        bin->weight[i] += overlap / (to - from + 1);
    }
}

// Pixels from *start on; moves *start to where the next bin begins.
static void weigh(const struct ocean_axis *axis, int boxcar, double from_nm, int *start,
                  struct bin *bin)
{
    const double to_nm = from_nm + 1;
    while (*start <= axis->used.last && axis->edge_nm[*start + 1] <= from_nm)
        ++*start;
    int low = *start - boxcar;
    bin->first = low < axis->used.first ? axis->used.first : low;
    bin->last = bin->first - 1;
    bin->width = 0;
    for (int i = *start; i <= axis->used.last && axis->edge_nm[i] < to_nm; i++) {
        double overlap = fmin(axis->edge_nm[i + 1], to_nm) - fmax(axis->edge_nm[i], from_nm);
        if (overlap <= 0 || axis->worth[i] <= 0)
            continue;
        bin->width += overlap;
        add_weight(axis, i, boxcar, overlap, bin);
    }
}

struct sums {
    double value, shot, read, dark, offset, calibration;
};

static struct sums sum_bin(const struct ocean_axis *axis, const struct pixels *p,
                           const struct bin *bin)
{
    struct sums s = {0};
    for (int i = bin->first; i <= bin->last; i++) {
        double w = bin->weight[i] / bin->width;
        s.value += w * p->value[i];
        s.shot += w * p->shot[i] * w * p->shot[i];
        s.read += w * p->read[i] * w * p->read[i];
        s.dark += w * p->dark[i] * w * p->dark[i];
        s.offset += w * p->offset[i];
        s.calibration += w * p->value[i] * axis->worth_sigma[i];
    }
    return s;
}

void ocean_irradiance(const struct ocean_unit *unit, const struct ocean_axis *axis,
                      const struct ocean_process *process, const struct ocean_reading *reading,
                      struct spectrum *irradiance, struct spectrum *sigma,
                      struct ocean_sigma *parts)
{
    struct pixels p;
    struct bin bin;
    struct ocean_sigma own;
    parts = parts ? parts : &own;
    process_pixels(unit, axis, process, reading, &p);
    const double common = ocean_black_sigma(unit->model, reading->averaged);
    int start = axis->used.first;
    for (int b = 0; b < SPECTRUM_COUNT; b++) {
        weigh(axis, process->boxcar, SPECTRUM_FIRST_NM - 0.5 + b, &start, &bin);
        struct sums s = {0};
        if (bin.width >= 0.5)
            s = sum_bin(axis, &p, &bin);
        double offset = s.offset * common;
        irradiance->v[b] = s.value;
        parts->shot.v[b] = sqrt(s.shot);
        parts->read.v[b] = sqrt(s.read);
        parts->dark.v[b] = sqrt(s.dark + offset * offset);
        parts->calibration.v[b] = fabs(s.calibration);
        sigma->v[b] =
            sqrt(s.shot + s.read + s.dark + offset * offset + s.calibration * s.calibration);
    }
}
