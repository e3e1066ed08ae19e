// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/classifier.h"

#include <math.h>
#include <stdlib.h>

#include "colorimetry/colour.h"

#define DARK_LUX 5.0
#define DISTANCE 0.01
#define CONFIRMATIONS 2
#define HYSTERESIS 1.25
#define SPREAD_SHARE (1.0 / 3) // noise that is left of a nm's in a band
#define MOST_SHIFT_NM 0.7
#define MOST_TILT_K 60.0
#define FLOOR 0.02 // of the mean band: below it noise rules
#define C2_NM_K 1.4388e7

enum {
    SHAPE_FIRST_NM = 400,
    SHAPE_STEP_NM = 10,
    SHAPE_HALF_NM = 15,
    SHAPE_COUNT = 33,
    FIT_ROUNDS = 30
};

struct shape {
    double v[SHAPE_COUNT];
};

// Overlapping triangles, so that no spectral line stands on an edge.
static struct shape shape_of(const struct spectrum *s)
{
    struct shape out = {{0}};
    for (int k = 0; k < SHAPE_COUNT; k++) {
        int centre = SHAPE_FIRST_NM - SPECTRUM_FIRST_NM + SHAPE_STEP_NM * k;
        for (int d = 1 - SHAPE_HALF_NM; d < SHAPE_HALF_NM; d++)
            out.v[k] += s->v[centre + d] * (SHAPE_HALF_NM - abs(d)) / SHAPE_HALF_NM;
    }
    return out;
}

static double dot(const struct shape *a, const struct shape *b)
{
    double sum = 0;
    for (int k = 0; k < SHAPE_COUNT; k++)
        sum += a->v[k] * b->v[k];
    return sum;
}

static void weigh(struct shape *s, const struct shape *weight)
{
    for (int k = 0; k < SHAPE_COUNT; k++)
        s->v[k] *= weight->v[k];
}

// Change of a spectrum as all its lines move up by 1 nm.
static struct shape shifted(const struct spectrum *s)
{
    struct spectrum d = {{0}};
    for (int i = 1; i < SPECTRUM_COUNT - 1; i++)
        d.v[i] = (s->v[i - 1] - s->v[i + 1]) / 2;
    return shape_of(&d);
}

// McCamy 1992: good enough to bound a change of temperature.
static double kelvin_of(const struct spectrum *s)
{
    struct xy c = xy_of(xyz_relative(s, NULL, OBSERVER_1931_2));
    double n = (c.x - 0.3320) / (0.1858 - c.y);
    return fmin(fmax(((449 * n + 3525) * n + 6823.3) * n + 5520.33, 1500), 20000);
}

// Change of a spectrum as it grows hotter by 1 K, by Wien's law.
static struct shape heated(const struct spectrum *s)
{
    struct spectrum d;
    double kelvin = kelvin_of(s), k = C2_NM_K / (kelvin * kelvin);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        d.v[i] = s->v[i] * k * (1.0 / (SPECTRUM_FIRST_NM + i) - 1.0 / 560);
    return shape_of(&d);
}

static double bounded(double v, double most)
{
    return fmin(fmax(v, -most), most);
}

// Best multiple of `along` in what live / gain has more than rest + kept.
static double share(const struct shape *live, double gain, const struct shape *rest,
                    const struct shape *kept, double amount, const struct shape *along)
{
    double square = dot(along, along);
    double over = dot(live, along) / gain - dot(rest, along) - amount * dot(kept, along);
    return square > 0 ? over / square : 0;
}

static double left_over(const struct shape *live, const struct shape *taught,
                        const struct shape *shift, const struct shape *heat)
{
    double gain = dot(taught, live) / dot(taught, taught), nm = 0, kelvin = 0;
    struct shape fit = *taught;
    for (int round = 0; round < FIT_ROUNDS && gain > 0; round++) {
        nm = bounded(share(live, gain, taught, heat, kelvin, shift), MOST_SHIFT_NM);
        kelvin = bounded(share(live, gain, taught, shift, nm, heat), MOST_TILT_K);
        for (int k = 0; k < SHAPE_COUNT; k++)
            fit.v[k] = taught->v[k] + nm * shift->v[k] + kelvin * heat->v[k];
        gain = dot(&fit, live) / dot(&fit, &fit);
    }
    struct shape left;
    for (int k = 0; k < SHAPE_COUNT; k++)
        left.v[k] = live->v[k] - gain * fit.v[k];
    return sqrt(dot(&left, &left) / dot(live, live));
}

double lamp_distance(const struct spectrum *taught, const struct spectrum *live)
{
    struct shape a = shape_of(taught), b = shape_of(live), weight;
    struct shape shift = shifted(taught), heat = heated(taught);
    double mean = 0;
    for (int k = 0; k < SHAPE_COUNT; k++)
        mean += fmax(a.v[k], 0) / SHAPE_COUNT;
    if (!(mean > 0) || !(dot(&b, &b) > 0))
        return 1;
    for (int k = 0; k < SHAPE_COUNT; k++)
        weight.v[k] = 1 / sqrt(fmax(a.v[k], 0) / mean + FLOOR);
    weigh(&a, &weight);
    weigh(&b, &weight);
    weigh(&shift, &weight);
    weigh(&heat, &weight);
    double distance = left_over(&b, &a, &shift, &heat);
    return distance <= 1 ? distance : 1;
}

