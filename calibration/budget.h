// SPDX-License-Identifier: Apache-2.0
// How uncertain a proof's colour differences are, and why: a Monte-Carlo
// propagation of everything that the light of a physical sample (reference)
// and the light of the screen are known by.
//
// Sources: JCGM 101:2008 (Monte Carlo), JCGM 100:2008 (k = 2); correlated
// spectral errors: Gardner 2000 (Metrologia 37, 633), Ohno 2001 (numerical
// derivatives).
#ifndef CALIBRATION_BUDGET_H
#define CALIBRATION_BUDGET_H

#include <stdint.h>

#include "base/settings.h"
#include "colorimetry/display.h"

#define BUDGET_CAUSES(X)                                                                           \
    X(SPECTROMETER_NOISE, "spectrometer noise")                                                    \
    X(SPECTROMETER_WAVELENGTH, "spectrometer wavelengths")                                         \
    X(SPECTROMETER_CALIBRATION, "spectrometer calibration")                                        \
    X(RADIOMETER_REPEATABILITY, "radiometer repeatability")                                        \
    X(RADIOMETER_WAVELENGTH, "radiometer wavelengths")                                             \
    X(RADIOMETER_BANDWIDTH, "radiometer bandwidth")                                                \
    X(RADIOMETER_CALIBRATION, "radiometer calibration")                                            \
    X(MAP, "luminance map")                                                                        \
    X(LEVEL, "level of the lamp")                                                                  \
    X(TILT, "tilt")                                                                                \
    X(PLACE, "place of the screen")                                                                \
    X(EYE, "place of the eye")                                                                     \
    X(DISPLAY_MODEL, "display model")                                                              \
    X(QUANTISATION, "quantisation")                                                                \
    X(DRIFT, "drift of the display")                                                               \
    X(REFLECTION, "reflection of the screen")

enum budget_cause {
#define X(name, text) CAUSE_##name,
    BUDGET_CAUSES(X)
#undef X
        CAUSES,
};

// "spectrometer noise" and so on.
const char *budget_cause_name(enum budget_cause cause);

// Standard uncertainties (k = 1) that no session can find out by itself: from
// the instruments' certificates and from how the booth was set up. Section
// [uncertainty].
struct uncertainties {
    double spectrometer_nm;         // of the whole wavelength scale
    double spectrometer_stretch_nm; // at 380 and 780 nm against 580 nm
    double spectrometer_slope;      // relative change of calibration over 180 nm
    double spectrometer_relative;   // of spectral calibration, smooth in wavelength
    int spectrometer_waves;         // how smooth: whole waves of 1.. periods over 380..780 nm
    double spectrometer_stray;      // light where there is none, over the mean of 380..780 nm
    double radiometer_level;        // of luminance, relative
    double radiometer_relative;     // of spectral calibration, smooth in wavelength
    int radiometer_waves;
    double radiometer_nm;           // of the whole wavelength scale
    double radiometer_bandwidth_nm; // full width at half height of a triangular band, where nothing
                                    // corrects for it; 0 = corrected
    double radiometer_repeat;       // of one reading, relative, alike in X, Y and Z
    double radiometer_colour;       // of one reading, relative, X, Y and Z each
    double map_shape;               // of the map at its edge over its centre
    double level;                   // of the lamp's level since it was taught, relative
    double tilt_deg;
    double place_m;       // of the screen's centre, up and towards the observer
    double eye_m;         // of the eye, across the line of sight
    double angle_fall;    // k of the panel's luminance over angle: exp(-k sin^2)
    double display_drift; // of the panel since it was characterised, relative
    double reflection;    // of the screen's reflectance, relative
};

extern const struct setting uncertainty_settings[];

// Presets, or those of an INI file with a section [uncertainty] (path "" or
// NULL: presets). Errors as ini_load.
bool uncertainties_load(const char *path, struct uncertainties *out, struct error *err);

// What a difference is about.
enum budget_scope {
    SCOPE_MEASURED, // screen as the radiometer read it, along its normal, at that moment
    SCOPE_SHOWN,    // screen as the display model predicts it, at the place of the eye
};

struct budget_patch {
    struct spectrum reflectance;     // of the sample
    struct xyz screen;               // cd/m2: read, or predicted
    const struct spectrum *radiance; // as read, any level; NULL: only XYZ were read
    struct mat3 by_code; // SHOWN: d screen / d code of R, G, B, cd/m2 for one code; zero where
                         // dithered
    bool counts;         // towards means and maxima
};

struct budget_input {
    struct uncertainties u;
    enum budget_scope scope;
    enum observer observer;
    struct spectrum lamp;   // as taught, any level
    double lamp_noise;      // rms of the mean of the readings, relative to its own rms
    double lux;             // on the screen, as believed: > 0
    double map_spots;       // relative standard uncertainty of the map's scale by its spot readings
    bool map_by_radiometer; // it was the same radiometer: its level then cancels
    double map_by_shape[3]; // d ln lux for map_shape = 1 along x, z and square of the radius
    double by_tilt;         // d ln lux / d degree
    double by_up, by_near;  // d ln lux / d m
    double eye_angle_deg, eye_distance_m; // SHOWN: from the normal; to the screen
    // SHOWN: of the display model, one of two. Its joint uncertainty: [modes][count] shifts of the
    // patches' light by one standard deviation each, cd/m2; or, with no modes, its residual.
    int display_modes;
    const struct xyz *display_mode;
    struct vec3 display_rms; // see budget_residual
    double reflectance;      // SHOWN: of the screen
    bool shares;             // wanted; else they are 0
    int white;               // index of the patch that published differences are divided by
    int count;               // 1..1024
    const struct budget_patch *patches;
};

// A figure with its standard uncertainty, the rms of the draws about it; U = 2 u
// covers about 95 %.
struct budget_figure {
    double value, u;
    double share[CAUSES]; // of the variance: >= 0, sum 1, all 0 when u is 0
};

// Screen less reference, signed, each over its weight in CIEDE2000.
struct budget_difference {
    struct budget_figure L, C, H, E;
};

// Of the patches that count.
struct budget_overall {
    double mean, mean_u, max, max_u; // dE00
};

struct budget {
    int count, draws;
    struct budget_difference *absolute;  // [count], owned; white: the perfect diffuser there
    struct budget_difference *published; // [count], owned; see proof.h
    struct budget_overall absolute_all, published_all;
};

void budget_fini(struct budget *budget);

// The budget of one lamp's patches from `draws` (100..1e7) draws of all causes
// together, and a tenth of them with each cause drawn anew for the shares. The same
// seed gives the same result, however many threads work on it. Errors: RANGE
// for what lies outside the ranges above, a white that is not positive.
bool budget_make(const struct budget_input *input, int draws, uint64_t seed, struct budget *out,
                 struct error *err);

// How far a display model is off colours that it was not fitted to: rms of the
// differences in L*, a* and b*, each over its weight in CIEDE2000 there (the
// rows of colorimetry/metric.h). white: of CIELAB, positive.
struct vec3 budget_residual(const struct xyz *predicted, const struct xyz *measured, int count,
                            struct xyz white);

// Whether a figure keeps to a tolerance, its expanded uncertainty as guard band
// (JCGM 106:2012): sure to be within, sure to be beyond, or neither.
enum verdict { VERDICT_PASS, VERDICT_FAIL, VERDICT_UNDECIDED };
enum verdict verdict_of(double value, double expanded, double tolerance);

// "pass", "fail", "undecided".
const char *verdict_name(enum verdict verdict);

#endif
