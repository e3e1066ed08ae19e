// SPDX-License-Identifier: Apache-2.0
#version 330 core
// What every shader of boothd starts with: the scalar formula files that
// follow are shared with C.
#define real float
#define curve_node(curve, index) texelFetch(curves, ivec2(index, curve), 0).r
uniform sampler2D curves; // linear light at the display's nodes: red, green, blue, a row each
