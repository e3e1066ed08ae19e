// SPDX-License-Identifier: Apache-2.0
// From XYZ that the screen must emit to linear light of its channels: the
// inverse of whichever display model was kept (colorimetry/display.h). Goes on
// where display.glsl ends; render/display_gl.c fills the uniforms. A program
// holds one kind of model, DISPLAY_KIND: 0 day, 1 interaction, 2 residual.

uniform vec3 black;        // the matrix's fourth column, cd/m2
uniform vec3 from_xyz[3];  // rows: XYZ less black to plain Day's linear light
uniform float tolerance; // of the gamut test, in linear light

vec3 inverse_day(vec3 target, vec4 gains)
{
    vec3 d = target - black * gains.a;
    vec3 light = vec3(
        display_inverse_row(from_xyz[0].x, from_xyz[0].y, from_xyz[0].z, d.x, d.y, d.z),
        display_inverse_row(from_xyz[1].x, from_xyz[1].y, from_xyz[1].z, d.x, d.y, d.z),
        display_inverse_row(from_xyz[2].x, from_xyz[2].y, from_xyz[2].z, d.x, d.y, d.z));
    return light / gains.rgb;
}

#if DISPLAY_KIND == 1

uniform vec3 crosstalk[6]; // linear light by term

// What the channels take from and give to each other at l.
vec3 inverse_terms(vec3 l)
{
    vec3 c = vec3(display_clamped(l.r), display_clamped(l.g), display_clamped(l.b));
    return crosstalk[0] * display_share(c.r, c.g) + crosstalk[1] * display_share(c.g, c.b) +
           crosstalk[2] * display_share(c.b, c.r) + crosstalk[3] * display_bend(c.r) +
           crosstalk[4] * display_bend(c.g) + crosstalk[5] * display_bend(c.b);
}

// Their slopes by each channel, and 1 on the diagonal.
mat3 inverse_slopes(vec3 l)
{
    vec3 c = vec3(display_clamped(l.r), display_clamped(l.g), display_clamped(l.b));
    vec3 red = display_inside(l.r, 1.0) *
               (crosstalk[0] * display_share_slope(c.r, c.g) +
                crosstalk[2] * display_share_slope(c.r, c.b) + crosstalk[3] * (1.0 - 2.0 * c.r));
    vec3 green = display_inside(l.g, 1.0) *
                 (crosstalk[0] * display_share_slope(c.g, c.r) +
                  crosstalk[1] * display_share_slope(c.g, c.b) + crosstalk[4] * (1.0 - 2.0 * c.g));
    vec3 blue = display_inside(l.b, 1.0) *
                (crosstalk[1] * display_share_slope(c.b, c.g) +
                 crosstalk[2] * display_share_slope(c.b, c.r) + crosstalk[5] * (1.0 - 2.0 * c.b));
    return mat3(1.0) + mat3(red, green, blue);
}

// The light l with l + terms(l) = day, by Newton's method. For what the model
// may add (display_fold) four steps end in single precision.
vec3 inverse_addition(vec3 day)
{
    vec3 l = day;
    for (int i = 0; i < 4; i++)
        l += inverse(inverse_slopes(l)) * (day - l - inverse_terms(l));
    return l;
}

#elif DISPLAY_KIND == 2

uniform sampler2D table; // 64 nodes a row, of four texels: linear light to add, its slopes by red,
                         // green, blue
uniform vec3 table_least, table_scale;
uniform int table_side;

vec3 inverse_texel(int node, int which)
{
    return texelFetch(table, ivec2(((node & 63) << 2) + which, node >> 6), 0).rgb;
}

vec3 inverse_addition(vec3 day)
{
    display_corners at = display_find(display_axis(day.r, table_least.r, table_scale.r, table_side),
                                      display_axis(day.g, table_least.g, table_scale.g, table_side),
                                      display_axis(day.b, table_least.b, table_scale.b, table_side),
                                      table_side);
    vec3 sum = day;
    for (int n = 0; n < 4; n++)
        sum += at.value[n] * inverse_texel(at.node[n], 0) +
               at.by_red[n] * inverse_texel(at.node[n], 1) +
               at.by_green[n] * inverse_texel(at.node[n], 2) +
               at.by_blue[n] * inverse_texel(at.node[n], 3);
    return sum;
}

#else

vec3 inverse_addition(vec3 day)
{
    return day;
}

#endif

// Linear light, beyond 0..1 where the target is out of gamut. gains: of red,
// green, blue and black towards the eye.
vec3 inverse_linear(vec3 target, vec4 gains)
{
    return inverse_addition(inverse_day(target, gains));
}

bool inverse_outside(vec3 linear)
{
    return display_outside(linear.r, tolerance) || display_outside(linear.g, tolerance) ||
           display_outside(linear.b, tolerance);
}
