// SPDX-License-Identifier: Apache-2.0
#version 330 core
// What every shader of boothd starts with: the scalar formula files that
// follow are shared with C.
#define real float
#define curve_node(curve, index) texelFetch(curves, ivec2(index, curve), 0).r
#define view_root sqrt
#define view_exp exp
#define view_node(channel, column, row) texelFetch(view_places, ivec2(column, row), 0)[channel]
uniform sampler2D view_places; // gains of red, green, blue and black at the dense grid
uniform sampler2D curves; // linear light at the display's nodes: red, green, blue, a row each
