// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_detector.h"

#include <math.h>
#include <stdlib.h>

#define FULL_SCALE 65535.0      // of the scaled axis
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
};

struct detector {
    struct detector_options options;
    struct pixel pixels[DETECTOR_PIXELS];
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

static void set_weights(const struct detector *d, double p, struct pixel *pixel)
{
    const double *c = d->options.wavelength;
    double nm = polynomial(c, 4, p);
    double width = c[1] + p * (2 * c[2] + p * 3 * c[3]);
    double gain = d->options.collector_mm2 * width / detector_calibration(nm);
    double sigma = LINE_FWHM_NM / 2.354820045;
    int first = (int)lround(nm) - BINS / 2;
    pixel->first = first - SPECTRUM_FIRST_NM;
    for (int i = 0; i < BINS; i++) {
        double low = (first + i - 0.5 - nm) / sigma;
        double high = (first + i + 0.5 - nm) / sigma;
        pixel->weight[i] = gain * (normal_cdf(high) - normal_cdf(low));
    }
}

static void set_inverse(struct detector *d)
{
    const double *c = d->options.nonlinearity;
    for (int i = 0; i < INVERSE_STEPS + 2; i++) {
        double light = INVERSE_END * i / INVERSE_STEPS;
        double low = 0, high = 2 * INVERSE_END;
        for (int step = 0; step < 60; step++) {
            double middle = (low + high) / 2;
            if (middle < light * polynomial(c, 8, fmin(middle, FULL_SCALE)))
                low = middle;
            else
                high = middle;
        }
        d->measured_of_light[i] = low;
    }
}

static double measured(const struct detector *d, double light)
{
    double at = fmin(fmax(light, 0), INVERSE_END) * (INVERSE_STEPS / INVERSE_END);
    int i = (int)at;
    const double *t = d->measured_of_light;
    double m = t[i] + (at - i) * (t[i + 1] - t[i]);
    return light < 0 ? light * d->options.nonlinearity[0] : m;
}

struct detector *detector_create(const struct detector_options *options)
{
    struct detector *d = calloc(1, sizeof(*d));
    if (!d)
        return NULL;
    d->options = *options;
    struct noise noise;
    noise_init(&noise, options->seed, 'd');
    for (int p = DETECTOR_FIRST_TRANSITION; p < DETECTOR_PIXELS; p++) {
        struct pixel *pixel = &d->pixels[p];
        set_weights(d, p, pixel);
        pixel->dark = DARK_PER_S * (0.5 + noise_even(&noise));
        pixel->pattern = PATTERN_RAW * noise_normal(&noise);
    }
    for (int i = 0; i < HOT_PIXELS; i++) {
        int p = DETECTOR_FIRST_ACTIVE + (int)(noise_bits(&noise) % 2000);
        d->pixels[p].dark += 300 + 1500 * noise_even(&noise);
    }
    d->wander_phase = 2 * M_PI * noise_even(&noise);
    set_inverse(d);
    return d;
}

void detector_destroy(struct detector *detector)
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

static double baseline(const struct detector *d, double age_s)
{
    return BASELINE_RAW + WARM_UP_RAW * exp(-age_s / WARM_UP_S) +
           WANDER_RAW * sin(age_s / 97 + d->wander_phase);
}

static uint16_t converted(const struct detector *d, double raw)
{
    return (uint16_t)fmin(fmax(lround(raw), 0), d->options.saturation);
}

void detector_expose(const struct detector *d, const struct spectrum *irradiance,
                     double exposure_s, double age_s, struct noise *noise,
                     uint16_t raw[DETECTOR_PIXELS])
{
    double light[DETECTOR_PIXELS] = {0}, mean = 0;
    for (int p = DETECTOR_FIRST_TRANSITION; p < DETECTOR_PIXELS; p++) {
        light[p] = exposure_s * light_of(&d->pixels[p], irradiance);
        mean += light[p] / DETECTOR_PIXELS;
    }
    light[DETECTOR_FIRST_TRANSITION] *= 0.3;
    light[DETECTOR_FIRST_TRANSITION + 1] *= 0.7;

    double raw_per_count = d->options.saturation / FULL_SCALE;
    double zero = baseline(d, age_s);
    for (int p = 0; p < DETECTOR_PIXELS; p++) {
        double counts = 0;
        if (p >= DETECTOR_FIRST_TRANSITION) {
            counts = light[p] + STRAY * mean + d->pixels[p].dark * exposure_s;
            counts += noise_normal(noise) * sqrt(counts * (FULL_SCALE / WELL_ELECTRONS));
            counts = measured(d, counts);
        }
        counts += READ_NOISE * noise_normal(noise);
        raw[p] = converted(d, zero + d->pixels[p].pattern + counts * raw_per_count);
    }
}
