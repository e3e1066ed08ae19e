// SPDX-License-Identifier: Apache-2.0
// From illuminance and material to XYZ that the screen must emit, and on to
// its digital counts. Assembled after display.glsl, diffuse.glsl, output.glsl,
// inverse.glsl.

uniform sampler2D illuminance; // lux at the taught level, per pixel
uniform sampler2D texels;      // relative XYZ of the material
uniform isampler2D places;     // row 0: texel column of a pixel column, row 1: texel row of a
                               // pixel row; -1 outside the material
uniform isampler2D ranks;      // the dither tile
uniform float level;
uniform vec3 white;
uniform float screen_reflectance;
uniform float code_most; // 255 or 1023
uniform bool dithered;
uniform int height;
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
    vec3 linear = inverse_linear(target, viewed ? view_gains(from_below) : vec4(1.0));
    emitted = vec4(target, inverse_outside(linear) ? 1.0 : 0.0);
    counts.r = code_of(0, linear.r, pixel, ivec2(0, 0));
    counts.g = code_of(1, linear.g, pixel, ivec2(23, 41));
    counts.b = code_of(2, linear.b, pixel, ivec2(47, 17));
}
