// SPDX-License-Identifier: Apache-2.0
// The still camera that photographs the ceiling: its lens, as a calibration
// program found it, how light falls off towards the corners, how it is held.
// A zeroed one is a pinhole without distortion or falloff.
#ifndef CALIBRATION_STILL_CAMERA_H
#define CALIBRATION_STILL_CAMERA_H

#include "calibration/hdr_opencv.h"

struct still_camera {
    int width_px, height_px; // of the pictures that the lens holds for, 0 = any
    struct hdr_lens lens;    // fx_px 0: nothing is known but that it is a pinhole
    bool cos4;               // light falls off with the fourth power of the cosine,
    double v2, v4, v6;       // times 1 + v2 t2 + v4 t4 + v6 t6, t the tangent to the axis
    int top;                 // enum ceiling_side: side of the ceiling on top of the picture
    double inset_m;          // of the lit field's edges within the ceiling's
};

enum ceiling_side { SIDE_NEAR, SIDE_FAR, SIDE_LEFT, SIDE_RIGHT };

// An INI file. Section [camera]: width_px, height_px, fx_px, fy_px, cx_px, cy_px,
// and where they are not 0 k1, k2, p1, p2, k3, cos4, v2, v4, v6. Section
// [ceiling], which may be missing: top (near), inset_m (0).
bool still_camera_load(const char *path, struct still_camera *out, struct error *err);

// Fills in what is not given for pictures of that size: the axis in the middle
// (cx_px NAN), a focal length of 1 pixel (tangents are then pixels). Error CONFIG when the
// lens is of pictures of another size, or cos4 or v2.. are asked for without a
// focal length.
bool still_camera_fit(struct still_camera *camera, int width, int height, struct error *err);

// Light at a place over that on the axis. tangent: ideal, without distortion.
double still_camera_falloff(const struct still_camera *camera, const double tangent[2]);

#endif
