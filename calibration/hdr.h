// SPDX-License-Identifier: Apache-2.0
// One picture of proportional light out of an exposure series.
#ifndef CALIBRATION_HDR_H
#define CALIBRATION_HDR_H

#include "calibration/photos.h"
#include "calibration/response.h"

struct hdr {
    int width, height;
    double *light;    // [height][width], owned: proportional to luminance, exposure a second
    double *sigma;    // [height][width], owned: its standard uncertainty from noise
    uint8_t *clipped; // [height][width], owned: 1 where every exposure is: light is a lower bound
    int hot;          // pixels that were replaced by their neighbours
    double noise;     // of the pictures over the model's, from how exposures agree
    // Of each exposure, by how much its light is off that of all, relative, the
    // median over its pixels; index as in photos.
    double off[PHOTOS_MOST];
};

void hdr_fini(struct hdr *h); // accepts a zeroed one

// Merges the light pictures, one response a channel. Each picture counts with
// the inverse variance of what it says: noise of light (a pixel is taken to
// hold 10 000 electrons), of reading (1/1000 of full exposure) and of whole
// counts, through the slope of its response; it fades out from 90 to 98 % of
// the codes and counts not at all above, nor, but for the longest, below 2 %.
// Channels are added with the weights 0.2126, 0.7152, 0.0722; the sum stands
// for luminance where all of the scene has one spectrum. Dark pictures, if any,
// are taken off (smoothed, in proportion to exposure) and tell the hot
// pixels; without them pixels that stand alone count as hot. Flat pictures,
// if any, divide out the falloff of light (smoothed, 1 where it is greatest).
// Errors: DATA when a flat picture is clipped; SYSTEM.
// Source of the weights: Granados et al. 2010, for readings whose noise is known.
bool hdr_merge(const struct photos *photos, const struct response *responses, struct hdr *out,
               struct error *err);

// Mean over a square of 2 half + 1 pixels about each one that is in use (used
// [height][width], NULL = all), of those in use; v is changed in place.
bool hdr_smooth(double *v, const uint8_t *used, int width, int height, int half);

#endif
