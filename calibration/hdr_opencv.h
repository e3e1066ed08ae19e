// SPDX-License-Identifier: Apache-2.0
// The door to OpenCV's photography: the response of a camera from pictures of
// one scene at several exposures, lens distortion, quadrilaterals. No other
// file of this folder includes OpenCV.
#ifndef CALIBRATION_HDR_OPENCV_H
#define CALIBRATION_HDR_OPENCV_H

#include <stdint.h>

#include "base/error.h"

// ---- response --------------------------------------------------------------

enum { HDR_CODES = 256, HDR_FRAMES_MOST = 64 };

enum hdr_method {
    HDR_DEBEVEC,  // Debevec, Malik 1997: smooth logarithm of the response
    HDR_ROBERTSON // Robertson, Borman, Stevenson 2003: maximum likelihood, no smoothing
};

// Relative exposure that gives each code, 0 where the pictures do not tell.
// codes[frames][pixels] of one channel, seconds[frames] > 0, frames
// 2..HDR_FRAMES_MOST, pixels a square number of 16 or more. Errors: DATA when
// fewer than 32 codes are told.
bool hdr_response(enum hdr_method method, const uint8_t *codes, const double *seconds, int frames,
                  int pixels, double response[HDR_CODES], struct error *err);

// ---- lens ------------------------------------------------------------------

// Pinhole and distortion as calibration programs have it: pixel (0, 0) is the
// centre of the top left one. Source: Brown 1966; order and signs of OpenCV:
// k1, k2, k3 radial, p1 (mostly y) and p2 (mostly x) tangential.
struct hdr_lens {
    double fx_px, fy_px, cx_px, cy_px;
    double k1, k2, p1, p2, k3;
};

// Tangents of the angles to the optical axis (x right, y down) of places in
// the picture, and back. Errors: DATA when there is no way back: the
// distortion folds the picture there.
bool hdr_undistort(const struct hdr_lens *lens, const double (*px)[2], int count,
                   double (*tangent)[2], struct error *err);
bool hdr_distort(const struct hdr_lens *lens, const double (*tangent)[2], int count,
                 double (*px)[2], struct error *err);

// ---- shapes ----------------------------------------------------------------

// The convex quadrilateral that the piece of mask (non-zero, [height][width])
// around a seed pixel fills, corners clockwise as seen in the picture; *fill:
// area of the piece, holes included, over that of the quadrilateral. False,
// without an error, when the piece is none, or touches the picture's edge.
bool hdr_quadrilateral(const uint8_t *mask, int width, int height, int seed_x, int seed_y,
                       double corner_px[4][2], double *fill);

#endif
