// SPDX-License-Identifier: Apache-2.0
#include "calibration/budget_modes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SEEN_FIRST_NM = 380, SEEN_LAST_NM = 780, NOISE_BIN_NM = 20 };
static const double MIDDLE_NM = 580, SLOPE_NM = 180, FALL_FROM_NM = 560;
// Where X, Y and Z of a spectrum nobody read are taken to come from.
static const double EFFECTIVE_NM[3] = {600, 555, 450};

void budget_modes_fini(struct budget_modes *m)
{
    for (int k = 0; k < m->count; k++) {
        free(m->modes[k].reference);
        free(m->modes[k].screen);
    }
    free(m->reference);
    *m = (struct budget_modes){0};
}

// Adds a mode with the arrays it needs; NULL when out of memory.
static struct budget_mode *add_mode(struct budget_modes *m, enum budget_cause cause, bool reference,
                                    bool screen, struct error *err)
{
    struct budget_mode mode = {.cause = cause};
    size_t n = (size_t)m->patches + 1;
    if (reference)
        mode.reference = calloc(n, sizeof *mode.reference);
    if (screen)
        mode.screen = calloc(n, sizeof *mode.screen);
    if (m->count == BUDGET_MODES || (reference && !mode.reference) || (screen && !mode.screen)) {
        free(mode.reference);
        free(mode.screen);
        fail(err, ERROR_SYSTEM, "out of memory for the budget");
        return NULL;
    }
    m->modes[m->count] = mode;
    return &m->modes[m->count++];
}

static bool add_scalar(struct budget_modes *m, enum budget_cause cause, double log_lux,
                       double log_screen, struct error *err)
{
    struct budget_mode *mode = add_mode(m, cause, false, false, err);
    if (!mode)
        return false;
    mode->log_lux = log_lux;
    mode->log_screen = log_screen;
    return true;
}

// Sums of light times reflectance (NULL: 1) times colour-matching functions.
static struct xyz sums(const struct spectrum *light, const struct spectrum *reflectance,
                       const struct spectrum *cmf)
{
    double sum[3] = {0};
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double v = light->v[i] * (reflectance ? reflectance->v[i] : 1);
        for (int c = 0; c < 3; c++)
            sum[c] += v * cmf[c].v[i];
    }
    return (struct xyz){sum[0], sum[1], sum[2]};
}

static const struct spectrum *sample(const struct budget_input *in, int i)
{
    return i < in->count ? &in->patches[i].reflectance : NULL;
}

// ---- what a spectrometer may have wrong ------------------------------------------

static double slope_at(const struct spectrum *s, int i)
{
    int low = i > 0 ? i - 1 : i, high = i < SPECTRUM_COUNT - 1 ? i + 1 : i;
    return (s->v[high] - s->v[low]) / (high - low);
}

static bool seen(double nm)
{
    return nm >= SEEN_FIRST_NM && nm <= SEEN_LAST_NM;
}

static double stretch(double nm)
{
    return (nm - MIDDLE_NM) / (SEEN_LAST_NM - MIDDLE_NM);
}

// Changes of the colour-matching weights instead of the light: a line that
// stands elsewhere is weighted elsewhere, and the weights are smooth.
static struct xyz shifted(const struct spectrum *light, const struct spectrum *reflectance,
                          const struct spectrum *cmf, double shift_nm, double stretch_nm)
{
    double sum[3] = {0};
    for (int c = 0; c < 3; c++)
        for (int i = 1; i < SPECTRUM_COUNT - 1; i++) {
            double nm = SPECTRUM_FIRST_NM + i;
            double slope = slope_at(&cmf[c], i);
            if (reflectance)
                slope = slope * reflectance->v[i] + cmf[c].v[i] * slope_at(reflectance, i);
            sum[c] += light->v[i] * slope * (shift_nm + stretch_nm * stretch(nm));
        }
    return (struct xyz){sum[0], sum[1], sum[2]};
}

