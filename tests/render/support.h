// SPDX-License-Identifier: Apache-2.0
// What the tests of render/ share: cmocka, comparisons, made-up light maps, a
// made-up display.
#ifndef TESTS_RENDER_SUPPORT_H
#define TESTS_RENDER_SUPPORT_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "colorimetry/display.h"
#include "render/lights.h"
#include "render/scene.h"

// Last: it turns fail() into a macro.
#include <cmocka.h>

#define assert_float_within(got, wanted, tolerance)                                                \
    do {                                                                                           \
        double got_ = (got), wanted_ = (wanted), tolerance_ = (tolerance);                         \
        if (!(fabs(got_ - wanted_) <= tolerance_))                                                 \
            fail_msg("%s = %.17g, wanted %.17g within %g", #got, got_, wanted_, tolerance_);       \
    } while (0)

#define assert_relative(got, wanted, tolerance)                                                    \
    assert_float_within(got, wanted, (tolerance)*fabs((double)(wanted)))

#define assert_good(call, err)                                                                     \
    do {                                                                                           \
        if (!(call))                                                                               \
            fail_msg("%s: %s", #call, (err).text);                                                 \
    } while (0)

// The ceiling of the emulated booth.
static inline struct ceiling booth_ceiling(void)
{
    return (struct ceiling){{0, 0.75, 0.05}, 0.90, 0.60};
}

// luminance(u, v) with u, v in 0..1 from left to right, from far to near.
static inline struct luminance_map map_from(struct ceiling ceiling, int width, int height,
                                            double (*luminance)(double u, double v))
{
    struct luminance_map map = {.ceiling = ceiling, .width = width, .height = height};
    map.luminance = malloc((size_t)width * height * sizeof *map.luminance);
    for (int i = 0; i < width * height; i++)
        map.luminance[i] =
            luminance((i % width + 0.5) / width, (double)(i / width) / height + 0.5 / height);
    return map;
}

static inline double uniform_light(double u, double v)
{
    (void)u;
    (void)v;
    return 3000;
}

static inline double no_light(double u, double v)
{
    return 0 * (u + v);
}

// Three tubes along x behind a diffuser.
static inline double tubes(double u, double v)
{
    double sum = 200;
    for (int i = 0; i < 3; i++) {
        double across = (v - (0.2 + 0.3 * i)) / 0.035;
        sum += 9000 * exp(-across * across) / (1 + exp((fabs(u - 0.5) - 0.42) / 0.02));
    }
    return sum;
}

// Four small lamps on a dim ceiling.
static inline double spots(double u, double v)
{
    double sum = 20;
    for (int i = 0; i < 4; i++) {
        double du = (u - (0.2 + 0.2 * i)) / 0.03, dv = (v - (i % 2 ? 0.3 : 0.7)) / 0.045;
        sum += 60000 * exp(-du * du - dv * dv);
    }
    return sum;
}

// A panel of 900 cd/m2 with primaries between sRGB and P3 and unequal curves.
static inline struct display_model panel(void)
{
    static const double primaries[3][4] = {
        {410, 270, 175, 0.35}, {200, 630, 70, 0.38}, {5, 45, 920, 0.45}};
    static const double gamma[3] = {2.2, 2.35, 2.05};
    struct display_model model = {.name = "made up for tests"};
    struct error err = {0};
    memcpy(model.matrix, primaries, sizeof primaries);
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < DISPLAY_NODES; k++) {
            double x = (double)k / (DISPLAY_NODES - 1);
            model.curve[c][k] = 0.98 * pow(x, gamma[c]) + 0.02 * x;
        }
        model.curve[c][0] = 0;
        model.curve[c][DISPLAY_NODES - 1] = 1;
    }
    if (!display_model_prepare(&model, &err))
        fail_msg("panel: %s", err.text);
    return model;
}

#endif