void classifier_reset(struct classifier *c)
{
    c->dark_lux = DARK_LUX;
    c->distance = DISTANCE;
    c->confirmations = CONFIRMATIONS;
    c->verdict = c->candidate = LAMP_NONE;
    c->index = c->candidate_index = -1;
    c->candidate_count = 0;
}

// One reading, judged by itself.
struct reading {
    double lux;
    double distance[CLASSIFIER_LAMPS_MOST];
    int nearest; // -1 without lamps
    enum lamp_verdict verdict;
    int index;
};

static double lux_of(const struct spectrum *irradiance)
{
    return xyz_absolute(irradiance, OBSERVER_1931_2).Y;
}

double lamp_limit(double threshold, double spread)
{
    return threshold + spread * SPREAD_SHARE;
}

static double limit_of(const struct classifier *c, int i)
{
    return lamp_limit(c->distance, c->lamps[i].spread);
}

// Distance in units of the lamp's limit; what is believed counts as nearer.
static double strangeness(const struct classifier *c, const struct reading *r, int i)
{
    double s = r->distance[i] / limit_of(c, i);
    return c->verdict == LAMP_KNOWN && c->index == i ? s / HYSTERESIS : s;
}

static struct reading judge(const struct classifier *c, const struct spectrum *irradiance)
{
    struct reading r = {.lux = lux_of(irradiance), .nearest = -1, .index = -1};
    for (int i = 0; i < c->count; i++) {
        r.distance[i] = lamp_distance(&c->lamps[i].irradiance, irradiance);
        if (r.nearest < 0 || strangeness(c, &r, i) < strangeness(c, &r, r.nearest))
            r.nearest = i;
    }
    double dark = c->verdict == LAMP_NONE ? c->dark_lux * HYSTERESIS : c->dark_lux;
    bool near = r.nearest >= 0 && strangeness(c, &r, r.nearest) <= 1;
    r.verdict = r.lux < dark ? LAMP_NONE : near ? LAMP_KNOWN : LAMP_UNKNOWN;
    if (r.verdict == LAMP_KNOWN)
        r.index = r.nearest;
    return r;
}

static void follow(struct classifier *c, const struct reading *r)
{
    if (r->verdict == c->verdict && r->index == c->index) {
        c->candidate_count = 0;
        return;
    }
    bool again = c->candidate_count > 0 && r->verdict == c->candidate &&
                 r->index == c->candidate_index;
    c->candidate = r->verdict;
    c->candidate_index = r->index;
    c->candidate_count = again ? c->candidate_count + 1 : 1;
    if (c->candidate_count < c->confirmations)
        return;
    c->verdict = r->verdict;
    c->index = r->index;
    c->candidate_count = 0;
}

// How far a reading speaks for a lamp: against its limit, and against the others.
static double confidence_in(const struct classifier *c, const struct reading *r, int lamp)
{
    double mine = r->distance[lamp] / limit_of(c, lamp), sure = 1 - mine / 2;
    for (int i = 0; i < c->count; i++) {
        double other = r->distance[i] / limit_of(c, i);
        if (i != lamp)
            sure = fmin(sure, other > 0 ? other / (mine + other) : mine > 0 ? 0 : 0.5);
    }
    return fmax(sure, 0);
}

static double confidence(const struct classifier *c, const struct reading *r)
{
    double dark = r->lux / c->dark_lux; // 1 at the limit
    double strange = r->nearest < 0 ? INFINITY
                                    : r->distance[r->nearest] / limit_of(c, r->nearest);
    switch (c->verdict) {
    case LAMP_NONE:
        return dark > 1 ? 0.5 / dark : 1 - fmax(dark, 0) / 2;
    case LAMP_KNOWN:
        return dark < 1 ? fmax(dark, 0) / 2 : confidence_in(c, r, c->index);
    case LAMP_UNKNOWN:
        return dark < 1 ? fmax(dark, 0) / 2 : strange > 1 ? 1 - 0.5 / strange : strange / 2;
    }
    return 0;
}

struct lamp_belief classifier_update(struct classifier *c, const struct spectrum *irradiance)
{
    struct reading r = judge(c, irradiance);
    follow(c, &r);
    double taught = c->verdict == LAMP_KNOWN ? lux_of(&c->lamps[c->index].irradiance) : 0;
    return (struct lamp_belief){
        .verdict = c->verdict,
        .index = c->index,
        .confidence = confidence(c, &r),
        .level = taught > 0 ? r.lux / taught : 0,
        .distance = r.nearest >= 0 ? r.distance[r.nearest] : 1,
    };
}