// Wave k of an error of standard deviation 1 at every wavelength, made of sines
// and cosines of 1.. orders whole periods. Source: Karha et al. 2017.
static struct spectrum wave(int k, int orders)
{
    struct spectrum out;
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double turns =
            (double)(SPECTRUM_FIRST_NM + i - SEEN_FIRST_NM) / (SEEN_LAST_NM - SEEN_FIRST_NM);
        double angle = 2 * M_PI * (k / 2 + 1) * turns;
        out.v[i] = (k % 2 ? sin(angle) : cos(angle)) / sqrt(orders);
    }
    return out;
}

static struct spectrum times(const struct spectrum *light, const struct spectrum *by, double size)
{
    struct spectrum out;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out.v[i] = size * light->v[i] * by->v[i];
    return out;
}

static bool add_reference(struct budget_modes *m, const struct budget_input *in,
                          enum budget_cause cause, const struct spectrum *change, struct error *err)
{
    const struct spectrum *cmf = observer_cmf(in->observer);
    struct budget_mode *mode = add_mode(m, cause, true, false, err);
    for (int i = 0; mode && i <= in->count; i++)
        mode->reference[i] = sums(change, sample(in, i), cmf);
    return mode;
}

static bool add_wavelengths(struct budget_modes *m, const struct budget_input *in, double shift_nm,
                            double stretch_nm, struct error *err)
{
    const struct spectrum *cmf = observer_cmf(in->observer);
    struct budget_mode *mode = add_mode(m, CAUSE_SPECTROMETER_WAVELENGTH, true, false, err);
    for (int i = 0; mode && i <= in->count; i++)
        mode->reference[i] = shifted(&in->lamp, sample(in, i), cmf, shift_nm, stretch_nm);
    return mode;
}

// Noise is independent from nm to nm; blocks of NOISE_BIN_NM have the same sum.
static bool add_noise(struct budget_modes *m, const struct budget_input *in, struct error *err)
{
    double squares = 0;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        squares += in->lamp.v[i] * in->lamp.v[i];
    double each = in->lamp_noise * sqrt(squares / SPECTRUM_COUNT) / sqrt(NOISE_BIN_NM);
    for (int nm = SEEN_FIRST_NM; nm < SEEN_LAST_NM; nm += NOISE_BIN_NM) {
        struct spectrum block = {{0}};
        for (int i = 0; i < NOISE_BIN_NM; i++)
            block.v[nm + i - SPECTRUM_FIRST_NM] = each;
        if (!add_reference(m, in, CAUSE_SPECTROMETER_NOISE, &block, err))
            return false;
    }
    return true;
}

static bool add_calibration(struct budget_modes *m, const struct budget_input *in,
                            struct error *err)
{
    const struct uncertainties *u = &in->u;
    struct spectrum slope, stray = {{0}};
    double mean = 0;
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double nm = SPECTRUM_FIRST_NM + i;
        slope.v[i] = in->lamp.v[i] * u->spectrometer_slope * (nm - FALL_FROM_NM) / SLOPE_NM;
        mean += seen(nm) ? in->lamp.v[i] / (SEEN_LAST_NM - SEEN_FIRST_NM + 1) : 0;
    }
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        stray.v[i] = seen(SPECTRUM_FIRST_NM + i) ? u->spectrometer_stray * mean : 0;
    if (!add_reference(m, in, CAUSE_SPECTROMETER_CALIBRATION, &slope, err) ||
        !add_reference(m, in, CAUSE_SPECTROMETER_CALIBRATION, &stray, err))
        return false;
    for (int k = 0; k < 2 * u->spectrometer_waves; k++) {
        struct spectrum by = wave(k, u->spectrometer_waves);
        struct spectrum change = times(&in->lamp, &by, u->spectrometer_relative);
        if (!add_reference(m, in, CAUSE_SPECTROMETER_CALIBRATION, &change, err))
            return false;
    }
    return true;
}

// ---- what a radiometer may have wrong ----------------------------------------------

// Relative change of the luminance of the lamp's light, for its spot readings.
static double of_lamp(const struct budget_input *in, const struct budget_modes *m, double change)
{
    return in->map_by_radiometer ? change / m->reference[in->count].Y : 0;
}

