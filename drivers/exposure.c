// SPDX-License-Identifier: Apache-2.0
#include "drivers/exposure.h"

#include <math.h>

enum { MANY_SATURATED = 200, FINE_US = 10, COARSE_US = 1000, COARSE_FROM_US = 655000 };

static const double aim = 0.85, lowest = 0.78, highest = 0.92;
static const double upward = 0.88; // below highest by more than noise
static const double most_up = 8, clear_of_saturation = 0.8, weary_down = 0.7;
static const double other_light = 1.5;

// The shortest multiple of half a mains period that the instrument can hold.
static double period(const struct exposure_limits *limits)
{
    const double half = 0.5e6 / limits->mains_hz;
    for (int k = 1; k <= 10; k++) {
        double units = k * half / limits->base_us;
        if (limits->base_us <= FINE_US || fabs(units - rint(units)) < 1e-3)
            return k * half;
    }
    return half;
}

static double within(double us, const struct exposure_limits *limits)
{
    return fmin(fmax(us, limits->least_us), limits->longest_us);
}

int exposure_hold(double us, const struct exposure_limits *limits)
{
    us = within(us, limits);
    double step = fmax(us > COARSE_FROM_US ? COARSE_US : FINE_US, limits->base_us);
    us = rint(us / step) * step;
    return (int)(us < limits->least_us ? us + step : us);
}

int exposure_round(double us, const struct exposure_limits *limits)
{
    const double whole = period(limits);
    us = within(us, limits);
    return exposure_hold(us >= whole ? whole * floor(us / whole + 1e-6) : us, limits);
}

// What saturated would not any more, or the signal is not that of the rest.
static void notice_other_light(struct exposure *e, double rate, double dark)
{
    bool dimmer = e->saturating_us > 0 && dark + rate * e->saturating_us < 1 / other_light;
    bool another = e->rest_rate > 0 &&
                   (rate > e->rest_rate * other_light || rate * other_light < e->rest_rate);
    if (dimmer || another)
        *e = (struct exposure){0};
}

static int after_saturation(struct exposure *e, const struct exposure_seen *seen,
                            const struct exposure_limits *limits)
{
    double down = seen->saturated > MANY_SATURATED ? 1 / 16.0 : 1 / 4.0;
    if (e->changes >= EXPOSURE_CHANGES_MOST)
        down = weary_down;
    if (!e->saturating_us || seen->us < e->saturating_us)
        e->saturating_us = seen->us;
    return exposure_round(seen->us * down, limits);
}

// One period more than exposure_round takes is better when it stays unsaturated.
static int towards_aim(const struct exposure_seen *seen, double most_us,
                       const struct exposure_limits *limits)
{
    double light = seen->peak - seen->dark, whole = period(limits);
    double gain = light > 0 ? fmin((aim - seen->dark) / light, most_up) : most_up;
    double us = fmin(seen->us * gain, most_us);
    int next = exposure_round(us, limits), more = exposure_round(next + whole, limits);
    bool fits = seen->dark + light * more / seen->us <= upward && more <= most_us;
    return us >= whole && fits ? more : next;
}

int exposure_next(struct exposure *e, const struct exposure_seen *seen,
                  const struct exposure_limits *limits)
{
    int next = seen->us;
    double rate = (seen->peak - seen->dark) / seen->us;
    if (!seen->saturated)
        notice_other_light(e, rate, seen->dark);
    bool fine = seen->peak >= lowest && seen->peak <= highest;
    if (seen->saturated)
        next = after_saturation(e, seen, limits);
    else if (!fine && e->changes < EXPOSURE_CHANGES_MOST)
        next = towards_aim(
            seen, e->saturating_us ? clear_of_saturation * e->saturating_us : limits->longest_us,
            limits);
    if (next > limits->longest_us) // less time was given: no change of light
        return exposure_round(limits->longest_us, limits);
    if (next != seen->us)
        e->changes++;
    else if (!seen->saturated && e->rest_rate <= 0)
        e->rest_rate = fmax(rate, 1e-12);
    return next;
}
