// SPDX-License-Identifier: Apache-2.0
#include "simulator/hidden.h"

#include "simulator/chance.h"

// Standard deviations. Spectrometer: wavelengths within 0.3 nm, calibration
// within 2 % over 180 nm. Radiometer: luminance within 2 %, x and y within
// 0.0015 of CIE A, wavelengths within 0.3 nm.
#define SPECTROMETER_SHIFT_NM 0.15
#define SPECTROMETER_STRETCH_NM 0.1
#define SPECTROMETER_LEVEL 0.03
#define SPECTROMETER_SLOPE 0.01
#define SPECTROMETER_RIPPLE 0.005
#define RADIOMETER_SHIFT_NM 0.15
#define RADIOMETER_LEVEL 0.01
#define RADIOMETER_RIPPLE 0.003
#define TILT_DEG 0.1
#define PLACE_M 0.001
#define MAP_FALL 0.02
#define LEVEL 0.002
#define EYE_M 0.01
#define DRIFT 0.003
#define REFLECTION 0.1

static void draw_ripple(struct chance *c, double size, struct hidden_instrument *out)
{
    for (int k = 0; k < HIDDEN_WAVES; k++) {
        out->ripple[k] = size * sqrt(2.0 / HIDDEN_WAVES) * chance_normal(c);
        out->period_nm[k] = 150 * pow(500.0 / 150, chance_uniform(c));
        out->phase[k] = 2 * M_PI * chance_uniform(c);
    }
}

void hidden_draw(uint64_t seed, struct hidden *out)
{
    struct chance s = chance_start(seed, "hidden spectrometer", 0);
    struct chance r = chance_start(seed, "hidden radiometer", 0);
    struct chance b = chance_start(seed, "hidden booth", 0);
    *out = (struct hidden){0};
    out->spectrometer.shift_nm = SPECTROMETER_SHIFT_NM * chance_normal(&s);
    out->spectrometer.stretch_nm = SPECTROMETER_STRETCH_NM * chance_normal(&s);
    out->spectrometer.level = SPECTROMETER_LEVEL * chance_normal(&s);
    out->spectrometer.slope = SPECTROMETER_SLOPE * chance_normal(&s);
    draw_ripple(&s, SPECTROMETER_RIPPLE, &out->spectrometer);
    out->radiometer.shift_nm = RADIOMETER_SHIFT_NM * chance_normal(&r);
    out->radiometer.level = RADIOMETER_LEVEL * chance_normal(&r);
    draw_ripple(&r, RADIOMETER_RIPPLE, &out->radiometer);
    out->tilt_deg = TILT_DEG * chance_normal(&b);
    out->up_m = PLACE_M * chance_normal(&b);
    out->near_m = PLACE_M * chance_normal(&b);
    for (int k = 0; k < 3; k++)
        out->map_fall[k] = MAP_FALL * chance_normal(&b);
    out->level = LEVEL * chance_normal(&b);
    out->eye_m.x = EYE_M * chance_normal(&b);
    out->eye_m.y = EYE_M * chance_normal(&b);
    out->eye_m.z = EYE_M * chance_normal(&b);
    out->drift = DRIFT * chance_normal(&b);
    out->reflection = REFLECTION * chance_normal(&b);
}

static double at_nm(const struct spectrum *s, double nm)
{
    double at = nm - SPECTRUM_FIRST_NM;
    int i = (int)floor(at);
    if (i < 0 || i >= SPECTRUM_COUNT - 1)
        return 0;
    return s->v[i] + (at - i) * (s->v[i + 1] - s->v[i]);
}

void hidden_sees(const struct hidden_instrument *h, const struct spectrum *light,
                 struct spectrum *seen)
{
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double nm = SPECTRUM_FIRST_NM + i, gain = 1 + h->level + h->slope * (nm - 560) / 180;
        for (int k = 0; k < HIDDEN_WAVES; k++)
            gain += h->ripple[k] * sin(2 * M_PI * nm / h->period_nm[k] + h->phase[k]);
        seen->v[i] = gain * at_nm(light, nm - h->shift_nm - h->stretch_nm * (nm - 580) / 200);
    }
}
