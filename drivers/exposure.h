// SPDX-License-Identifier: Apache-2.0
// Which exposure to try next: towards 85 % of saturation, in a bounded number
// of changes after each change of light. Pure functions.
#ifndef DRIVERS_EXPOSURE_H
#define DRIVERS_EXPOSURE_H

#include <stdbool.h>

enum { EXPOSURE_CHANGES_MOST = 10 };

struct exposure_limits {
    double mains_hz;          // 50..60: from half its period on, exposures are multiples of it
    int least_us, longest_us; // least_us <= longest_us
    int base_us;              // the instrument's own unit, 1 or more
};

// What is remembered between readings; start with zeroes.
struct exposure {
    int changes;       // since the light last changed
    double rest_rate;  // signal over saturation per us when it first came to rest, 0 = not yet
    int saturating_us; // shortest that saturated since, 0 = none
};

// What one reading of us said, each over saturation, 0..1.
struct exposure_seen {
    int us;
    double peak, dark; // dark: of the black pixels
    int saturated;     // pixels
};

// us as the instrument can hold it: within the limits, steps of 10 us, above
// 655 ms of 1 ms, whole base_us.
int exposure_hold(double us, const struct exposure_limits *limits);

// The same, and from half a mains period on a multiple of it.
int exposure_round(double us, const struct exposure_limits *limits);

// The next exposure; seen->us itself when that is as good as it gets:
// - at rest within 78..92 % of saturation; where no multiple of half a mains
//   period falls there, on the longest that stays below 88 %;
// - at most 8 times up at once; after saturation a quarter, or a sixteenth when
//   more than 200 pixels were saturated;
// - never again as long as 80 % of what saturated in the same light;
// - after EXPOSURE_CHANGES_MOST changes in the same light it only goes down,
//   and only for saturation. The light is another when the signal per time
//   leaves 2/3..3/2 of what it was at rest, or what saturated would give less
//   than 2/3 of saturation.
int exposure_next(struct exposure *e, const struct exposure_seen *seen,
                  const struct exposure_limits *limits);

#endif
