// SPDX-License-Identifier: Apache-2.0
// The emulated still camera's lens: where a ray falls on the picture, and how
// much of its light. Camera frame: x right and y down in the picture, z along
// the optical axis; pixel (0, 0) is the centre of the top left pixel.
#ifndef SIMULATOR_LENS_H
#define SIMULATOR_LENS_H

#include "base/linear.h"
#include "simulator/scenario.h"

// Straight above a camera at zero angles is the ceiling; the top of its picture
// is the edge near the observer, its right their right.
struct lens {
    const struct scenario_ceiling_camera *settings; // outlives the lens
    struct vec3 place;                              // booth frame, m
    struct mat3 booth_from_camera;
    double axis_px[2]; // where the optical axis falls
};

// A point of the plane at distance 1 in front of the lens: tangents of angles.
struct tangent {
    double x, y;
};

// The settings must outlive it. Pitched about the camera's x axis, then turned
// about its y axis, then rolled about its z axis, each about the camera's own.
struct lens lens_make(const struct scenario_ceiling_camera *settings);

// Where an ideal lens's image point really falls, both over the focal length.
// Radial: Conrady 1919, Brown 1966: factor 1 + K1 r2 + K2 r4 + K3 r6; decentred:
// Brown 1966: dx = D1 (r2 + 2 x2) + 2 D2 x y, dy = 2 D1 x y + D2 (r2 + 2 y2).
struct tangent lens_distort(const struct lens *lens, struct tangent ideal);

// The ideal point of a real one, by Newton's method: exact to 1e-12 wherever
// distortion does not fold the picture.
struct tangent lens_undistort(const struct lens *lens, struct tangent real);

// Direction (not of unit length: z = 1 in the camera frame) that a place of the
// picture looks in, booth frame.
struct vec3 lens_direction(const struct lens *lens, double x_px, double y_px);

// Where a point of the booth falls. False behind the camera.
bool lens_project(const struct lens *lens, struct vec3 at, double *x_px, double *y_px);

// Light at a place of the picture over that on the axis, for equal luminance:
// the fourth power of the cosine of the angle to the axis, times 1 + v tan2.
double lens_falloff(const struct lens *lens, struct tangent ideal);

// The ideal image point of a place of the picture.
struct tangent lens_ideal(const struct lens *lens, double x_px, double y_px);

#endif
