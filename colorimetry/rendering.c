// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/rendering.h"

#include <math.h>

#include "colorimetry/illuminant.h"
#include "colorimetry/tables/tables.h"

#define DAYLIGHT_FROM_K 5000.0
#define PER_DIFFERENCE 4.6 // CIE 13.3: so that warm white fluorescent lamps of 1964 get 50

// CIE 1960 u, v.
static struct uv uv_1960(struct xyz c)
{
    struct uv p = uv_of(c);
    p.v *= 2.0 / 3;
    return p;
}

// What CIE 13.3 adapts chromaticities in.
struct cone_ratios {
    double c, d;
};

static struct cone_ratios ratios_of(struct uv p)
{
    return (struct cone_ratios){(4 - p.u - 10 * p.v) / p.v,
                                (1.708 * p.v + 0.404 - 1.481 * p.u) / p.v};
}

static struct uv adapted(struct uv p, struct cone_ratios lamp, struct cone_ratios reference)
{
    struct cone_ratios r = ratios_of(p);
    double c = reference.c / lamp.c * r.c, d = reference.d / lamp.d * r.d;
    double under = 16.518 + 1.481 * c - d;
    return (struct uv){(10.872 + 0.404 * c - 4 * d) / under, 5.520 / under};
}

// W*, U*, V* of CIE 1964 about the reference's white.
static struct vec3 wuv_of(double Y, struct uv p, struct uv white)
{
    double w = 25 * cbrt(Y) - 17;
    return (struct vec3){w, 13 * w * (p.u - white.u), 13 * w * (p.v - white.v)};
}

// The series' nominal temperatures stand on the scale of 1968.
static bool reference_of(double kelvin, struct spectrum *out, bool *is_daylight, struct error *err)
{
    *is_daylight = kelvin >= DAYLIGHT_FROM_K;
    if (*is_daylight)
        return daylight(kelvin / DAYLIGHT_SCALE, out, err);
    planck(kelvin, out);
    return true;
}

void test_colour(int index, struct spectrum *out)
{
    double nm[DAYLIGHT_BASIS_COUNT];
    for (int i = 0; i < DAYLIGHT_BASIS_COUNT; i++)
        nm[i] = SPECTRUM_FIRST_NM + TABLE_STEP_NM * i;
    spectrum_from_samples(nm, TEST_COLOUR[index], DAYLIGHT_BASIS_COUNT, true, out, NULL);
}

bool rendering_of(const struct spectrum *lamp, struct rendering *out, struct error *err)
{
    struct rendering found = {0};
    struct spectrum reference;
    struct xyz white = xyz_relative(lamp, NULL, OBSERVER_1931_2);
    struct cct cct = cct_of(xy_of(white));
    if (!(white.Y > 0))
        return fail(err, ERROR_RANGE, "colour rendering of a dark lamp");
    if (!cct.valid)
        return fail(err, ERROR_RANGE,
                    "colour rendering of a lamp without a correlated colour temperature");
    if (!reference_of(cct.kelvin, &reference, &found.daylight, err))
        return while_doing(err, "colour rendering");
    struct uv k = uv_1960(white), r = uv_1960(xyz_relative(&reference, NULL, OBSERVER_1931_2));
    found.kelvin = cct.kelvin;
    found.distance = hypot(k.u - r.u, k.v - r.v);
    for (int i = 0; i < TEST_COLOURS; i++) {
        struct spectrum sample;
        test_colour(i, &sample);
        struct xyz under = xyz_relative(lamp, &sample, OBSERVER_1931_2);
        struct xyz as = xyz_relative(&reference, &sample, OBSERVER_1931_2);
        struct uv moved = adapted(uv_1960(under), ratios_of(k), ratios_of(r));
        struct vec3 apart = vec3_sub(wuv_of(under.Y, moved, r), wuv_of(as.Y, uv_1960(as), r));
        found.special[i] = 100 - PER_DIFFERENCE * vec3_length(apart);
        found.general += i < TEST_COLOURS_OF_RA ? found.special[i] / TEST_COLOURS_OF_RA : 0;
    }
    *out = found;
    return true;
}

bool metamerism_of(const struct spectrum *a, const struct spectrum *b,
                   const struct spectrum *matched, const struct spectrum *other,
                   enum observer observer, struct metamerism *out, struct error *err)
{
    struct xyz a1 = xyz_relative(matched, a, observer), b1 = xyz_relative(matched, b, observer);
    struct xyz a2 = xyz_relative(other, a, observer), b2 = xyz_relative(other, b, observer);
    struct xyz white1 = xyz_relative(matched, NULL, observer);
    struct xyz white2 = xyz_relative(other, NULL, observer);
    struct lab lab[4];
    if (!(b1.X > 0 && b1.Y > 0 && b1.Z > 0))
        return fail(err, ERROR_RANGE, "metamerism: a sample without light under the first lamp");
    struct xyz corrected = {b2.X * a1.X / b1.X, b2.Y * a1.Y / b1.Y, b2.Z * a1.Z / b1.Z};
    if (!lab_of(a1, white1, &lab[0], err) || !lab_of(b1, white1, &lab[1], err) ||
        !lab_of(a2, white2, &lab[2], err) || !lab_of(corrected, white2, &lab[3], err))
        return while_doing(err, "metamerism");
    *out = (struct metamerism){.match_ab = delta_e_ab(lab[0], lab[1]),
                               .index_ab = delta_e_ab(lab[2], lab[3]),
                               .index_2000 = delta_e_2000(lab[2], lab[3])};
    return true;
}
