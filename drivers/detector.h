// SPDX-License-Identifier: Apache-2.0
// A line of pixels behind a grating: what is needed to make sense of its raw
// counts. Plain data. Pixels are counted from 0.
#ifndef DRIVERS_DETECTOR_H
#define DRIVERS_DETECTOR_H

enum { DETECTOR_PIXELS_MOST = 4096, DETECTOR_BLACK_RANGES = 2, DETECTOR_ORDER_MOST = 7 };

struct pixel_range {
    int first, last; // inclusive; last < first: empty
};

struct detector {
    int pixels;                                      // 1..DETECTOR_PIXELS_MOST
    struct pixel_range active;                       // that see light
    struct pixel_range black[DETECTOR_BLACK_RANGES]; // optically black
    double saturation;                               // raw counts, > 0
    double full_counts; // of the scale that the next polynomial belongs to: raw x
                        // full_counts / saturation
    double nonlinearity[DETECTOR_ORDER_MOST + 1]; // over scaled counts, [i] of counts^i
    int order;                                    // of nonlinearity; -1: none
    double wavelength[4];                         // nm = sum of wavelength[i] x pixel^i, as used
    double own_wavelength[4];                     // the same as the unit itself says
};

#endif
