// SPDX-License-Identifier: Apache-2.0
// The display model's scalar steps, once for GLSL 3.30, float C and double C.
// Source: Day, Taplin, Berns 2004 (Color Res. Appl. 29, 365-373).
// Not included: channel interaction, viewing angle, gamut mapping, the dither
// pattern itself.
//
// An includer defines, before this file:
//   real                      float or double
//   curve_node(curve, index)  linear light at node index 0..1020 of one of the
//                             three curves; strictly rising from 0 to 1
//   curve_handle              type that names a curve: int (the default; 0, 1,
//                             2), or a pointer to the nodes in C
// A node stands at index/1020 of full code. Every function is pure and named
// display_*. Constants are whole numbers, which both languages turn into real,
// so that float C never widens to double.

#ifdef __STDC__
#define DISPLAY_PURE static inline
#define display_whole(x) ((int)(x))
#else
#define DISPLAY_PURE
#define display_whole(x) int(x)
#endif
#ifndef curve_handle
#define curve_handle int
#endif
#define DISPLAY_LAST 1020

// x within 0..1; 0 for what is not a number.
DISPLAY_PURE real display_clamped(real x)
{
    real least = 0, most = 1;
    if (!(x > least))
        return least;
    return x < most ? x : most;
}

// Linear light of a count 0..1 (fraction of full code): linear between nodes.
DISPLAY_PURE real display_light(curve_handle curve, real count)
{
    real at = display_clamped(count) * DISPLAY_LAST;
    int node = display_whole(at);
    if (node > DISPLAY_LAST - 1)
        node = DISPLAY_LAST - 1;
    real low = curve_node(curve, node);
    real high = curve_node(curve, node + 1);
    return low + (high - low) * (at - node);
}

// Count 0..1 of a linear light: bisection to the segment, then linear.
// display_count(curve, display_light(curve, x)) = x.
DISPLAY_PURE real display_count(curve_handle curve, real light)
{
    real wanted = display_clamped(light);
    int low = 0;
    int high = DISPLAY_LAST;
    for (int step = 0; step < 10; step++) {
        int middle = (low + high) / 2;
        if (curve_node(curve, middle) > wanted)
            high = middle;
        else
            low = middle;
    }
    high = low + 1;
    real below = curve_node(curve, low);
    real above = curve_node(curve, high);
    return (low + display_clamped((wanted - below) / (above - below))) / DISPLAY_LAST;
}

// One row of (r g b 1) -> XYZ: tristimulus values in cd/m2 from linear light.
DISPLAY_PURE real display_row(real red, real green, real blue, real black, real r, real g, real b)
{
    return red * r + green * g + blue * b + black;
}

// One row of the inverse: linear light from XYZ in cd/m2 less the model's
// black. Outside 0..1 the target is out of gamut: flag it (display_outside)
// before display_count clamps it.
DISPLAY_PURE real display_inverse_row(real x, real y, real z, real X, real Y, real Z)
{
    return x * X + y * Y + z * Z;
}

// Whether a linear light lies outside 0..1 by more than tolerance, or is not a
// number.
DISPLAY_PURE bool display_outside(real light, real tolerance)
{
    return !(light >= -tolerance && light <= 1 + tolerance);
}

// Whole code 0..most of a count 0..1. threshold is 1/2 for rounding (half goes
// up), else the dither's 0 <= threshold < 1, uniform over the screen.
DISPLAY_PURE real display_code(real count, real most, real threshold)
{
    real code = display_whole(display_clamped(count) * most + threshold);
    return code < most ? code : most;
}
