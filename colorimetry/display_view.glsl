// SPDX-License-Identifier: Apache-2.0
// How a display's light depends on the direction it is seen from and on the
// place on the screen: the scalar steps, once for GLSL 3.30 and C. The
// includer defines `real`, view_root(x), view_exp(x), and
//   view_node(channel, column, row)  gain at a node of the dense grid, 0..32
//   view_handle                      int, or the model's pointer in C
// Source: direction cosines as the natural variables of a polynomial in the
// angle: IDMS 1.03 (2012), 9; the logarithm keeps the gain above zero.
// Not included: polarisation, a channel's own colour shifting with the angle.

#ifdef __STDC__
#define VIEW_PURE static inline
#define view_whole(x) ((int)(x))
#else
#define VIEW_PURE
#define view_whole(x) int(x)
#endif
#ifndef view_handle
#define view_handle int
#endif
#define VIEW_DENSE_LAST 32

// Factor that brings direction cosines back to the outermost measured
// direction, 1 within it.
VIEW_PURE real view_held(real u, real v, real sine_most)
{
    real s = u * u + v * v;
    real one = 1;
    return s > sine_most * sine_most ? sine_most / view_root(s) : one;
}

// Gain over that along the normal, of a direction to the eye whose cosines
// with the screen's x and y are u and v.
VIEW_PURE real view_angle(real a0, real a1, real a2, real a3, real a4, real a5, real a6,
                          real u, real v)
{
    real s = u * u + v * v;
    return view_exp(a0 * u + a1 * v + a2 * u * u + a3 * u * v + a4 * v * v + a5 * s * s +
                    a6 * s * s * s);
}

// Gain over that of the centre at a place 0..1 from the left and from the top:
// linear between the nodes of the dense grid.
VIEW_PURE real view_place(view_handle channel, real x, real y)
{
    real none = 0, one = 1;
    real across = (x > none ? (x < one ? x : one) : none) * VIEW_DENSE_LAST;
    real down = (y > none ? (y < one ? y : one) : none) * VIEW_DENSE_LAST;
    int column = view_whole(across);
    int row = view_whole(down);
    if (column > VIEW_DENSE_LAST - 1)
        column = VIEW_DENSE_LAST - 1;
    if (row > VIEW_DENSE_LAST - 1)
        row = VIEW_DENSE_LAST - 1;
    real right = across - column;
    real low = down - row;
    real above = view_node(channel, column, row) * (1 - right) +
                 view_node(channel, column + 1, row) * right;
    real below = view_node(channel, column, row + 1) * (1 - right) +
                 view_node(channel, column + 1, row + 1) * right;
    return above * (1 - low) + below * low;
}
