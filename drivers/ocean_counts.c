// SPDX-License-Identifier: Apache-2.0
#include "drivers/ocean_counts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    QUERY_SLOT = 0x05,
    SLOT_SERIAL = 0,
    SLOT_WAVELENGTH = 1,
    SLOT_NONLINEARITY = 6,
    SLOT_ORDER = 14,
    SLOT_SATURATION = 17,
    SATURATION_OFFSET = 6,
    SYNC = 0x69,
    MANY_SATURATED = 200,
};

static const double full_scale = 65535;
static const double well_electrons = 160000;
static const double read_noise = 50; // scaled counts RMS
static const double aim = 0.85, lowest = 0.78, highest = 0.92;
static const double upward = 0.88; // below highest by more than noise: no hunting between two steps

// The text may fill all 15 bytes without a NUL, and junk follows a NUL.
static void slot_text(const uint8_t reply[OCEAN_SLOT_BYTES], char text[16])
{
    memcpy(text, reply + 2, 15);
    text[15] = 0;
    size_t length = strlen(text);
    while (length && (text[length - 1] == ' ' || text[length - 1] == '\r'))
        text[--length] = 0;
}

static bool slot_number(const uint8_t reply[OCEAN_SLOT_BYTES], double *value)
{
    char text[16], *end;
    slot_text(reply, text);
    *value = strtod(text, &end);
    return end != text && isfinite(*value);
}

static double polynomial(const double *c, int order, double x)
{
    double y = 0;
    for (int i = order; i >= 0; i--)
        y = y * x + c[i];
    return y;
}

bool ocean_nonlinearity_valid(const double *c, int order)
{
    if (order < 0 || order > 7)
        return false;
    for (int i = 0; i <= order; i++)
        if (!isfinite(c[i]))
            return false;
    for (double counts = 0; counts <= full_scale; counts += full_scale / 1024) {
        double y = polynomial(c, order, counts);
        if (!(y > 0.5 && y < 1.5))
            return false;
    }
    return true;
}

static void parse_nonlinearity(const uint8_t replies[OCEAN_SLOTS][OCEAN_SLOT_BYTES],
                               struct ocean_unit *out)
{
    double order;
    out->order = -1;
    memset(out->nonlinearity, 0, sizeof out->nonlinearity);
    if (!slot_number(replies[SLOT_ORDER], &order) || order < 0 || order > 7 || order != rint(order))
        return;
    for (int i = 0; i <= (int)order; i++)
        if (!slot_number(replies[SLOT_NONLINEARITY + i], &out->nonlinearity[i]))
            return;
    if (ocean_nonlinearity_valid(out->nonlinearity, (int)order))
        out->order = (int)order;
}

static bool wavelengths_valid(const double c[4])
{
    double before = polynomial(c, 3, -0.5);
    for (int i = 0; i < OCEAN_PIXELS; i++) {
        double edge = polynomial(c, 3, i + 0.5);
        if (!(edge > before))
            return false;
        before = edge;
    }
    return polynomial(c, 3, OCEAN_ACTIVE_FIRST) < 700 && before > 400 && before < 3000;
}

bool ocean_unit_parse(const uint8_t replies[OCEAN_SLOTS][OCEAN_SLOT_BYTES], struct ocean_unit *out,
                      struct error *err)
{
    struct ocean_unit unit = {0};
    for (int slot = 0; slot < OCEAN_SLOTS; slot++)
        if (replies[slot][0] != QUERY_SLOT || replies[slot][1] != slot)
            return fail(err, ERROR_DATA, "information slot %d answered as %02x %02x", slot,
                        replies[slot][0], replies[slot][1]);
    slot_text(replies[SLOT_SERIAL], unit.serial);
    for (const char *c = unit.serial; *c || c == unit.serial; c++)
        if (*c <= ' ' || *c > '~')
            return fail(err, ERROR_DATA, "information slot 0 holds no serial number");
    for (int i = 0; i < 4; i++)
        if (!slot_number(replies[SLOT_WAVELENGTH + i], &unit.wavelength[i]))
            return fail(err, ERROR_DATA, "%s: information slot %d holds no wavelength coefficient",
                        unit.serial, SLOT_WAVELENGTH + i);
    if (!wavelengths_valid(unit.wavelength))
        return fail(err, ERROR_DATA,
                    "%s: wavelengths do not ascend through the visible: %g %g %g %g", unit.serial,
                    unit.wavelength[0], unit.wavelength[1], unit.wavelength[2], unit.wavelength[3]);
    parse_nonlinearity(replies, &unit);
    const uint8_t *level = replies[SLOT_SATURATION] + SATURATION_OFFSET;
    unit.saturation = level[0] | level[1] << 8;
    if (unit.saturation == 0)
        unit.saturation = full_scale;
    *out = unit;
    return true;
}

