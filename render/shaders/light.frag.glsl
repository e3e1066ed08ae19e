// SPDX-License-Identifier: Apache-2.0
// Illuminance on every pixel of the screen at the lamp's taught level, lux.
// Everything is in the screen's own frame, where its normal is (0, 0, 1).

uniform sampler2D lights; // 64 a row: place in m, candela
uniform int light_count;
uniform vec3 down;        // unit
out float illuminance;

void main()
{
    vec2 p = corner_m + gl_FragCoord.xy * pixel_m;
    float sum = 0.0;
    for (int i = 0; i < light_count; i++) {
        vec4 light = texelFetch(lights, ivec2(i % 64, i / 64), 0);
        sum += diffuse_point(light.x - p.x, light.y - p.y, light.z, 0.0, 0.0, 1.0, down.x, down.y,
                             down.z, light.w);
    }
    illuminance = output_finite(sum);
}
