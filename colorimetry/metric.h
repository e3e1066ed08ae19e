// SPDX-License-Identifier: Apache-2.0
// CIEDE2000 as a local quadratic form, for least squares: smooth where the
// formula itself is not (at equal colours, across its hue branch).
#ifndef COLORIMETRY_METRIC_H
#define COLORIMETRY_METRIC_H

#include "colorimetry/colour.h"

// Upper triangular U with |U (b - a)| = CIEDE2000(a, b) for b near a = at.
// Always regular.
struct mat3 de00_metric(struct lab at);

// d Lab / d XYZ at a colour; white must be > 0.
struct mat3 lab_slopes(struct xyz c, struct xyz white);

#endif
