// SPDX-License-Identifier: Apache-2.0
// From up to four blobs in an infrared camera to the place of the eyes: which
// blob is which marker, which of the possible poses is meant, and whether to
// believe it. Pure, no hardware.
#ifndef DRIVERS_HEAD_H
#define DRIVERS_HEAD_H

#include "drivers/pose_opencv.h"
#include "drivers/tracker.h"

enum { HEAD_BLOBS = 4 };

// Markers in their own frame: x to the observer's right, y up, z away from the
// camera into the head; metres. The fourth is beside the three of a clip or cap.
struct head_markers {
    struct vec3 at[POSE_POINTS_MOST];
    int count; // 3 or 4
};

// Those that the settings say: marker is an index into tracker_markers; fourth_m of 0 0 0
// is none. Source: opentrack and linuxtrack defaults of the TrackIR clip and cap.
struct head_markers head_markers(int marker, const double fourth_m[3]);

// What is known from before. Zeroed: nothing.
struct head_memory {
    bool known;
    struct rigid pose; // tracker_from_marker, the last one seen
    int64_t seen_ns;
    int jumps; // poses refused in a row because they were too far away
};

// blobs[i] = (x / z, y / z) in the tracker frame, 0..4 of them in any order;
// focal_px turns image distances into pixels. Fills status, eye,
// reprojection_px and markers of out, not taken; eye is (0, 0, 0) unless SEEN.
//   LOST       fewer than three blobs, or no three of them look like the markers
//   AMBIGUOUS  no pose explains them within 4 px, two poses explain them
//              equally well, or the eye jumped (accepted from the fourth time on)
// With a fourth marker and four blobs the pose is that of all four, where there is one within
// 4 px; when there is none, three of the blobs are the first three markers and the fourth a
// stray light.
void head_solve(struct head_memory *memory, const struct head_markers *markers,
                struct vec3 eye_from_marker, const double (*blobs)[2], int count, double focal_px,
                int64_t now_ns, struct head_sample *out);

#endif
