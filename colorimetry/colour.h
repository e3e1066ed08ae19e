// SPDX-License-Identifier: Apache-2.0
// Tristimulus values and what is computed from them: chromaticity, CIELAB,
// colour differences, chromatic adaptation, correlated colour temperature.
// Pure functions in double; nothing here allocates.
#ifndef COLORIMETRY_COLOUR_H
#define COLORIMETRY_COLOUR_H

#include "base/linear.h"
#include "colorimetry/spectrum.h"

// Tristimulus values. Absolute where a name says cd/m2 (Y is luminance),
// relative (Y = 100 for the perfect diffuser) where it says so.
struct xyz {
    double X, Y, Z;
};
struct xy {
    double x, y;
};
struct uv {
    double u, v; // CIE 1976 u', v'
};
struct lab {
    double L, a, b;
};
struct lch {
    double L, C, h; // h in degrees 0..360; 0 at C = 0
};

// ---- observers -------------------------------------------------------------

#define OBSERVERS(X)                                                                               \
    X(1931_2, "1931-2") /* CIE 1931, 2 degrees */                                                  \
    X(1964_10, "1964-10")                                                                          \
    X(2015_2, "2015-2") /* CIE 170-2:2015 */                                                       \
    X(2015_10, "2015-10")

enum observer {
#define X(name, text) OBSERVER_##name,
    OBSERVERS(X)
#undef X
        OBSERVER_COUNT
};

// "1931-2" and so on, never NULL.
const char *observer_name(enum observer observer);

// False for any other text: an unknown observer is never replaced by another.
bool observer_from_name(const char *name, enum observer *out);

// Colour-matching functions, three spectra x, y, z on the inner grid; 0
// outside the published range. Source: CIE tables, 1 nm.
const struct spectrum *observer_cmf(enum observer observer);

// ---- spectrum to XYZ -------------------------------------------------------

// 683 lm/W times the sums of spectrum times colour-matching functions, 1 nm
// steps: spectral radiance W m-2 sr-1 nm-1 -> cd/m2; irradiance W m-2 nm-1 ->
// Y in lux. Source: CIE 015:2018 (7.1).
struct xyz xyz_absolute(const struct spectrum *s, enum observer observer);

// Tristimulus values of a surface under a lamp, Y = 100 for the perfect
// diffuser. reflectance may be NULL (the perfect diffuser itself). All zero
// for a dark lamp. Source: CIE 015:2018 (7.1).
struct xyz xyz_relative(const struct spectrum *lamp, const struct spectrum *reflectance,
                        enum observer observer);

// ---- chromaticity, CIELAB --------------------------------------------------

// x = y = 0 and u' = v' = 0 when X + Y + Z is not positive.
struct xy xy_of(struct xyz c);
struct uv uv_of(struct xyz c);

// CIELAB with the CIE's rational constants. white.X, Y, Z must be > 0, else
// false (RANGE) and out untouched. Negative tristimulus values follow the
// linear branch. Source: CIE 015:2018 (8.2.1).
bool lab_of(struct xyz c, struct xyz white, struct lab *out, struct error *err);
struct xyz xyz_of_lab(struct lab lab, struct xyz white);
struct lch lch_of(struct lab lab);

double delta_e_ab(struct lab a, struct lab b);

// CIEDE2000 with kL = kC = kH = 1. Finite for every finite input; the
// 180-degree hue branch is decided with a tolerance of 1e-9 degree. Source:
// Sharma, Wu, Dalal 2005; C^7 terms as 1/(1 + (25/C)^7).
double delta_e_2000(struct lab a, struct lab b);

// Signed parts of the same formula, each already divided by its weight.
struct delta_lch {
    double L, C, H; // b minus a
};
struct delta_lch delta_lch_2000(struct lab a, struct lab b);

// ---- adaptation ------------------------------------------------------------

enum cat { CAT_02, CAT_16 };

// Matrix that adapts colours seen under white `from` to white `to` (Y of both
// scaled to 1 first), D = degree of adaptation 0..1. Von Kries in the CAT's
// cone space; the identity for a white without light. Source: CIE 159:2004
// (CAT02); Li et al. 2017 (CAT16).
struct mat3 cat_matrix(enum cat cat, struct xyz from, struct xyz to, double degree);

static inline struct xyz xyz_apply(struct mat3 m, struct xyz c)
{
    struct vec3 v = mat3_apply(m, (struct vec3){c.X, c.Y, c.Z});
    return (struct xyz){v.x, v.y, v.z};
}

// ---- correlated colour temperature -----------------------------------------

struct cct {
    double kelvin, duv; // duv > 0 above the Planckian locus
    bool valid;         // |duv| <= 0.05 and 1000 K..100000 K (CIE 015:2018, 9.5)
};

// Ohno 2014 (LEUKOS 10, 47-55): triangular and parabolic solutions combined,
// on a table of Planckian u, v in steps small enough for +-1 K and +-1e-5.
// For the 1931 2-degree observer, as CCT is defined for it.
struct cct cct_of(struct xy c);

#endif
