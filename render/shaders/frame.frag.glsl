// SPDX-License-Identifier: Apache-2.0
// From illuminance and material to XYZ that the screen must emit, and on to
// its digital counts. Assembled after display.glsl, diffuse.glsl, output.glsl.

uniform sampler2D illuminance; // lux at the taught level, per pixel
uniform sampler2D texels;      // relative XYZ of the material
uniform isampler2D places;     // row 0: texel column of a pixel column, row 1: texel row of a
                               // pixel row; -1 outside the material
uniform isampler2D ranks;      // the dither tile
uniform float level;
uniform vec3 white;
uniform float screen_reflectance;
uniform vec3 black;      // of the display, cd/m2
uniform vec3 from_xyz[3]; // rows: XYZ less black to linear light
uniform bool viewed;       // whether direction and place count
uniform vec3 eye;          // in the screen's frame, m
uniform vec2 pixel_m;      // size of a pixel
uniform vec2 corner_m;     // bottom left corner of the screen
uniform float view_angles[28]; // red, green, blue, black: seven terms each
uniform float view_sine_most;
uniform float code_most; // 255 or 1023
uniform bool dithered;
uniform int height;
uniform float tolerance; // of the gamut test, in linear light
layout(location = 0) out vec4 emitted; // XYZ in cd/m2, 1 where out of gamut
layout(location = 1) out vec4 counts;  // whole codes / code_most

// Each channel takes the tile from elsewhere, so that their noise differs.
float threshold(ivec2 pixel, ivec2 shift)
{
    if (!dithered)
        return 0.5;
    ivec2 at = (pixel + shift) & 63;
    return (float(texelFetch(ranks, at, 0).r) + 0.5) / 4096.0;
}

float emitted_of(float relative, float white_relative, float lux)
{
    return output_finite(output_emitted(output_surface(relative, lux), screen_reflectance,
                                        white_relative, lux));
}

float code_of(int channel, float linear, ivec2 pixel, ivec2 shift)
{
    return display_code(display_count(channel, linear), code_most, threshold(pixel, shift)) /
           code_most;
}

// Gains of red, green, blue and black towards the eye.
vec4 gains_at(ivec2 from_below)
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

void main()
{
    ivec2 from_below = ivec2(gl_FragCoord.xy);
    ivec2 pixel = ivec2(from_below.x, height - 1 - from_below.y);
    int column = texelFetch(places, ivec2(pixel.x, 0), 0).r;
    int row = texelFetch(places, ivec2(pixel.y, 1), 0).r;
    emitted = vec4(0.0);
    counts = vec4(0.0, 0.0, 0.0, 1.0);
    if (column < 0 || row < 0)
        return;

    float lux = texelFetch(illuminance, from_below, 0).r * level;
    vec3 relative = texelFetch(texels, ivec2(column, row), 0).rgb;
    vec3 target = vec3(emitted_of(relative.x, white.x, lux), emitted_of(relative.y, white.y, lux),
                       emitted_of(relative.z, white.z, lux));
    vec4 gains = viewed ? gains_at(from_below) : vec4(1.0);
    vec3 d = target - black * gains.a;
    float r = display_inverse_row(from_xyz[0].x, from_xyz[0].y, from_xyz[0].z, d.x, d.y, d.z);
    float g = display_inverse_row(from_xyz[1].x, from_xyz[1].y, from_xyz[1].z, d.x, d.y, d.z);
    float b = display_inverse_row(from_xyz[2].x, from_xyz[2].y, from_xyz[2].z, d.x, d.y, d.z);
    r /= gains.r;
    g /= gains.g;
    b /= gains.b;
    bool outside = display_outside(r, tolerance) || display_outside(g, tolerance) ||
                   display_outside(b, tolerance);
    emitted = vec4(target, outside ? 1.0 : 0.0);
    counts.r = code_of(0, r, pixel, ivec2(0, 0));
    counts.g = code_of(1, g, pixel, ivec2(23, 41));
    counts.b = code_of(2, b, pixel, ivec2(47, 17));
}