static struct xyz scaled(struct xyz c, double x, double y, double z)
{
    return (struct xyz){c.X * x, c.Y * y, c.Z * z};
}

// A change computed from a spectrum of any level, brought to the level of XYZ.
static struct xyz at_level(struct xyz change, const struct budget_patch *p,
                           const struct spectrum *cmf)
{
    double y = sums(p->radiance, NULL, cmf).Y, k = y > 0 ? p->screen.Y / y : 0;
    return scaled(change, k, k, k);
}

static double at_nm(const struct spectrum *s, double nm)
{
    return s->v[(int)nm - SPECTRUM_FIRST_NM];
}

static bool add_radiometer_wave(struct budget_modes *m, const struct budget_input *in,
                                const struct spectrum *by, struct error *err)
{
    const struct spectrum *cmf = observer_cmf(in->observer);
    double size = in->u.radiometer_relative;
    struct budget_mode *mode = add_mode(m, CAUSE_RADIOMETER_CALIBRATION, false, true, err);
    if (!mode)
        return false;
    struct spectrum change = times(&in->lamp, by, size);
    mode->log_lux = of_lamp(in, m, sums(&change, NULL, cmf).Y);
    for (int i = 0; i < in->count; i++) {
        const struct budget_patch *p = &in->patches[i];
        if (p->radiance) {
            change = times(p->radiance, by, size);
            mode->screen[i] = at_level(sums(&change, NULL, cmf), p, cmf);
        } else {
            mode->screen[i] =
                scaled(p->screen, size * at_nm(by, EFFECTIVE_NM[0]),
                       size * at_nm(by, EFFECTIVE_NM[1]), size * at_nm(by, EFFECTIVE_NM[2]));
        }
    }
    return true;
}

static bool add_radiometer_shift(struct budget_modes *m, const struct budget_input *in,
                                 struct error *err)
{
    const struct spectrum *cmf = observer_cmf(in->observer);
    double shift = in->u.radiometer_nm;
    struct budget_mode *mode = add_mode(m, CAUSE_RADIOMETER_WAVELENGTH, false, true, err);
    if (!mode)
        return false;
    mode->log_lux = of_lamp(in, m, shifted(&in->lamp, NULL, cmf, shift, 0).Y);
    for (int i = 0; i < in->count; i++)
        if (in->patches[i].radiance)
            mode->screen[i] = at_level(shifted(in->patches[i].radiance, NULL, cmf, shift, 0),
                                       &in->patches[i], cmf);
    return true;
}

// What a triangular band of that width does to sums with smooth weights: half
// its variance times their curvature. Source: Stearns, Stearns 1988, to the
// second order.
static struct xyz broadened(const struct spectrum *light, const struct spectrum *cmf, double nm)
{
    double sum[3] = {0}, half_variance = nm * nm / 12;
    for (int c = 0; c < 3; c++)
        for (int i = 1; i < SPECTRUM_COUNT - 1; i++)
            sum[c] +=
                half_variance * light->v[i] * (cmf[c].v[i + 1] - 2 * cmf[c].v[i] + cmf[c].v[i - 1]);
    return (struct xyz){sum[0], sum[1], sum[2]};
}

static bool add_radiometer_band(struct budget_modes *m, const struct budget_input *in,
                                struct error *err)
{
    const struct spectrum *cmf = observer_cmf(in->observer);
    double nm = in->u.radiometer_bandwidth_nm;
    struct budget_mode *mode = add_mode(m, CAUSE_RADIOMETER_BANDWIDTH, false, true, err);
    if (!mode)
        return false;
    mode->log_lux = of_lamp(in, m, broadened(&in->lamp, cmf, nm).Y);
    for (int i = 0; i < in->count; i++)
        if (in->patches[i].radiance)
            mode->screen[i] =
                at_level(broadened(in->patches[i].radiance, cmf, nm), &in->patches[i], cmf);
    return true;
}

