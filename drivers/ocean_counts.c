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
    MAYA_UNSET = 32768,
    SLOT_STRAY = 5,
};

static const double most_stray = 0.1; // beyond it no instrument would be sold

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

bool ocean_nonlinearity_valid(const double *c, int order, double most)
{
    if (order < 0 || order > 7)
        return false;
    for (int i = 0; i <= order; i++)
        if (!isfinite(c[i]))
            return false;
    for (double counts = 0; counts <= most; counts += most / 1024) {
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
    if (ocean_nonlinearity_valid(out->nonlinearity, (int)order, out->model->full_counts))
        out->order = (int)order;
}

double ocean_bend(const struct ocean_unit *unit, double counts)
{
    const double most = unit->model->full_counts;
    return unit->order < 0
               ? 1
               : polynomial(unit->nonlinearity, unit->order, fmin(fmax(counts, 0), most));
}

double ocean_wavelength(const struct ocean_unit *unit, double pixel)
{
    return polynomial(unit->wavelength, 3, pixel);
}

static bool wavelengths_valid(const struct ocean_model *model, const double c[4])
{
    double before = polynomial(c, 3, -0.5);
    for (int i = 0; i < model->pixels; i++) {
        double edge = polynomial(c, 3, i + 0.5);
        if (!(edge > before))
            return false;
        before = edge;
    }
    return polynomial(c, 3, model->active.first) < 700 && before > 400 && before < 3000;
}

bool ocean_unit_rewave(struct ocean_unit *unit, const double wavelength[4])
{
    if (!wavelengths_valid(unit->model, wavelength))
        return false;
    memcpy(unit->wavelength, wavelength, sizeof unit->wavelength);
    return true;
}

static double saturation_of(const struct ocean_model *model, const uint8_t *data)
{
    double level = 0;
    switch (model->saturation) {
    case OCEAN_SATURATION_FIXED:
        break;
    case OCEAN_SATURATION_AT_4:
        level = data[4] | data[5] << 8;
        break;
    case OCEAN_SATURATION_AT_0:
        level = data[0] | data[1] << 8;
        level = level <= MAYA_UNSET ? 0 : level;
        break;
    }
    return level > 0 ? level : model->full_counts;
}

static bool parse_wavelengths(const uint8_t replies[OCEAN_SLOTS][OCEAN_SLOT_BYTES],
                              struct ocean_unit *out, struct error *err)
{
    double *c = out->wavelength;
    for (int i = 0; i < 4; i++)
        if (!slot_number(replies[SLOT_WAVELENGTH + i], &c[i]))
            return fail(err, ERROR_DATA, "%s: information slot %d holds no wavelength coefficient",
                        out->serial, SLOT_WAVELENGTH + i);
    return wavelengths_valid(out->model, c) ||
           fail(err, ERROR_DATA, "%s: wavelengths do not ascend through the visible: %g %g %g %g",
                out->serial, c[0], c[1], c[2], c[3]);
}

bool ocean_unit_parse(const struct ocean_model *model,
                      const uint8_t replies[OCEAN_SLOTS][OCEAN_SLOT_BYTES], struct ocean_unit *out,
                      struct error *err)
{
    struct ocean_unit unit = {.model = model};
    for (int slot = 0; slot < OCEAN_SLOTS; slot++)
        if (replies[slot][0] != QUERY_SLOT || replies[slot][1] != slot)
            return fail(err, ERROR_DATA, "information slot %d answered as %02x %02x", slot,
                        replies[slot][0], replies[slot][1]);
    slot_text(replies[SLOT_SERIAL], unit.serial);
    for (const char *c = unit.serial; *c || c == unit.serial; c++)
        if (*c <= ' ' || *c > '~')
            return fail(err, ERROR_DATA, "information slot 0 holds no serial number");
    if (!parse_wavelengths(replies, &unit, err))
        return false;
    parse_nonlinearity(replies, &unit);
    if (!slot_number(replies[SLOT_STRAY], &unit.stray) ||
        !(unit.stray >= 0 && unit.stray <= most_stray))
        unit.stray = 0;
    unit.saturation = saturation_of(model, replies[SLOT_SATURATION] + 2);
    memcpy(unit.own_wavelength, unit.wavelength, sizeof unit.own_wavelength);
    *out = unit;
    return true;
}

struct detector ocean_detector(const struct ocean_unit *unit)
{
    const struct ocean_model *m = unit->model;
    struct detector d = {.pixels = m->pixels,
                         .active = m->active,
                         .saturation = unit->saturation,
                         .full_counts = m->full_counts,
                         .order = unit->order};
    memcpy(d.black, m->black, sizeof d.black);
    memcpy(d.nonlinearity, unit->nonlinearity, sizeof d.nonlinearity);
    memcpy(d.wavelength, unit->wavelength, sizeof d.wavelength);
    memcpy(d.own_wavelength, unit->own_wavelength, sizeof d.own_wavelength);
    return d;
}

void ocean_reading_add(const struct ocean_unit *unit, struct pixel_range used,
                       const uint16_t raw[OCEAN_PIXELS_MOST], struct ocean_reading *reading)
{
    int saturated = 0;
    for (int i = 0; i < unit->model->pixels; i++)
        reading->raw[i] += raw[i];
    for (int i = used.first; i <= used.last; i++) {
        double part = raw[i] / unit->saturation;
        saturated += part >= 1;
        reading->peak = fmax(reading->peak, fmin(part, 1));
    }
    if (saturated > reading->saturated)
        reading->saturated = saturated;
    reading->averaged++;
}

static int black_pixels(const struct ocean_model *model)
{
    int count = 0;
    for (int r = 0; r < OCEAN_DARK_RANGES; r++)
        count += model->black[r].last - model->black[r].first + 1;
    return count;
}

double ocean_black_mean(const struct ocean_model *model, const double raw[OCEAN_PIXELS_MOST])
{
    double sum = 0;
    for (int r = 0; r < OCEAN_DARK_RANGES; r++)
        for (int i = model->black[r].first; i <= model->black[r].last; i++)
            sum += raw[i];
    return sum / black_pixels(model);
}

double ocean_black(const struct ocean_unit *unit, const struct ocean_reading *reading)
{
    return ocean_black_mean(unit->model, reading->raw) / reading->averaged;
}

double ocean_black_sigma(const struct ocean_model *model, int averaged)
{
    return model->read_noise / sqrt((double)black_pixels(model) * averaged);
}

double ocean_signal(const struct ocean_unit *unit, struct pixel_range used,
                    const struct ocean_reading *reading)
{
    double most = 0, black = ocean_black(unit, reading);
    for (int i = used.first; i <= used.last; i++)
        most = fmax(most, reading->raw[i] / reading->averaged - black);
    return most * unit->model->full_counts / unit->saturation;
}
