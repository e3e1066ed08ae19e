// SPDX-License-Identifier: Apache-2.0
#include "simulator/panel.h"

#include <math.h>
#include <string.h>

#include "colorimetry/colour.h"
#include "simulator/chance.h"

// Peaks of a quantum-dot backlight behind colour filters: centre, full width
// at half height (nm), height. Each filter passes a little of its neighbours.
struct peak {
    double centre_nm, width_nm, height;
};
static const struct peak primaries[3][3] = {
    {{626, 30, 1}, {538, 44, 0.012}, {604, 24, 0.14}},
    {{537, 44, 1}, {620, 32, 0.045}, {456, 22, 0.012}},
    {{456, 22, 1}, {537, 44, 0.022}, {478, 30, 0.05}},
};
static const double shift_nm[3] = {0.8, -1.2, 1.0}; // of the peaks at small drive
static const double gammas[3] = {2.21, 2.17, 2.26};
static const double warm_share[3] = {0.9, 1.0, 1.25}; // blue gains most as it warms

// Relative loss of a channel where another shines too (shared supply), and
// where that other stands at middle drive (fringe fields); rows suffer.
static const double supply[3][3] = {{0, 0.014, 0.008}, {0.007, 0, 0.010}, {0.011, 0.016, 0}};
static const double fringe[3][3] = {{0, 0.036, -0.020}, {-0.023, 0, 0.026}, {0.020, -0.040, 0}};

static double height_at(const struct peak *peaks, double nm)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double u = (nm - peaks[k].centre_nm) / (peaks[k].width_nm / 2.354820045);
        sum += peaks[k].height * exp(-u * u / 2);
    }
    return sum;
}

static void make_spectra(struct panel *p)
{
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double nm = SPECTRUM_FIRST_NM + i;
        p->leak.v[i] = 0;
        for (int c = 0; c < 3; c++) {
            p->primary[c].v[i] = height_at(primaries[c], nm);
            p->shift[c].v[i] = p->settings.dispersion *
                               (height_at(primaries[c], nm - shift_nm[c]) - p->primary[c].v[i]);
        }
        p->coating.v[i] = 1 - 0.08 * (nm - 560) / 200;
    }
}

static void make_curves(struct panel *p, int seed)
{
    int last = (1 << p->settings.bits) - 1;
    for (int c = 0; c < 3; c++) {
        struct chance chance = chance_start(seed, "curve", c);
        double size[5], phase[5], turns[5] = {1.5, 3.7, 7.3, 13.1, 23.9};
        for (int k = 0; k < 5; k++) {
            size[k] = p->settings.ripple * 0.006 / turns[k] * chance_either(&chance);
            phase[k] = 2 * M_PI * chance_uniform(&chance);
        }
        for (int code = 0; code <= last; code++) {
            double x = (double)code / last, bump = 4 * x * (1 - x), drive = x;
            for (int k = 0; k < 5; k++)
                drive += bump * size[k] * sin(2 * M_PI * turns[k] * x + phase[k]);
            drive = rint(drive * 4095) / 4095; // the panel's own converter
            p->curve[c][code] = pow(drive, gammas[c]);
        }
    }
}

static void make_waves(struct panel *p, int seed)
{
    for (int c = 0; c < 3; c++) {
        struct chance chance = chance_start(seed, "uniformity", c);
        p->wave[c][0] = 0.005 * chance_either(&chance);
        p->wave[c][1] = 0.005 * chance_either(&chance);
        p->wave[c][2] = M_PI * (1 + chance_uniform(&chance));
        p->wave[c][3] = M_PI * (1 + chance_uniform(&chance));
    }
}

// Heights of the primaries that give D65 at Y = 1, all channels at full drive
// with their interaction.
static void balance(struct panel *p)
{
    static const struct vec3 d65 = {0.95047, 1, 1.08883};
    struct mat3 m, inverse;
    for (int c = 0; c < 3; c++) {
        struct xyz xyz = xyz_absolute(&p->primary[c], OBSERVER_1931_2);
        m.m[0][c] = xyz.X;
        m.m[1][c] = xyz.Y;
        m.m[2][c] = xyz.Z;
    }
    if (!mat3_invert(m, &inverse))
        return;
    struct vec3 k = mat3_apply(inverse, d65);
    const double share[3] = {k.x, k.y, k.z};
    for (int c = 0; c < 3; c++) {
        double loss = 0;
        for (int other = 0; other < 3; other++)
            loss += p->settings.interaction * supply[c][other];
        spectrum_scale(&p->primary[c], share[c] / (1 - loss));
        spectrum_scale(&p->shift[c], share[c] / (1 - loss));
    }
}

