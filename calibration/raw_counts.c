// SPDX-License-Identifier: Apache-2.0
#include "calibration/raw_counts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "calibration/bench.h"
#include "drivers/vendor_files.h"
#include "drivers/wavelength_refit.h"
#include "files/text.h"
#include "files/write.h"

static const double CUBIC_NM = 0.1; // files round to 0.01 nm

static bool take_numbers(const json_t *reply, const char *key, double *out, int least, int most,
                         int *count, struct error *err)
{
    const json_t *values = json_object_get(reply, key);
    *count = (int)json_array_size(values);
    if (!json_is_array(values) || *count < least || *count > most)
        return fail(err, ERROR_DATA, "the reply has no %s of %d..%d numbers", key, least, most);
    for (int i = 0; i < *count; i++) {
        out[i] = json_number_value(json_array_get(values, (size_t)i));
        if (!isfinite(out[i]))
            return fail(err, ERROR_DATA, "%s: number %d is not finite", key, i + 1);
    }
    return true;
}

static bool take_range(const json_t *pair, int pixels, struct pixel_range *out, struct error *err)
{
    struct pixel_range r;
    if (json_unpack((json_t *)pair, "[i,i]", &r.first, &r.last) || r.first < 0 ||
        r.last < r.first || r.last >= pixels)
        return fail(err, ERROR_DATA, "the reply has no sound ranges of pixels");
    *out = r;
    return true;
}

static bool take_ranges(const json_t *reply, struct detector *d, struct error *err)
{
    const json_t *black = json_object_get(reply, "black");
    size_t count = json_array_size(black);
    for (int i = 0; i < DETECTOR_BLACK_RANGES; i++)
        d->black[i] = (struct pixel_range){0, -1};
    if (count < 1 || count > DETECTOR_BLACK_RANGES)
        return fail(err, ERROR_DATA, "the reply names no black pixels");
    for (size_t i = 0; i < count; i++)
        if (!take_range(json_array_get(black, i), d->pixels, &d->black[i], err))
            return false;
    return take_range(json_object_get(reply, "active"), d->pixels, &d->active, err);
}

static bool take_detector(const json_t *reply, struct detector *d, struct error *err)
{
    int count;
    if (!take_ranges(reply, d, err) ||
        !take_numbers(reply, "wavelength_nm", d->wavelength, 4, 4, &count, err) ||
        !take_numbers(reply, "own_wavelength_nm", d->own_wavelength, 4, 4, &count, err) ||
        !take_numbers(reply, "nonlinearity", d->nonlinearity, 0, DETECTOR_ORDER_MOST + 1, &count,
                      err))
        return false;
    d->order = count - 1;
    d->saturation = json_number_value(json_object_get(reply, "saturation"));
    d->full_counts = json_number_value(json_object_get(reply, "full_counts"));
    return (d->saturation > 0 && d->full_counts > 0) ||
           fail(err, ERROR_DATA, "the reply tells no saturation");
}

static bool take_counts(const json_t *reply, struct raw_counts *r, struct error *err)
{
    int count, n;
    if (!take_numbers(reply, "counts", r->mean, 1, DETECTOR_PIXELS_MOST, &r->detector.pixels, err))
        return false;
    count = r->detector.pixels;
    return take_numbers(reply, "deviation", r->deviation, count, count, &n, err) &&
           take_numbers(reply, "active_means", r->active, 1, RAW_READINGS_MOST, &r->readings,
                        err) &&
           take_numbers(reply, "black_means", r->black, r->readings, r->readings, &n, err);
}

bool raw_counts_of(const json_t *reply, struct raw_counts *out, struct error *err)
{
    const char *at = json_string_value(json_object_get(reply, "taken_at"));
    memset(out, 0, sizeof *out);
    bench_instrument(reply, out->instrument, sizeof out->instrument);
    snprintf(out->taken_at, sizeof out->taken_at, "%s", at ? at : "");
    out->emulated = json_is_true(json_object_get(reply, "emulated"));
    out->integration_us = (int)json_integer_value(json_object_get(reply, "integration_us"));
    out->saturated = (int)json_integer_value(json_object_get(reply, "saturated"));
    if (out->integration_us <= 0)
        return fail(err, ERROR_DATA, "the reply tells no exposure");
    return take_counts(reply, out, err) && take_detector(reply, &out->detector, err);
}

struct ocean_unit raw_unit(const struct raw_counts *raw, struct ocean_model *model)
{
    const struct detector *d = &raw->detector;
    *model = (struct ocean_model){
        .pixels = d->pixels, .active = d->active, .full_counts = d->full_counts};
    memcpy(model->black, d->black, sizeof model->black);
    struct ocean_unit unit = {.model = model, .order = d->order, .saturation = d->saturation};
    snprintf(unit.serial, sizeof unit.serial, "%.15s", raw->instrument);
    memcpy(unit.nonlinearity, d->nonlinearity, sizeof unit.nonlinearity);
    memcpy(unit.wavelength, d->wavelength, sizeof unit.wavelength);
    memcpy(unit.own_wavelength, d->own_wavelength, sizeof unit.own_wavelength);
    return unit;
}

double raw_black(const struct raw_counts *raw)
{
    double sum = 0;
    for (int i = 0; i < raw->readings; i++)
        sum += raw->black[i];
    return sum / raw->readings;
}

static int black_pixels(const struct detector *d)
{
    int count = 0;
    for (int r = 0; r < DETECTOR_BLACK_RANGES; r++)
        count += d->black[r].last - d->black[r].first + 1;
    return count;
}