bool ocean_unpack(const uint8_t *bytes, size_t count, uint16_t raw[OCEAN_PIXELS], struct error *err)
{
    if (count != OCEAN_SPECTRUM_BYTES)
        return fail(err, ERROR_DATA, "spectrum of %zu bytes instead of %d", count,
                    OCEAN_SPECTRUM_BYTES);
    if (bytes[count - 1] != SYNC)
        return fail(err, ERROR_DATA, "spectrum ends with %02x instead of %02x", bytes[count - 1],
                    SYNC);
    for (int i = 0; i < OCEAN_PIXELS; i++)
        raw[i] = (uint16_t)(bytes[2 * i] | bytes[2 * i + 1] << 8);
    return true;
}

static bool check_calibration(const struct table *t, struct error *err)
{
    if (t->columns != 2 || t->rows < 2)
        return fail(err, ERROR_DATA, "%s: %zu columns and %zu rows instead of nm,uJ_per_count",
                    t->path, t->columns, t->rows);
    for (size_t row = 0; row < t->rows; row++) {
        double nm = table_at(t, row, 0), k = table_at(t, row, 1);
        int line = t->lines ? t->lines[row] : (int)row + 1;
        if (row && !(nm > table_at(t, row - 1, 0)))
            return fail(err, ERROR_DATA, "%s:%d: %g nm does not ascend", t->path, line, nm);
        if (!(k >= 0))
            return fail(err, ERROR_DATA, "%s:%d: %g uJ per count is negative", t->path, line, k);
    }
    return true;
}

static double calibration_at(const struct table *t, double nm)
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
    return (1 - f) * table_at(t, low, 1) + f * table_at(t, high, 1);
}

bool ocean_axis_make(const struct ocean_unit *unit, const struct table *calibration,
                     struct ocean_axis *out, struct error *err)
{
    if (!check_calibration(calibration, err))
        return false;
    struct ocean_axis axis = {.first = OCEAN_PIXELS, .last = -1};
    axis.edge_nm[0] = polynomial(unit->wavelength, 3, -0.5);
    for (int i = 0; i < OCEAN_PIXELS; i++) {
        axis.edge_nm[i + 1] = polynomial(unit->wavelength, 3, i + 0.5);
        axis.uj_per_count[i] = calibration_at(calibration, polynomial(unit->wavelength, 3, i));
        if (i < OCEAN_ACTIVE_FIRST || axis.uj_per_count[i] <= 0 ||
            axis.edge_nm[i + 1] <= SPECTRUM_FIRST_NM - 0.5 ||
            axis.edge_nm[i] >= SPECTRUM_LAST_NM + 0.5)
            continue;
        axis.last = i;
        if (axis.first > i)
            axis.first = i;
    }
    if (axis.last < axis.first)
        return fail(err, ERROR_DATA, "%s: calibrates no pixel of %s", calibration->path,
                    unit->serial);
    *out = axis;
    return true;
}

void ocean_reading_add(const struct ocean_unit *unit, const struct ocean_axis *axis,
                       const uint16_t raw[OCEAN_PIXELS], struct ocean_reading *reading)
{
    int saturated = 0;
    for (int i = 0; i < OCEAN_PIXELS; i++)
        reading->raw[i] += raw[i];
    for (int i = axis->first; i <= axis->last; i++) {
        double part = raw[i] / unit->saturation;
        saturated += part >= 1;
        reading->peak = fmax(reading->peak, fmin(part, 1));
    }
    if (saturated > reading->saturated)
        reading->saturated = saturated;
    reading->averaged++;
}

double ocean_dark(const struct ocean_reading *reading)
{
    double sum = 0;
    for (int i = OCEAN_DARK_FIRST; i <= OCEAN_DARK_LAST; i++)
        sum += reading->raw[i];
    return sum / (reading->averaged * (OCEAN_DARK_LAST - OCEAN_DARK_FIRST + 1));
}

