// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/metric.h"

#include <math.h>

static double squared(struct lab at, struct vec3 d)
{
    double de = delta_e_2000(at, (struct lab){at.L + d.x, at.a + d.y, at.b + d.z});
    return de * de;
}

static struct mat3 quadratic_form(struct lab at)
{
    const double h = 0.1; // Lab units: large against rounding, small against curvature
    const struct vec3 step[3] = {{h, 0, 0}, {0, h, 0}, {0, 0, h}};
    struct mat3 g;
    for (int i = 0; i < 3; i++)
        g.m[i][i] = squared(at, step[i]) / (h * h);
    for (int i = 0; i < 3; i++)
        for (int j = i + 1; j < 3; j++) {
            double both = squared(at, vec3_add(step[i], step[j])) / (h * h);
            g.m[i][j] = g.m[j][i] = (both - g.m[i][i] - g.m[j][j]) / 2;
        }
    return g;
}

struct mat3 de00_metric(struct lab at)
{
    struct mat3 g = quadratic_form(at);
    struct mat3 u = {{{0}}};
    for (int i = 0; i < 3; i++) {
        double left = g.m[i][i];
        for (int k = 0; k < i; k++)
            left -= u.m[k][i] * u.m[k][i];
        u.m[i][i] = sqrt(fmax(left, 1e-3 * g.m[i][i]));
        for (int j = i + 1; j < 3; j++) {
            double rest = g.m[i][j];
            for (int k = 0; k < i; k++)
                rest -= u.m[k][i] * u.m[k][j];
            u.m[i][j] = rest / u.m[i][i];
        }
    }
    return u;
}

static double f_slope(double c, double white)
{
    const double epsilon = 216.0 / 24389.0;
    const double kappa = 24389.0 / 27.0;
    double t = c / white;
    double root = cbrt(t);
    return (t > epsilon ? 1 / (3 * root * root) : kappa / 116) / white;
}

struct mat3 lab_slopes(struct xyz c, struct xyz white)
{
    double x = f_slope(c.X, white.X);
    double y = f_slope(c.Y, white.Y);
    double z = f_slope(c.Z, white.Z);
    return (struct mat3){{{0, 116 * y, 0}, {500 * x, -500 * y, 0}, {0, 200 * y, -200 * z}}};
}
