// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/colour.h"

#include <math.h>

#define RADIANS (M_PI / 180)
#define OPPOSITE_DEG (180 + 1e-9) // opposite hues stay on one branch in spite of rounding
#define BOUND 1e150               // squares of what lies within stay finite

// CIEDE2000 as Sharma, Wu, Dalal 2005 write it, up to the final sum.
struct parts {
    struct delta_lch d;
    double rotation;
};

static struct lab bounded(struct lab c)
{
    return (struct lab){fmin(fmax(c.L, -BOUND), BOUND), fmin(fmax(c.a, -BOUND), BOUND),
                        fmin(fmax(c.b, -BOUND), BOUND)};
}

// sqrt(C^7 / (C^7 + 25^7)), 0 at C = 0.
static double chroma_7(double chroma)
{
    return sqrt(1 / (1 + pow(25 / chroma, 7)));
}

static double hue_difference(double h1, double h2, double product)
{
    if (product == 0)
        return 0;
    double d = h2 - h1;
    if (fabs(d) <= OPPOSITE_DEG)
        return d;
    return d > 0 ? d - 360 : d + 360;
}

static double hue_mean(double h1, double h2, double product)
{
    double sum = h1 + h2;
    if (product == 0)
        return sum;
    if (fabs(h1 - h2) <= OPPOSITE_DEG)
        return sum / 2;
    return sum < 360 ? (sum + 360) / 2 : (sum - 360) / 2;
}

static double cosine(double degrees)
{
    return cos(degrees * RADIANS);
}

static double lightness_weight(double mean)
{
    double d = mean - 50;
    return 1 + 0.015 * d * (d / hypot(sqrt(20), d));
}

static struct parts difference(struct lab one, struct lab two)
{
    one = bounded(one);
    two = bounded(two);
    double g = 1.5 - 0.5 * chroma_7((hypot(one.a, one.b) + hypot(two.a, two.b)) / 2);
    struct lch p = lch_of((struct lab){one.L, g * one.a, one.b});
    struct lch q = lch_of((struct lab){two.L, g * two.a, two.b});
    double product = sqrt(p.C) * sqrt(q.C), chroma = (p.C + q.C) / 2;
    double h = hue_mean(p.h, q.h, product);
    double t = 1 - 0.17 * cosine(h - 30) + 0.24 * cosine(2 * h) + 0.32 * cosine(3 * h + 6) -
               0.20 * cosine(4 * h - 63);
    double turn = (h - 275) / 25;
    double half = hue_difference(p.h, q.h, product) / 2 * RADIANS;
    return (struct parts){
        .d.L = (q.L - p.L) / lightness_weight((p.L + q.L) / 2),
        .d.C = (q.C - p.C) / (1 + 0.045 * chroma),
        .d.H = 2 * product * sin(half) / (1 + 0.015 * chroma * t),
        .rotation = -2 * chroma_7(chroma) * sin(60 * exp(-turn * turn) * RADIANS),
    };
}

struct delta_lch delta_lch_2000(struct lab a, struct lab b)
{
    return difference(a, b).d;
}

double delta_e_2000(struct lab a, struct lab b)
{
    struct parts p = difference(a, b);
    double square = p.d.L * p.d.L + p.d.C * p.d.C + p.d.H * p.d.H + p.rotation * p.d.C * p.d.H;
    return sqrt(fmax(square, 0));
}
