// SPDX-License-Identifier: Apache-2.0
#include "simulator/spotread_meter.h"

#include <math.h>

#include "simulator/model_slit.h"

#define EXPOSURE_LEAST_S 0.02
#define EXPOSURE_MOST_S 3.0
#define EXPOSURE_AIM 1.75e-3 // s W m-2 sr-1 nm-1
#define REPEAT_ALL 0.001     // relative, common to a reading
#define REPEAT_POINT 0.0005  // relative, each band by itself
#define FLOOR 2e-7           // W m-2 sr-1 nm-1
#define MW_PER_W 1000.0

static const struct spotread_meter meters[] = {
    [SPOTREAD_SPECBOS] = {"JETI specbos 1201", 380, 780, 401, 0, 5, false, false, true, 0.02, 70000,
                          "Underexposure", "Overexposure", "Adaption integration time"},
    [SPOTREAD_I1PRO] = {"i1 Pro", 380, 730, 36, 106, 10, true, true, false, 0.02, 1200,
                        "Light level is too low", "Sensor is saturated", "Reading is inconsistent"},
    [SPOTREAD_I1D3] = {"i1 Display Pro", 0, 0, 0, 0, 0, false, false, false, 0, 2000,
                       "Light level is too low", "Too bright to read accuractly",
                       "Measurement misread"},
};

const struct spotread_meter *spotread_meter(enum spotread_kind kind)
{
    return &meters[kind];
}

double spotread_exposure_s(const struct spectrum *radiance)
{
    double peak = 1e-12;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        peak = fmax(peak, radiance->v[i]);
    return fmin(fmax(EXPOSURE_AIM / peak, EXPOSURE_LEAST_S), EXPOSURE_MOST_S);
}

static void take_bands(const struct spotread_meter *m, bool fine, struct noise *noise,
                       const struct spectrum *light, struct spotread_bands *out)
{
    int count = fine ? m->fine_bands : m->bands;
    double bandpass = count ? m->bandpass_nm * m->bands / count : 0;
    *out = (struct spotread_bands){m->first_nm, m->last_nm, count, {0}};
    for (int i = 0; i < count; i++) {
        double point = 1 + REPEAT_POINT * noise_normal(noise);
        double seen = slit_mean(light, spotread_band_nm(out, i), bandpass) * point;
        out->mw[i] = MW_PER_W * (seen + FLOOR * noise_normal(noise));
    }
}

// A spectrum from the bands, as ArgyllCMS computes XYZ of a spectral instrument.
static void see_bands(const struct spotread_bands *bands, struct spectrum *seen)
{
    double nm[SPOTREAD_BANDS_MOST], w[SPOTREAD_BANDS_MOST];
    for (int i = 0; i < bands->count; i++) {
        nm[i] = spotread_band_nm(bands, i);
        w[i] = bands->mw[i] / MW_PER_W;
    }
    spectrum_from_samples(nm, w, (size_t)bands->count, false, seen, NULL);
}

void spotread_measure(const struct spotread_meter *meter, bool fine, enum observer observer,
                      struct noise *noise, const struct spectrum *radiance, double factor,
                      struct spotread_reading *out)
{
    struct spectrum seen = *radiance;
    spectrum_scale(&seen, factor * (1 + REPEAT_ALL * noise_normal(noise)));
    take_bands(meter, fine, noise, &seen, &out->bands);
    if (out->bands.count)
        see_bands(&out->bands, &seen);
    struct xyz c = xyz_absolute(&seen, observer), d50 = {96.42, 100, 82.49};
    out->xyz = (struct xyz){fmax(c.X, 0), fmax(c.Y, 0), fmax(c.Z, 0)};
    lab_of(out->xyz, d50, &out->lab, NULL);
}
