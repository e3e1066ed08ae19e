// SPDX-License-Identifier: Apache-2.0
// What the emulated instruments sense of the emulated world. The wire faces
// know nothing else of it; tests put a plain table of numbers behind it.
#ifndef SIMULATOR_AROUND_H
#define SIMULATOR_AROUND_H

#include <stdbool.h>
#include <stdint.h>

#include "base/linear.h"
#include "colorimetry/spectrum.h"

// Times are CLOCK_MONOTONIC nanoseconds. All functions may be called from any
// thread, return quickly and never fail.
struct around {
    void *context;
    // Mean spectral irradiance (W m-2 nm-1) on the spectrometer's cosine
    // corrector between two times.
    void (*irradiance)(void *context, int64_t from_ns, int64_t to_ns, struct spectrum *out);
    // Gravity in the inclinometer's axes (x right, y up along the screen, z
    // out of it), m/s2: (0, 0, 9.81) when the screen lies flat face up.
    struct vec3 (*gravity)(void *context, int64_t at_ns);
    // Places of the three infrared markers of clip or cap in the camera's frame:
    // z out of the lens, y up, x = y cross z; metres. Order as head.h has it.
    void (*markers)(void *context, int64_t at_ns, struct vec3 out[3]);
    // Spectral radiance (W m-2 sr-1 nm-1) from the place the radiometer is
    // aimed at, averaged over its spot, at this moment.
    void (*radiance)(void *context, int64_t at_ns, struct spectrum *out);
    // Place of a fourth marker, as markers; false = there is none. May be NULL.
    bool (*fourth_marker)(void *context, int64_t at_ns, struct vec3 *out);
    // Pose of the head (its frame: see head.h) in the frame of opentrack's
    // camera, whose axes are those of the markers' camera. May be NULL.
    struct rigid (*head)(void *context, int64_t at_ns);
};

#endif
