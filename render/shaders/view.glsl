// SPDX-License-Identifier: Apache-2.0
// Gains of the display towards the tracked eye: what display_view.glsl says for
// the pixel's own place and direction. render/view_gl.c fills the uniforms.

uniform bool viewed;           // whether direction and place count
uniform vec3 eye;              // in the screen's frame, m
uniform vec2 pixel_m;          // size of a pixel
uniform vec2 corner_m;         // bottom left corner of the screen
uniform float view_angles[28]; // red, green, blue, black: seven terms each
uniform float view_sine_most;

// Red, green, blue, black.
vec4 view_gains(ivec2 from_below)
{
    vec3 to_eye = eye - vec3(corner_m + (vec2(from_below) + 0.5) * pixel_m, 0.0);
    vec2 d = to_eye.xy / length(to_eye);
    d *= view_held(d.x, d.y, view_sine_most);
    vec2 place = (vec2(from_below) + 0.5) * pixel_m / (-2.0 * corner_m);
    vec4 gains;
    for (int c = 0; c < 4; c++)
        gains[c] = view_angle(view_angles[7 * c], view_angles[7 * c + 1], view_angles[7 * c + 2],
                              view_angles[7 * c + 3], view_angles[7 * c + 4],
                              view_angles[7 * c + 5], view_angles[7 * c + 6], d.x, d.y) *
                   view_place(c, place.x, 1.0 - place.y);
    return gains;
}
