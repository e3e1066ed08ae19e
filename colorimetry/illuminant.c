// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/illuminant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "colorimetry/tables/tables.h"

#define C2_M_K 1.4388e-2
#define DAYLIGHT_LEAST_K 4000.0
#define DAYLIGHT_MOST_K 25000.0
#define PLANCK_LEAST_K 100.0
#define PLANCK_MOST_K 1e6

static const char *const NAMES[] = {
    "A",      "D50",    "D55",    "D65",    "D75",    "E",       "FL1",      "FL2",    "FL3",
    "FL4",    "FL5",    "FL6",    "FL7",    "FL8",    "FL9",     "FL10",     "FL11",   "FL12",
    "FL3.15", "LED-B1", "LED-B2", "LED-B3", "LED-B4", "LED-B5",  "LED-BH1",  "LED-RGB1",
    "LED-V1", "LED-V2", NULL,
};

const char *const *illuminant_names(void)
{
    return NAMES;
}

static bool unknown(const char *name, struct error *err)
{
    char list[400] = "";
    size_t used = 0;
    for (const char *const *n = NAMES; *n && used < sizeof list; n++)
        used += (size_t)snprintf(list + used, sizeof list - used, "%s, ", *n);
    return fail(err, ERROR_CONFIG,
                "\"%.60s\" is no illuminant; there are %sD<kelvin>K (daylight), P<kelvin>K "
                "(Planck)",
                name, list);
}

// "D5500K": the number between the letters.
static bool kelvin_of(const char *name, double *kelvin)
{
    const char *end;
    return name[1] >= '0' && name[1] <= '9' && number_parse(name + 1, &end, kelvin) &&
           strcmp(end, "K") == 0;
}

// ISO/CIE 11664-2: A by its own formula.
static void illuminant_a(struct spectrum *out)
{
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double nm = SPECTRUM_FIRST_NM + i;
        out->v[i] = 100 * pow(560 / nm, 5) * expm1(1.435e7 / (2848 * 560)) /
                    expm1(1.435e7 / (2848 * nm));
    }
}

static double linear_5nm(const double *values, int i)
{
    int node = i / TABLE_STEP_NM;
    double t = (double)(i % TABLE_STEP_NM) / TABLE_STEP_NM;
    return t > 0 ? values[node] + t * (values[node + 1] - values[node]) : values[node];
}

// Daylight is linear between its samples by definition (ISO/CIE 11664-2).
static bool from_table(const struct illuminant_table *table, struct spectrum *out,
                       struct error *err)
{
    if (table->linear) {
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            out->v[i] = linear_5nm(table->values, i);
        return true;
    }
    double nm[DAYLIGHT_BASIS_COUNT];
    for (size_t i = 0; i < table->count; i++)
        nm[i] = table->first_nm + TABLE_STEP_NM * (double)i;
    return spectrum_from_samples(nm, table->values, table->count, false, out, err);
}

static bool by_temperature(const char *name, struct spectrum *out, struct error *err)
{
    double kelvin;
    if ((name[0] != 'D' && name[0] != 'P') || !kelvin_of(name, &kelvin))
        return unknown(name, err);
    if (name[0] == 'D')
        return daylight(kelvin, out, err);
    if (kelvin < PLANCK_LEAST_K || kelvin > PLANCK_MOST_K)
        return fail(err, ERROR_RANGE, "Planck temperature %g K is outside %g..%g K", kelvin,
                    PLANCK_LEAST_K, PLANCK_MOST_K);
    planck(kelvin, out);
    return true;
}

bool illuminant(const char *name, struct spectrum *out, struct error *err)
{
    for (size_t i = 0; i < ILLUMINANT_TABLE_COUNT; i++)
        if (strcmp(name, ILLUMINANT_TABLES[i].name) == 0)
            return from_table(&ILLUMINANT_TABLES[i], out, err);
    if (strcmp(name, "A") == 0) {
        illuminant_a(out);
        return true;
    }
    if (strcmp(name, "E") == 0) {
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            out->v[i] = 100;
        return true;
    }
    return by_temperature(name, out, err);
}

static double to_three_decimals(double value)
{
    return round(value * 1000) / 1000;
}

bool daylight(double kelvin, struct spectrum *out, struct error *err)
{
    if (!(kelvin >= DAYLIGHT_LEAST_K && kelvin <= DAYLIGHT_MOST_K))
        return fail(err, ERROR_RANGE, "daylight of %g K is outside %g..%g K", kelvin,
                    DAYLIGHT_LEAST_K, DAYLIGHT_MOST_K);
    double t = kelvin * DAYLIGHT_SCALE, t2 = t * t, t3 = t2 * t;
    double x = t <= 7000 ? -4.6070e9 / t3 + 2.9678e6 / t2 + 0.09911e3 / t + 0.244063
                         : -2.0064e9 / t3 + 1.9018e6 / t2 + 0.24748e3 / t + 0.237040;
    double y = -3 * x * x + 2.87 * x - 0.275;
    double m = 0.0241 + 0.2562 * x - 0.7341 * y;
    double m1 = to_three_decimals((-1.3515 - 1.7703 * x + 5.9114 * y) / m);
    double m2 = to_three_decimals((0.0300 - 31.4424 * x + 30.0717 * y) / m);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = linear_5nm(DAYLIGHT_BASIS[0], i) + m1 * linear_5nm(DAYLIGHT_BASIS[1], i) +
                    m2 * linear_5nm(DAYLIGHT_BASIS[2], i);
    return true;
}

void planck(double kelvin, struct spectrum *out)
{
    double a = C2_M_K / (560e-9 * kelvin);
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double nm = SPECTRUM_FIRST_NM + i, b = a * 560 / nm;
        // expm1(a) / expm1(b) without overflow at low temperatures
        out->v[i] = pow(560 / nm, 5) * exp(a - b) * expm1(-a) / expm1(-b);
    }
}
