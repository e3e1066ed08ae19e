// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/colour.h"

#include <math.h>

#include "colorimetry/illuminant.h"

#define LEAST_K 1000.0
#define MOST_K 100000.0
#define MOST_DUV 0.05
#define TRIANGLE_DUV 0.002   // Ohno 2014: nearer to the locus the triangle is better
#define FINE_RATIO 1.0005    // steps of the last table
#define SEARCH_LEAST_K 800.0 // a little beyond the range, so that its ends are inner points
#define SEARCH_MOST_K 150000.0

enum { STEPS = 24 };

// A point of the Planckian table and its distance from the colour at hand.
struct node {
    double kelvin, u, v, distance;
};

static struct node node_at(double kelvin, double u, double v)
{
    struct spectrum s;
    planck(kelvin, &s);
    struct uv n = uv_of(xyz_relative(&s, NULL, OBSERVER_1931_2));
    n.v *= 2.0 / 3; // CIE 1960 v
    return (struct node){kelvin, n.u, n.v, hypot(u - n.u, v - n.v)};
}

// The three neighbours around the nearest point of a table of equal ratios.
static void nearest_three(double from, double ratio, double u, double v, struct node out[3])
{
    struct node table[STEPS + 1];
    int best = 1;
    for (int i = 0; i <= STEPS; i++) {
        table[i] = node_at(from * pow(ratio, i), u, v);
        if (i > 0 && i < STEPS && table[i].distance < table[best].distance)
            best = i;
    }
    for (int k = 0; k < 3; k++)
        out[k] = table[best - 1 + k];
}

static struct cct triangle(const struct node n[3], double v)
{
    double length = hypot(n[2].u - n[0].u, n[2].v - n[0].v);
    double a = n[0].distance, b = n[2].distance;
    double x = (a * a - b * b + length * length) / (2 * length);
    double foot_v = n[0].v + (n[2].v - n[0].v) * x / length;
    struct cct c = {.kelvin = n[0].kelvin + (n[2].kelvin - n[0].kelvin) * x / length,
                    .duv = sqrt(fmax(a * a - x * x, 0))};
    if (v < foot_v)
        c.duv = -c.duv;
    return c;
}

static struct cct parabola(const struct node n[3], double v)
{
    double t0 = n[0].kelvin, t1 = n[1].kelvin, t2 = n[2].kelvin;
    double slope1 = (n[1].distance - n[0].distance) / (t1 - t0);
    double slope2 = (n[2].distance - n[1].distance) / (t2 - t1);
    double curve = (slope2 - slope1) / (t2 - t0);
    double t = (t0 + t1) / 2 - slope1 / (2 * curve);
    double d = n[0].distance + (t - t0) * (slope1 + curve * (t - t1));
    return (struct cct){.kelvin = t, .duv = v < n[1].v ? -d : d};
}

struct cct cct_of(struct xy c)
{
    double denominator = -2 * c.x + 12 * c.y + 3;
    if (!(c.x > 0 && c.y > 0 && c.x + c.y < 1))
        return (struct cct){0, 0, false};
    double u = 4 * c.x / denominator, v = 6 * c.y / denominator;
    double from = SEARCH_LEAST_K, ratio = pow(SEARCH_MOST_K / SEARCH_LEAST_K, 1.0 / STEPS);
    struct node near[3];
    nearest_three(from, ratio, u, v, near);
    while (ratio > FINE_RATIO) {
        from = near[0].kelvin;
        ratio = pow(near[2].kelvin / near[0].kelvin, 1.0 / STEPS);
        nearest_three(from, ratio, u, v, near);
    }
    struct cct found = triangle(near, v);
    if (fabs(found.duv) >= TRIANGLE_DUV)
        found = parabola(near, v);
    found.valid = fabs(found.duv) <= MOST_DUV && found.kelvin >= LEAST_K && found.kelvin <= MOST_K;
    return found;
}
