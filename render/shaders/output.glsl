// SPDX-License-Identifier: Apache-2.0
// From illuminance to what the screen must emit, per tristimulus value, once
// for GLSL 3.30 and C. The includer defines `real` before this file.
// Source: Lambert's law, L = R E / pi; the screen's own reflection is the same
// law with its diffuse reflectance.
// Not included: gloss of the surface or of the screen's front, fall-off with
// the viewing angle.

#ifdef __STDC__
#define OUTPUT_PURE static inline
#else
#define OUTPUT_PURE
#endif

// cd/m2 of a surface whose tristimulus value, relative to the perfect
// diffuser, is `relative`, under lux.
OUTPUT_PURE real output_surface(real relative, real lux)
{
    real pi = 3.14159265358979324;
    return relative * (lux / pi);
}

// cd/m2 the screen must add to what it reflects itself. Negative where even
// its reflection alone is too bright.
OUTPUT_PURE real output_emitted(real surface, real screen_reflectance, real white, real lux)
{
    return surface - output_surface(screen_reflectance * white, lux);
}

// x, or 0 for what is not a number or beyond any luminance.
OUTPUT_PURE real output_finite(real x)
{
    real none = 0, limit = 1e12;
    return x >= -limit && x <= limit ? x : none;
}
