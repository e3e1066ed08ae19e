// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_detector.h"

#include <math.h>
#include <stdlib.h>

#define FULL_SCALE 65535.0      // of the axis that the constants below are on
#define WELL_ELECTRONS 160000.0 // at full scale
#define READ_NOISE 50.0         // scaled counts rms
#define LINE_FWHM_NM 1.5
#define STRAY 2e-4              // of the mean light, on every active pixel
#define BASELINE_RAW 600.0
#define WARM_UP_RAW 6.0         // the baseline sinks by this much
#define WARM_UP_S 600.0
#define WANDER_RAW 0.5
#define DARK_PER_S 8.0          // scaled counts
#define HOT_PIXELS 6
#define PATTERN_RAW 1.5

enum { BINS = 10, INVERSE_STEPS = 4096 };
#define INVERSE_END 98304.0 // light well beyond saturation

struct pixel {
    int first;          // index into the spectrum
    double weight[BINS]; // W m-2 nm-1 in a 1 nm bin -> counts per second
    double dark;        // counts per second
    double pattern;     // raw
    double lit;         // part of the light it gets
    double restless;    // times the read noise
};

struct detector_model {
    struct detector_options options;
    enum detector_kind_of_pixel kinds[MODEL_PIXELS_MOST];
    struct pixel pixels[MODEL_PIXELS_MOST];
    int count;
    double unit; // counts per count of the axis to FULL_SCALE
    double measured_of_light[INVERSE_STEPS + 2];
    double wander_phase;
};

double detector_calibration(double nm)
{
    double glass = 1 / (1 + exp(-(nm - 370) / 12));
    double silicon = exp(-pow((nm - 540) / 230, 2));
    double etalon = 1 + 0.03 * sin(nm * (2 * M_PI / 47));
    return 1e-7 / (glass * silicon * etalon);
}

static double polynomial(const double *c, int count, double x)
{
    double y = 0;
    for (int i = count - 1; i >= 0; i--)
        y = y * x + c[i];
    return y;
}

static double normal_cdf(double x)
{
    return 0.5 * erfc(-x * M_SQRT1_2);
}

static void set_weights(const struct detector_model *d, double p, struct pixel *pixel)
{
    const double *c = d->options.wavelength;
    double nm = polynomial(c, 4, p);
    double width = c[1] + p * (2 * c[2] + p * 3 * c[3]);
    double gain = d->unit * d->options.collector_mm2 * width / detector_calibration(nm);
    double sigma = LINE_FWHM_NM / 2.354820045;
    int first = (int)lround(nm) - BINS / 2;
    pixel->first = first - SPECTRUM_FIRST_NM;
    for (int i = 0; i < BINS; i++) {
        double low = (first + i - 0.5 - nm) / sigma;
        double high = (first + i + 0.5 - nm) / sigma;
        pixel->weight[i] = gain * (normal_cdf(high) - normal_cdf(low));
    }
}

static void set_inverse(struct detector_model *d)
{
    const double *c = d->options.nonlinearity;
    for (int i = 0; i < INVERSE_STEPS + 2; i++) {
        double light = d->unit * INVERSE_END * i / INVERSE_STEPS;
        double low = 0, high = 2 * d->unit * INVERSE_END;
        for (int step = 0; step < 60; step++) {
            double middle = (low + high) / 2;
            if (middle < light * polynomial(c, 8, fmin(middle, d->options.full)))
                low = middle;
            else
                high = middle;
        }
        d->measured_of_light[i] = low;
    }
}

static double measured(const struct detector_model *d, double light)
{
    double end = d->unit * INVERSE_END;
    double at = fmin(fmax(light, 0), end) * (INVERSE_STEPS / end);
    int i = (int)at;
    const double *t = d->measured_of_light;
    double m = t[i] + (at - i) * (t[i + 1] - t[i]);
    return light < 0 ? light * d->options.nonlinearity[0] : m;
}

