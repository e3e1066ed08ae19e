// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/colour.h"

#include <math.h>
#include <string.h>

#include "colorimetry/tables/tables.h"

#define LUMENS_PER_WATT 683.0
#define LAB_EPSILON (216.0 / 24389.0)
#define LAB_KAPPA (24389.0 / 27.0)
#define DEGREES (180 / M_PI)

static const char *const OBSERVER_NAMES[] = {
#define X(name, text) text,
    OBSERVERS(X)
#undef X
};

const char *observer_name(enum observer observer)
{
    return OBSERVER_NAMES[observer];
}

bool observer_from_name(const char *name, enum observer *out)
{
    for (int i = 0; i < OBSERVER_COUNT; i++) {
        if (strcmp(name, OBSERVER_NAMES[i]) == 0) {
            *out = (enum observer)i;
            return true;
        }
    }
    return false;
}

const struct spectrum *observer_cmf(enum observer observer)
{
    return OBSERVER_CMF[observer];
}

static struct xyz xyz_sum(const struct spectrum *light, const struct spectrum *reflectance,
                          enum observer observer)
{
    const struct spectrum *cmf = OBSERVER_CMF[observer];
    struct xyz sum = {0, 0, 0};
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        double v = reflectance ? light->v[i] * reflectance->v[i] : light->v[i];
        sum.X += v * cmf[0].v[i];
        sum.Y += v * cmf[1].v[i];
        sum.Z += v * cmf[2].v[i];
    }
    return sum;
}

static struct xyz xyz_scale(struct xyz c, double k)
{
    return (struct xyz){c.X * k, c.Y * k, c.Z * k};
}

struct xyz xyz_absolute(const struct spectrum *s, enum observer observer)
{
    return xyz_scale(xyz_sum(s, NULL, observer), LUMENS_PER_WATT);
}

struct xyz xyz_relative(const struct spectrum *lamp, const struct spectrum *reflectance,
                        enum observer observer)
{
    struct xyz white = xyz_sum(lamp, NULL, observer);
    if (!(white.Y > 0))
        return (struct xyz){0, 0, 0};
    return xyz_scale(xyz_sum(lamp, reflectance, observer), 100 / white.Y);
}

struct xy xy_of(struct xyz c)
{
    double sum = c.X + c.Y + c.Z;
    if (!(sum > 0))
        return (struct xy){0, 0};
    return (struct xy){c.X / sum, c.Y / sum};
}

struct uv uv_of(struct xyz c)
{
    double sum = c.X + 15 * c.Y + 3 * c.Z;
    if (!(c.X + c.Y + c.Z > 0) || !(sum > 0))
        return (struct uv){0, 0};
    return (struct uv){4 * c.X / sum, 9 * c.Y / sum};
}

static double lab_f(double t)
{
    return t > LAB_EPSILON ? cbrt(t) : (LAB_KAPPA * t + 16) / 116;
}

static double lab_f_inverse(double f)
{
    double cube = f * f * f;
    return cube > LAB_EPSILON ? cube : (116 * f - 16) / LAB_KAPPA;
}

bool lab_of(struct xyz c, struct xyz white, struct lab *out, struct error *err)
{
    if (!(white.X > 0 && white.Y > 0 && white.Z > 0))
        return fail(err, ERROR_RANGE, "white X %g Y %g Z %g: all three must be above 0", white.X,
                    white.Y, white.Z);
    double fx = lab_f(c.X / white.X), fy = lab_f(c.Y / white.Y), fz = lab_f(c.Z / white.Z);
    *out = (struct lab){116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
    return true;
}

struct xyz xyz_of_lab(struct lab lab, struct xyz white)
{
    double fy = (lab.L + 16) / 116;
    return (struct xyz){
        white.X * lab_f_inverse(fy + lab.a / 500),
        white.Y * lab_f_inverse(fy),
        white.Z * lab_f_inverse(fy - lab.b / 200),
    };
}

struct lch lch_of(struct lab lab)
{
    double h = lab.a == 0 && lab.b == 0 ? 0 : atan2(lab.b, lab.a) * DEGREES;
    return (struct lch){lab.L, hypot(lab.a, lab.b), h < 0 ? h + 360 : h};
}

double delta_e_ab(struct lab a, struct lab b)
{
    return hypot(a.L - b.L, hypot(a.a - b.a, a.b - b.b));
}