// The leak is the backlight through crossed polarisers: bluish and broad.
static void make_leak(struct panel *p)
{
    static const double part[3] = {0.8, 0.9, 1.7};
    struct spectrum equal_energy;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        equal_energy.v[i] = 1;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            p->leak.v[i] += part[c] * p->primary[c].v[i];
    double y = xyz_absolute(&p->leak, OBSERVER_1931_2).Y;
    spectrum_scale(&p->leak, p->settings.black_cdm2 / y);
    double luminous = xyz_relative(&equal_energy, &p->coating, OBSERVER_1931_2).Y / 100;
    spectrum_scale(&p->coating, p->settings.reflectance / luminous);
}

void panel_init(struct panel *panel, const struct scenario_panel *settings, int seed)
{
    memset(panel, 0, sizeof *panel);
    panel->settings = *settings;
    make_spectra(panel);
    make_curves(panel, seed);
    make_waves(panel, seed);
    balance(panel);
    make_leak(panel);
    double y = settings->white_cdm2 - settings->black_cdm2;
    for (int c = 0; c < 3; c++) {
        spectrum_scale(&panel->primary[c], y);
        spectrum_scale(&panel->shift[c], y);
    }
}

double panel_angle_gain(int channel, double sin2)
{
    // White reaches 90 % at 15 and 75 % at 25 degrees; blue falls off first.
    static const double share[3] = {1.04, 0.98, 1.06};
    return exp(-share[channel] * (1.5501 + 0.3394 * sin2) * sin2);
}

static double place_gain(const struct panel *p, int c, double x, double y)
{
    const double *w = p->wave[c];
    double corner = -0.012 * (x * x + y * y);
    double wave = w[0] * sin(w[2] * x) + w[1] * sin(w[3] * y);
    return 1 + p->settings.uniformity * (corner + wave);
}

static void interact(const struct panel *p, const double alone[3], double out[3])
{
    for (int c = 0; c < 3; c++) {
        double loss = 0;
        for (int other = 0; other < 3; other++) {
            double t = alone[other];
            loss += supply[c][other] * t + fringe[c][other] * 4 * t * (1 - t) * (1 - alone[c]);
        }
        out[c] = alone[c] * (1 - p->settings.interaction * loss);
    }
}

void panel_add(const struct panel *panel, const double code[3], const struct panel_view *view,
               struct panel_light *light)
{
    int last = (1 << panel->settings.bits) - 1;
    double alone[3], t[3];
    for (int c = 0; c < 3; c++)
        alone[c] = panel->curve[c][(int)lrint(fmin(fmax(code[c], 0), 1) * last)];
    interact(panel, alone, t);
    for (int c = 0; c < 3; c++) {
        double gain = place_gain(panel, c, view->x, view->y) * panel_angle_gain(c, view->sin2);
        light->full[c] += gain * t[c];
        light->shift[c] += gain * t[c] * (1 - alone[c]);
    }
    light->leak += (1 + 3 * view->sin2) * place_gain(panel, 1, view->x, view->y);
    light->pixels++;
}

void panel_emission(const struct panel *panel, const struct panel_light *light, double on_s,
                    struct spectrum *out)
{
    memset(out, 0, sizeof *out);
    if (!light->pixels)
        return;
    double cold = panel->settings.warmup_drop * exp(-on_s / panel->settings.warmup_s);
    for (int c = 0; c < 3; c++) {
        double warm = (1 - cold * warm_share[c]) / light->pixels;
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            out->v[i] += warm * (light->full[c] * panel->primary[c].v[i] +
                                 light->shift[c] * panel->shift[c].v[i]);
    }
    double warm = (1 - cold) / light->pixels;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] += warm * light->leak * panel->leak.v[i];
}

void panel_patch(const struct panel *panel, const double code[3], struct spectrum *out)
{
    struct panel_light light = {0};
    panel_add(panel, code, &(struct panel_view){0}, &light);
    panel_emission(panel, &light, HUGE_VAL, out);
}

void panel_reflection(const struct panel *panel, const struct spectrum *irradiance,
                      struct spectrum *out)
{
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = irradiance->v[i] * panel->coating.v[i] / M_PI;
}
