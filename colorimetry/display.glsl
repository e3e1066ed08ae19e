// SPDX-License-Identifier: Apache-2.0
// The display model's scalar steps, once for GLSL 3.30, float C and double C.
// Source: Day, Taplin, Berns 2004 (Color Res. Appl. 29, 365-373).
// Not included: viewing angle, gamut mapping, the dither pattern itself.
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
#define DISPLAY_CORNERS struct display_corners
#define display_whole(x) ((int)(x))
#define display_cube_root(x) ((real)cbrt(x))
#else
#define DISPLAY_PURE
#define DISPLAY_CORNERS display_corners
#define display_whole(x) int(x)
#define display_cube_root(x) pow(x, 1.0 / 3.0)
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

// ---- channels that disturb each other (colorimetry/display.h) ---------------

// What two channels' linear lights, 0..1, share: their harmonic mean.
DISPLAY_PURE real display_share(real a, real b)
{
    real stop = 1e-3; // where two channels stop sharing
    return 2 * a * b / (a + b + stop);
}

// Its slope by a, 0..2.
DISPLAY_PURE real display_share_slope(real a, real b)
{
    real stop = 1e-3;
    real sum = a + b + stop;
    return 2 * (b / sum) * ((b + stop) / sum);
}

// How far a primary's chromaticity has moved from that at its ends.
DISPLAY_PURE real display_bend(real a)
{
    return a * (1 - a);
}

// Slope of what is clamped to 0..1: slope inside, 0 beyond.
DISPLAY_PURE real display_inside(real a, real slope)
{
    real none = 0;
    return a >= none && a <= 1 ? slope : none;
}

// ---- a table over plain Day's linear light ----------------------------------

// The corners of the tetrahedron around a place in a cube of side * side * side
// nodes: how much of each corner's value, and of its slopes by red, green and
// blue, makes the value at the place. Half of each corner's slopes times the way
// from there turns linear interpolation into one that is exact for quadratic
// forms: the corners' curvature then cancels.
// Source of the tetrahedra: Kasson, Nin, Plouffe, Hafner 1995 (J. Electronic
// Imaging 4, 226-250).
struct display_corners {
    int node[4];
    real value[4], by_red[4], by_green[4], by_blue[4];
};

// Place in nodes from the first, 0..side - 1, of a linear light on an axis whose
// nodes stand evenly in the cube root of light, from least, `scale` a unit.
DISPLAY_PURE real display_axis(real light, real least, real scale, int side)
{
    real none = 0, last = side - 1;
    real root = light < none ? -display_cube_root(-light) : display_cube_root(light);
    real at = (root - least) * scale;
    if (!(at > none))
        return none;
    return at < last ? at : last;
}

// Places as display_axis gives them; node = (red * side + green) * side + blue.
DISPLAY_PURE DISPLAY_CORNERS display_find(real red, real green, real blue, int side)
{
    DISPLAY_CORNERS found;
    real half_slope = 0.5;
    int i = display_whole(red) < side - 1 ? display_whole(red) : side - 2;
    int j = display_whole(green) < side - 1 ? display_whole(green) : side - 2;
    int k = display_whole(blue) < side - 1 ? display_whole(blue) : side - 2;
    real x = red - i, y = green - j, z = blue - k;
    bool xy = x >= y, yz = y >= z, xz = x >= z;
    // From the cell's lowest corner along the axis of the largest part first,
    // along that of the smallest last.
    int first = xy ? (xz ? 0 : 2) : (yz ? 1 : 2);
    int last = yz ? (xz ? 2 : 0) : (xy ? 1 : 0);
    real high = xy ? (xz ? x : z) : (yz ? y : z);
    real low = yz ? (xz ? z : x) : (xy ? y : x);
    real middle = x + y + z - high - low;
    found.node[0] = (i * side + j) * side + k;
    found.node[1] = found.node[0] + (first == 0 ? side * side : first == 1 ? side : 1);
    found.node[3] = found.node[0] + side * side + side + 1;
    found.node[2] = found.node[3] - (last == 0 ? side * side : last == 1 ? side : 1);
    found.value[0] = 1 - high;
    found.value[1] = high - middle;
    found.value[2] = middle - low;
    found.value[3] = low;
    for (int n = 0; n < 4; n++) {
        real share = half_slope * found.value[n];
        int r = n == 3 || (n == 1 && first == 0) || (n == 2 && last != 0) ? 1 : 0;
        int g = n == 3 || (n == 1 && first == 1) || (n == 2 && last != 1) ? 1 : 0;
        int b = n == 3 || (n == 1 && first == 2) || (n == 2 && last != 2) ? 1 : 0;
        found.by_red[n] = share * (x - r);
        found.by_green[n] = share * (y - g);
        found.by_blue[n] = share * (z - b);
    }
    return found;
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
