// SPDX-License-Identifier: Apache-2.0
// The ceiling in a picture taken from below: where each of its places falls.
#ifndef CALIBRATION_CEILING_VIEW_H
#define CALIBRATION_CEILING_VIEW_H

#include "calibration/hdr.h"
#include "calibration/still_camera.h"
#include "render/lights.h"

// Order of corners: far left, far right, near right, near left. Seen from below
// they run anticlockwise.
struct ceiling_view {
    struct still_camera camera;
    double tangent_from_square[3][3]; // projective, from the unit square, far left (0, 0)
};

// From the corners of the ceiling, or of a rectangle that lies camera->inset_m
// within its edges. Source: Heckbert 1989 (square to quadrilateral). Errors: DATA for
// corners that are outside the picture (width x height pixels), that are not
// convex, that run clockwise (a mirrored picture, or another order), or, where
// the lens is known, that no rectangle of those proportions can show (within
// 10 %; Zhang 2000: its sides are orthogonal and of known lengths).
bool ceiling_view_make(const struct still_camera *camera, int width, int height,
                       const double corner_px[4][2], const struct ceiling *ceiling,
                       struct ceiling_view *out, struct error *err);

// Where places of the unit square (u to the right, v towards the observer) fall.
bool ceiling_view_pixels(const struct ceiling_view *view, const double (*uv)[2], int count,
                         double (*px)[2], struct error *err);

// A picture of light seen from straight below: [height][width], row 0 the far
// edge, column 0 the left one. All owned.
struct ceiling_picture {
    int width, height;
    double *light, *sigma; // as in hdr; sigma of the mean over a pixel
    double *clipped;       // share of a pixel that is clipped
    double px_across;      // pixels of the camera to one of these, along the worse direction
};

void ceiling_picture_fini(struct ceiling_picture *p);

// The mean over each pixel, from the camera's pixels interpolated bilinearly at
// places closer than those lie. Falloff that the camera knows is divided out.
bool ceiling_view_take(const struct ceiling_view *view, const struct hdr *hdr, int width,
                       int height, struct ceiling_picture *out, struct error *err);

// Finds the lit field: the largest piece around the brightest place that is
// a quadrilateral with four straight sides (straight without the lens's
// distortion), darker outside, whatever the threshold within a factor of two.
// Its sides are lines through the places where light is halfway between
// inside and outside. Error DATA when there is none.
bool ceiling_corners_find(const struct still_camera *camera, const struct hdr *hdr,
                          double corner_px[4][2], struct error *err);

#endif
