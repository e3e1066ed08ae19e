// SPDX-License-Identifier: Apache-2.0
#include "simulator/sensor.h"

#include <math.h>
#include <stdlib.h>

static const double HOT_LEAST = 100, HOT_MOST = 2000;

double sensor_response(enum sensor_response response, double share)
{
    double x = fmin(fmax(share, 0), 1), p = 0;
    switch (response) {
    case RESPONSE_LINEAR:
        return x;
    case RESPONSE_FILM:
        p = pow(x, 0.6);
        return 1.8 * p / (p + 0.8);
    }
    return x;
}

bool sensor_init(struct sensor *sensor, const struct scenario_ceiling_camera *settings, int seed,
                 struct error *err)
{
    size_t count = (size_t)settings->width_px * (size_t)settings->height_px;
    struct chance chance = chance_start((uint64_t)seed, "hot pixels", 0);
    *sensor = (struct sensor){settings, malloc(count * sizeof *sensor->dark_e_s)};
    if (!sensor->dark_e_s)
        return fail(err, ERROR_SYSTEM, "no memory for a sensor of %zu pixels", count);
    for (size_t i = 0; i < count; i++) {
        bool hot = chance_uniform(&chance) < settings->hot_share;
        double more = hot ? HOT_LEAST + (HOT_MOST - HOT_LEAST) * chance_uniform(&chance) : 1;
        sensor->dark_e_s[i] = settings->dark_e_s * more;
    }
    return true;
}

void sensor_fini(struct sensor *sensor)
{
    free(sensor->dark_e_s);
    *sensor = (struct sensor){0};
}

// Counts of a well's share in steps so fine that none is passed over.
enum { STEPS = 1 << 16 };

static uint16_t *response_table(const struct scenario_ceiling_camera *s)
{
    double most = s->bits == 8 ? 255 : 65535;
    uint16_t *table = malloc((STEPS + 1) * sizeof *table);
    for (int i = 0; table && i <= STEPS; i++)
        table[i] = (uint16_t)lround(
            most * sensor_response((enum sensor_response)s->response, (double)i / STEPS));
    return table;
}

bool sensor_expose(const struct sensor *sensor, const double *light, int channels,
                   double exposure_s, struct chance *chance, struct picture *out, struct error *err)
{
    const struct scenario_ceiling_camera *s = sensor->settings;
    size_t count = (size_t)s->width_px * (size_t)s->height_px;
    uint16_t *table = response_table(s);
    if (!table)
        return fail(err, ERROR_SYSTEM, "out of memory");
    if (!picture_init(out, s->width_px, s->height_px, channels, s->bits, err)) {
        free(table);
        return false;
    }
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < channels; c++) {
            double l = light ? light[(size_t)c * count + i] : 0;
            double e = exposure_s * (s->sensitivity * l + sensor->dark_e_s[i]);
            e += sqrt(e + s->read_noise_e * s->read_noise_e) * chance_normal(chance);
            double share = fmin(fmax(e / s->full_well_e, 0), 1);
            out->samples[i * (size_t)channels + (size_t)c] = table[(int)(share * STEPS + 0.5)];
        }
    free(table);
    return true;
}