double raw_noise(const struct raw_counts *raw)
{
    const struct detector *d = &raw->detector;
    double squares = 0;
    for (int r = 0; r < DETECTOR_BLACK_RANGES; r++)
        for (int i = d->black[r].first; i <= d->black[r].last; i++)
            squares += raw->deviation[i] * raw->deviation[i];
    return sqrt(squares / black_pixels(d));
}

double raw_black_sigma(const struct raw_counts *raw, int readings)
{
    return raw_noise(raw) / sqrt((double)black_pixels(&raw->detector) * readings);
}

bool raw_join(struct raw_counts *raw, const struct raw_counts *more, struct error *err)
{
    int n = raw->readings, m = more->readings, all = n + m;
    if (more->integration_us != raw->integration_us || all > RAW_READINGS_MOST ||
        more->detector.pixels != raw->detector.pixels)
        return fail(err, ERROR_RANGE, "%d readings of %d us and %d of %d us are no series", n,
                    raw->integration_us, m, more->integration_us);
    for (int i = 0; i < raw->detector.pixels; i++) {
        double off = more->mean[i] - raw->mean[i], a = raw->deviation[i], b = more->deviation[i];
        double squares = (n - 1) * a * a + (m - 1) * b * b + off * off * n * m / all;
        raw->mean[i] += off * m / all;
        raw->deviation[i] = sqrt(squares / (all - 1));
    }
    memcpy(raw->active + n, more->active, sizeof *raw->active * (size_t)m);
    memcpy(raw->black + n, more->black, sizeof *raw->black * (size_t)m);
    raw->saturated = more->saturated > raw->saturated ? more->saturated : raw->saturated;
    raw->readings = all;
    return true;
}

// ---- files -----------------------------------------------------------------

bool raw_save(const char *path, const struct raw_counts *light, const struct raw_counts *dark,
              struct error *err)
{
    const struct detector *d = &light->detector;
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    fprintf(file.stream, "# raw counts of %s%s, %s\n# %d readings of %d us, saturated at %g\n",
            light->instrument, light->emulated ? " (emulated)" : "", light->taken_at,
            light->readings, light->integration_us, d->saturation);
    fprintf(file.stream, "pixel,nm,counts,deviation%s\n", dark ? ",dark" : "");
    for (int i = 0; i < d->pixels; i++) {
        fprintf(file.stream, "%d,%.6f,%.9g,%.6g", i, refit_nm(d->wavelength, i), light->mean[i],
                light->deviation[i]);
        if (dark)
            fprintf(file.stream, ",%.9g", dark->mean[i]);
        fputc('\n', file.stream);
    }
    return whole_file_commit(&file, err);
}

static bool take_axis(const char *path, const double *nm, size_t count, struct raw_spectrum *out,
                      struct error *err)
{
    double worst;
    if (count > DETECTOR_PIXELS_MOST)
        return fail(err, ERROR_DATA, "%s: %zu rows; allowed: %d", path, count,
                    DETECTOR_PIXELS_MOST);
    out->pixels = (int)count;
    snprintf(out->source, sizeof out->source, "%s", path);
    if (!refit_axis(nm, out->pixels, out->wavelength, &worst, err))
        return while_doing(err, "%s", path);
    return worst <= CUBIC_NM ||
           fail(err, ERROR_DATA, "%s: the wavelengths are no cubic of the pixel: %.2f nm off", path,
                worst);
}

static bool load_jaz(const char *path, struct raw_spectrum *out, struct error *err)
{
    struct vendor_file file;
    if (!vendor_file_load(path, &file, err))
        return false;
    bool fine = (file.sample || fail(err, ERROR_DATA, "%s: holds no raw counts", path)) &&
                take_axis(path, file.nm, file.count, out, err);
    for (int i = 0; fine && i < out->pixels; i++)
        out->counts[i] = file.sample[i] - file.dark[i];
    vendor_file_fini(&file);
    return fine;
}

static bool take_table(const struct table *t, struct raw_spectrum *out, struct error *err)
{
    double nm[DETECTOR_PIXELS_MOST + 1];
    int place = table_column(t, "nm"), counts = table_column(t, "counts");
    int dark = table_column(t, "dark");
    if (place < 0 || counts < 0)
        return fail(err, ERROR_DATA, "%s: has no columns nm and counts", t->path);
    for (size_t i = 0; i < t->rows && i <= DETECTOR_PIXELS_MOST; i++)
        nm[i] = table_at(t, i, (size_t)place);
    if (!take_axis(t->path, nm, t->rows, out, err))
        return false;
    for (int i = 0; i < out->pixels; i++)
        out->counts[i] = table_at(t, (size_t)i, (size_t)counts) -
                         (dark < 0 ? 0 : table_at(t, (size_t)i, (size_t)dark));
    return true;
}

bool raw_spectrum_load(const char *path, struct raw_spectrum *out, struct error *err)
{
    struct table table = {0};
    memset(out, 0, sizeof *out);
    if (text_ends_with(path, ".jaz"))
        return load_jaz(path, out, err);
    bool fine = csv_load(path, &table, err) && take_table(&table, out, err);
    table_fini(&table);
    return fine;
}

void raw_spectrum_of(const struct raw_counts *light, const struct raw_counts *dark,
                     struct raw_spectrum *out)
{
    const struct detector *d = &light->detector;
    memset(out, 0, sizeof *out);
    snprintf(out->source, sizeof out->source, "%s", light->instrument);
    out->pixels = d->pixels;
    memcpy(out->wavelength, d->wavelength, sizeof out->wavelength);
    double black = raw_black(light), then = dark ? raw_black(dark) : 0;
    for (int i = d->active.first; i <= d->active.last; i++)
        out->counts[i] = light->mean[i] - (dark ? dark->mean[i] + black - then : black);
}
