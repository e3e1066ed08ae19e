// SPDX-License-Identifier: Apache-2.0
// Illuminance from one light point of a plane emitter, once for GLSL 3.30 and
// C. The includer defines `real` as float or double before this file.
// Source: Lambert's cosine law and the inverse-square law; a ceiling as a sum
// of such points, E = sum (A/P) L max(0, w.n) max(0, w.down') / d2, as Debevec
// 2005 (A median cut algorithm for light probe sampling) uses them.
// Not included: the size of the region a point stands for (wrong when it is
// nearer than its region is wide), occlusion, light from the booth's walls.

#ifdef __STDC__
#define DIFFUSE_PURE static inline
#else
#define DIFFUSE_PURE
#endif

DIFFUSE_PURE real diffuse_dot(real ax, real ay, real az, real bx, real by, real bz)
{
    return ax * bx + ay * by + az * bz;
}

// Lux from a point of `candela` straight along `down` (unit), onto a surface
// of unit normal n, where to = light - surface point in metres. 0 when the
// light is behind the surface, when the surface is above the emitter's plane,
// and within a micrometre of the light.
DIFFUSE_PURE real diffuse_point(real to_x, real to_y, real to_z, real n_x, real n_y, real n_z,
                                real down_x, real down_y, real down_z, real candela)
{
    real none = 0, nearest = 1e-12;
    real square = diffuse_dot(to_x, to_y, to_z, to_x, to_y, to_z);
    real facing = diffuse_dot(to_x, to_y, to_z, n_x, n_y, n_z);
    real leaving = -diffuse_dot(to_x, to_y, to_z, down_x, down_y, down_z);
    if (!(facing > none) || !(leaving > none) || !(square > nearest))
        return none;
    return candela * (facing / square) * (leaving / square);
}
