// SPDX-License-Identifier: Apache-2.0
// Where the eye is when a frame's light reaches it, from where it was seen:
// smoothing and prediction. Pure; the times come in.
#ifndef DAEMON_EYE_H
#define DAEMON_EYE_H

#include <stdint.h>

#include "base/linear.h"
#include "config/booth.h"

// What the Kalman filter knows along, or across, the tracker's line of sight.
struct eye_spread {
    double pp, pv, vv; // variances of place and speed
    double pace;       // fastest speed of late, m/s
};

// Zeroed: nothing was seen.
struct eye_track {
    bool known;
    int64_t seen_ns;      // when the last place was true
    struct vec3 seen;     // the last place itself
    struct vec3 at;       // smoothed, at seen_ns
    struct vec3 approach; // towards the last places, m/s, of the one-euro filter
    struct vec3 speed;    // m/s
    struct eye_spread along, across;
};

// Takes a place of the booth frame seen at seen_ns along sight, the tracker's line of
// sight to it (any length; 0 0 0 where that is unknown). The first one, and one
// after more than eye_hold_s or from before the last, counts as it is. Times
// between places are taken as 1..100 ms, whatever the clock says.
// - none: the place as seen.
// - one-euro: smoothed over eye_s at rest, the less the faster it moves, so
//   that it lags by 5 cm at most (Casiez, Roussel, Vogel 2012).
// - kalman: constant velocity, with a place's noise of eye_noise_m across the line of
//   sight and eye_depth_noise_m along it, and eye_acceleration of a head's
//   acceleration (Bar-Shalom, Li, Kirubarajan 2001, 6.3.2, the piecewise
//   constant white acceleration model); it does not lag at constant speed. A head that rests
//   accelerates less: the acceleration counts in full from 0.25 m/s on, below in
//   proportion to the fastest speed of late above 0.1 m/s (forgotten over half a second), to
//   a tenth at least (ibid., 11.2, adjustable process noise).
void eye_take(struct eye_track *track, const struct state_settings *settings, struct vec3 at,
              struct vec3 sight, int64_t seen_ns);

// The place at photon_ns: the smoothed one, carried on at the speed it had for
// at most 50 ms and 15 cm, less the share of 0.05 m/s of it that is noise. Not
// carried on where eye_ahead_s is 0.
struct vec3 eye_at(const struct eye_track *track, const struct state_settings *settings,
                   int64_t photon_ns);

#endif