// Partly covered pixels get from 0.3 to 0.7 of the light.
static void set_pixel(struct detector_model *d, int p, const struct detector_zone *zone, int first,
                      struct noise *noise)
{
    struct pixel *pixel = &d->pixels[p];
    d->kinds[p] = zone->kind;
    pixel->restless = zone->kind == DETECTOR_UNUSABLE ? 8 : 1;
    if (zone->kind != DETECTOR_ACTIVE && zone->kind != DETECTOR_TRANSITION)
        return;
    double across = zone->last > first ? (double)(p - first) / (zone->last - first) : 0;
    pixel->lit = zone->kind == DETECTOR_ACTIVE ? 1 : 0.3 + 0.4 * across;
    set_weights(d, p, pixel);
    pixel->dark = d->unit * DARK_PER_S * (0.5 + noise_even(noise));
    pixel->pattern = PATTERN_RAW * noise_normal(noise);
}

static void set_pixels(struct detector_model *d, struct noise *noise)
{
    int active_first = 0, active_count = 0;
    for (const struct detector_zone *z = d->options.zones; z->kind; z++) {
        int first = d->count;
        for (; d->count <= z->last; d->count++)
            set_pixel(d, d->count, z, first, noise);
        if (z->kind == DETECTOR_ACTIVE) {
            active_first = first;
            active_count = d->count - first;
        }
    }
    for (int i = 0; i < HOT_PIXELS; i++) {
        int p = active_first + (int)(noise_bits(noise) % (uint64_t)active_count);
        d->pixels[p].dark += d->unit * (300 + 1500 * noise_even(noise));
    }
}

struct detector_model *detector_create(const struct detector_options *options)
{
    struct detector_model *d = calloc(1, sizeof(*d));
    if (!d)
        return NULL;
    d->options = *options;
    d->unit = options->full / FULL_SCALE;
    struct noise noise;
    noise_init(&noise, options->seed, 'd');
    set_pixels(d, &noise);
    d->wander_phase = 2 * M_PI * noise_even(&noise);
    set_inverse(d);
    return d;
}

void detector_destroy(struct detector_model *detector)
{
    free(detector);
}

static double light_of(const struct pixel *pixel, const struct spectrum *irradiance)
{
    double sum = 0;
    for (int i = 0; i < BINS; i++) {
        int at = pixel->first + i;
        if (at >= 0 && at < SPECTRUM_COUNT)
            sum += pixel->weight[i] * irradiance->v[at];
    }
    return sum;
}

static double baseline(const struct detector_model *d, double age_s)
{
    return BASELINE_RAW + WARM_UP_RAW * exp(-age_s / WARM_UP_S) +
           WANDER_RAW * sin(age_s / 97 + d->wander_phase);
}

static uint16_t converted(const struct detector_model *d, double raw)
{
    return (uint16_t)fmin(fmax(lround(raw), 0), d->options.saturation);
}

// The counts that light has made of one pixel, before reading.
static double exposed(const struct detector_model *d, const struct pixel *pixel, double light,
                      double exposure_s, struct noise *noise)
{
    double counts = light + pixel->dark * exposure_s;
    counts += noise_normal(noise) * sqrt(counts * (d->options.full / WELL_ELECTRONS));
    return measured(d, counts);
}

void detector_expose(const struct detector_model *d, const struct spectrum *irradiance,
                     double exposure_s, double age_s, struct noise *noise, uint16_t *raw)
{
    double light[MODEL_PIXELS_MOST] = {0}, mean = 0;
    for (int p = 0; p < d->count; p++) {
        if (d->pixels[p].lit > 0)
            light[p] = exposure_s * light_of(&d->pixels[p], irradiance);
        mean += light[p] / d->count;
    }
    double raw_per_count = d->options.saturation / d->options.full;
    double zero = baseline(d, age_s);
    for (int p = 0; p < d->count; p++) {
        const struct pixel *pixel = &d->pixels[p];
        double counts = 0;
        if (pixel->lit > 0)
            counts = exposed(d, pixel, pixel->lit * light[p] + STRAY * mean, exposure_s, noise);
        counts += d->unit * READ_NOISE * pixel->restless * noise_normal(noise);
        raw[p] = d->kinds[p] == DETECTOR_FILLER
                     ? 0
                     : converted(d, zero + pixel->pattern + counts * raw_per_count);
    }
}