static double scaled(const struct ocean_unit *unit, const struct ocean_reading *reading, int pixel,
                     double dark)
{
    return (reading->raw[pixel] / reading->averaged - dark) * (full_scale / unit->saturation);
}

double ocean_signal(const struct ocean_unit *unit, const struct ocean_axis *axis,
                    const struct ocean_reading *reading)
{
    double most = 0, dark = ocean_dark(reading);
    for (int i = axis->first; i <= axis->last; i++)
        most = fmax(most, scaled(unit, reading, i, dark));
    return most;
}

// Noise of one pixel's scaled count above dark, squared.
static double variance(double counts, int averaged)
{
    const double black = OCEAN_DARK_LAST - OCEAN_DARK_FIRST + 1;
    double shot = fmax(counts, 0) * (full_scale / well_electrons);
    return (shot + read_noise * read_noise * (1 + 1 / black)) / averaged;
}

struct bins {
    double width[SPECTRUM_COUNT], sum[SPECTRUM_COUNT], squares[SPECTRUM_COUNT];
};

static void spread(struct bins *bins, double from_nm, double to_nm, double value, double noise)
{
    const double start = SPECTRUM_FIRST_NM - 0.5;
    int first = (int)fmax(floor(from_nm - start), 0);
    int last = (int)fmin(floor(to_nm - start), SPECTRUM_COUNT - 1);
    for (int b = first; b <= last; b++) {
        double overlap = fmin(to_nm, start + b + 1) - fmax(from_nm, start + b);
        if (overlap <= 0)
            continue;
        bins->width[b] += overlap;
        bins->sum[b] += overlap * value;
        bins->squares[b] += overlap * noise * overlap * noise;
    }
}

void ocean_irradiance(const struct ocean_unit *unit, const struct ocean_axis *axis,
                      double collector_mm2, const struct ocean_reading *reading,
                      struct spectrum *irradiance, struct spectrum *sigma)
{
    struct bins bins = {0};
    double dark = ocean_dark(reading), seconds = reading->integration_us * 1e-6;
    for (int i = axis->first; i <= axis->last; i++) {
        double width = axis->edge_nm[i + 1] - axis->edge_nm[i];
        double per_count = axis->uj_per_count[i] / (collector_mm2 * seconds * width);
        double counts = scaled(unit, reading, i, dark), bend = 1;
        if (axis->uj_per_count[i] <= 0)
            continue;
        if (unit->order >= 0)
            bend = polynomial(unit->nonlinearity, unit->order, fmin(fmax(counts, 0), full_scale));
        spread(&bins, axis->edge_nm[i], axis->edge_nm[i + 1], per_count * counts / bend,
               per_count * sqrt(variance(counts, reading->averaged)) / bend);
    }
    for (int b = 0; b < SPECTRUM_COUNT; b++) {
        bool seen = bins.width[b] >= 0.5;
        irradiance->v[b] = seen ? bins.sum[b] / bins.width[b] : 0;
        sigma->v[b] = seen ? sqrt(bins.squares[b]) / bins.width[b] : 0;
    }
}

int ocean_round_exposure(double us, double mains_hz, int longest_us)
{
    const double half = 0.5e6 / mains_hz;
    us = fmin(fmax(us, OCEAN_LEAST_US), longest_us);
    if (us >= half)
        us = half * floor(us / half + 1e-6);
    double step = us > 655000 ? 1000 : 10;
    return (int)(rint(us / step) * step);
}

int ocean_next_exposure(int us, double peak, double dark, int saturated, double mains_hz,
                        int longest_us)
{
    if (saturated > 0)
        return ocean_round_exposure(us / (saturated > MANY_SATURATED ? 16.0 : 4.0), mains_hz,
                                    longest_us);
    if (peak >= lowest && peak <= highest && us <= longest_us)
        return us;
    double gain = peak > dark ? fmin((aim - dark) / (peak - dark), 8) : 8;
    int next = ocean_round_exposure(us * gain, mains_hz, longest_us);
    int more = ocean_round_exposure(next + 0.5e6 / mains_hz, mains_hz, longest_us);
    if (us * gain >= 0.5e6 / mains_hz && dark + (peak - dark) * more / us <= upward)
        next = more;
    return next;
}
