// SPDX-License-Identifier: Apache-2.0
// What can be said about a booth's lamps from a spectrometer alone. Lamps come
// in with their spectra; audit_judge computes everything else; the writers of
// audit_report.h only write it down.
#ifndef CALIBRATION_AUDIT_H
#define CALIBRATION_AUDIT_H

#include "calibration/seal.h"
#include "colorimetry/rendering.h"
#include "config/spectra.h"

enum { AUDIT_LAMPS = 32, AUDIT_PLACES = 9, AUDIT_CENTRE = 4 };

// Against the figures that papers of the trade give of ISO 3664:2009.
#define AUDIT_FIGURES(X)                                                                           \
    X(P1, "illuminance P1", "lx", 1500, 2500)                                                      \
    X(P2, "illuminance P2", "lx", 375, 625)                                                        \
    X(UNIFORMITY, "least of nine places over centre", "", 0.60, INFINITY)                          \
    X(CHROMATICITY, "u'10 v'10 from D50", "", 0, 0.005)                                            \
    X(RA, "CIE Ra", "", 90, 100)                                                                   \
    X(MI_VISIBLE, "MIvis", "", 0, 1)                                                               \
    X(MI_UV, "MIuv", "", 0, 1.5)

enum audit_figure {
#define X(name, text, unit, least, most) FIGURE_##name,
    AUDIT_FIGURES(X)
#undef X
        FIGURES,
};

enum audit_verdict { FIGURE_NOT_COMPUTED, FIGURE_WITHIN, FIGURE_OUTSIDE };

// "not computed", "within", "outside".
const char *audit_verdict_name(enum audit_verdict verdict);

struct audit_limits {
    const char *name, *unit;
    double least, most;
};
extern const struct audit_limits audit_limits[FIGURES];

struct audit_row {
    enum audit_verdict verdict;
    double value;
    const char *why; // not computed: why
};

struct audit_lamp {
    // Read:
    char name[64], source[512], instrument[128], taken[32]; // source: file, or "read"
    bool absolute;                  // irradiance is in W m-2 nm-1, else relative power
    struct spectrum irradiance;     // of the centre, when nine places were read
    int readings;                   // averaged, 0 = not known
    double spread;                  // relative rms of the readings
    int places;                     // 9, or 0
    double place_lux[AUDIT_PLACES]; // row by row from the far left; relative unless absolute
    // Computed:
    double lux;          // absolute only
    double uniformity;   // least over centre; nine places only
    struct xyz xyz;      // Y = 100
    struct xy xy;        // 1931
    struct uv uv, uv_10; // 1931, 1964
    struct cct cct;
    bool rendered; // else no_rendering says why not
    struct rendering rendering;
    char no_rendering[160];
    struct audit_row figures[FIGURES];
};

// One pair under one change of lamp.
struct audit_metamerism {
    int pair, matched, other; // lamps
    struct metamerism index;
};

// What a lamp has become since the last audit.
struct audit_drift {
    int lamp;
    bool level;           // lux_percent is known
    double lux_percent;   // change of illuminance
    double uv;            // distance in 1931 u', v'
    bool cct, ra;         // known on both sides
    double kelvin, ra_by; // changes
    double shape;         // lamp_distance of the spectra
};

struct audit_facts {
    char booth[64], made[32], software[64];
    bool emulated;
    int lamp_count;
    struct audit_lamp lamps[AUDIT_LAMPS];
    int pair_count;
    char (*pairs)[132]; // owned; "a / b"
    int metamerism_count;
    struct audit_metamerism *metamerism; // owned
    bool compared;                       // with the audit of `since`
    char since[32];
    int drift_count;
    struct audit_drift drift[AUDIT_LAMPS];
    struct sealed_inputs inputs;
};

void audit_fini(struct audit_facts *facts);

// Fills what is computed of every lamp. Errors name the lamp: no light at all.
bool audit_judge(struct audit_facts *facts, struct error *err);

// Special metamerism indices of sample pairs (spectra 0 and 1, 2 and 3, ...)
// for every ordered pair of lamps, 1931 observer. Error DATA for an odd number
// of samples, or a sample that is black.
bool audit_metamerism(struct audit_facts *facts, const struct spectra *samples, struct error *err);

// Compares lamps of the same name with an earlier audit, as audit_report.h
// wrote and read it. A lamp that it does not hold is left out.
void audit_compare(struct audit_facts *facts, const struct audit_facts *before);

// What no lamp's spectrum can tell, with the reason; ends with what = NULL.
struct audit_missing {
    const char *what, *why;
};
extern const struct audit_missing audit_missing[];

#endif
