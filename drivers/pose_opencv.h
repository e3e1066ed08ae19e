// SPDX-License-Identifier: Apache-2.0
// Poses of three known points from where a camera sees them. The one door to
// OpenCV in this folder: plain data in and out, no exception leaves.
//
// Everything is in a camera frame with z out of the lens and x, y across it,
// right-handed; image points are (x / z, y / z) of the points' places in it.
#ifndef DRIVERS_POSE_OPENCV_H
#define DRIVERS_POSE_OPENCV_H

#include "base/linear.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { POSE_POINTS = 3, POSE_POINTS_MOST = 4, POSE_MOST = 4 };

// All poses (camera_from_model) that explain the image, by P3P (Gao 2003, in
// OpenCV's solveP3P); returns how many, 0..4. None when the points are
// degenerate or the library fails.
int pose_candidates(const struct vec3 model[POSE_POINTS], const double image[POSE_POINTS][2],
                    struct rigid out[POSE_MOST]);

// Moves *pose to the nearest minimum of the reprojection error of 3..4 points by
// Levenberg-Marquardt. False, and *pose untouched, when that fails.
bool pose_refine(const struct vec3 *model, const double (*image)[2], int count, struct rigid *pose);

#ifdef __cplusplus
}
#endif

#endif