static bool add_radiometer(struct budget_modes *m, const struct budget_input *in, struct error *err)
{
    double level = in->u.radiometer_level;
    int waves = in->u.radiometer_waves;
    if (!add_scalar(m, CAUSE_RADIOMETER_CALIBRATION, in->map_by_radiometer ? level : 0, level, err))
        return false;
    for (int k = 0; k < 2 * waves; k++) {
        struct spectrum by = wave(k, waves);
        if (!add_radiometer_wave(m, in, &by, err))
            return false;
    }
    return add_radiometer_shift(m, in, err) && add_radiometer_band(m, in, err);
}

// ---- the rest ------------------------------------------------------------------------

static bool add_booth(struct budget_modes *m, const struct budget_input *in, struct error *err)
{
    const struct uncertainties *u = &in->u;
    for (int k = 0; k < 3; k++)
        if (!add_scalar(m, CAUSE_MAP, u->map_shape * in->map_by_shape[k], 0, err))
            return false;
    return add_scalar(m, CAUSE_MAP, in->map_spots, 0, err) &&
           add_scalar(m, CAUSE_LEVEL, u->level, 0, err) &&
           add_scalar(m, CAUSE_TILT, u->tilt_deg * in->by_tilt, 0, err) &&
           add_scalar(m, CAUSE_PLACE, u->place_m * in->by_up, 0, err) &&
           add_scalar(m, CAUSE_PLACE, u->place_m * in->by_near, 0, err);
}

// ln g = -k sin^2(angle): first and second order of an uncertain angle.
static double by_eye(const struct budget_input *in)
{
    double angle = in->eye_angle_deg * M_PI / 180;
    double off = in->eye_distance_m > 0 ? in->u.eye_m / in->eye_distance_m : 0;
    double k = in->u.angle_fall;
    return hypot(k * sin(2 * angle) * off, M_SQRT2 * k * cos(2 * angle) * off * off);
}

static bool add_reflection(struct budget_modes *m, const struct budget_input *in, struct error *err)
{
    struct xyz white = m->reference[in->count];
    double k = in->u.reflection * in->reflectance * in->lux / M_PI / white.Y;
    struct budget_mode *mode = add_mode(m, CAUSE_REFLECTION, false, true, err);
    for (int i = 0; mode && i < in->count; i++)
        mode->screen[i] = scaled(white, k, k, k);
    return mode;
}

static bool add_display(struct budget_modes *m, const struct budget_input *in, struct error *err)
{
    for (int k = 0; k < in->display_modes; k++) {
        struct budget_mode *mode = add_mode(m, CAUSE_DISPLAY_MODEL, false, true, err);
        if (!mode)
            return false;
        memcpy(mode->screen, in->display_mode + (size_t)k * in->count,
               (size_t)in->count * sizeof *mode->screen);
    }
    return true;
}

static bool add_shown(struct budget_modes *m, const struct budget_input *in, struct error *err)
{
    return in->scope == SCOPE_MEASURED ||
           (add_scalar(m, CAUSE_EYE, 0, by_eye(in), err) &&
            add_scalar(m, CAUSE_DRIFT, 0, in->u.display_drift, err) && add_reflection(m, in, err) &&
            add_display(m, in, err));
}

bool budget_modes_make(const struct budget_input *in, struct budget_modes *out, struct error *err)
{
    struct budget_modes m = {.patches = in->count};
    const struct spectrum *cmf = observer_cmf(in->observer);
    m.reference = calloc((size_t)in->count + 1, sizeof *m.reference);
    bool fine = m.reference || fail(err, ERROR_SYSTEM, "out of memory for the budget");
    for (int i = 0; fine && i <= in->count; i++)
        m.reference[i] = sums(&in->lamp, sample(in, i), cmf);
    if (fine && !(m.reference[in->count].Y > 0))
        fine = fail(err, ERROR_RANGE, "budget: the lamp is dark");
    fine = fine && add_noise(&m, in, err) &&
           add_wavelengths(&m, in, in->u.spectrometer_nm, 0, err) &&
           add_wavelengths(&m, in, 0, in->u.spectrometer_stretch_nm, err) &&
           add_calibration(&m, in, err) && add_radiometer(&m, in, err) && add_booth(&m, in, err) &&
           add_shown(&m, in, err);
    if (fine)
        *out = m;
    else
        budget_modes_fini(&m);
    return fine;
}
