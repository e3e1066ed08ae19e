// SPDX-License-Identifier: Apache-2.0
// How a camera's counts follow exposure.
#ifndef CALIBRATION_RESPONSE_H
#define CALIBRATION_RESPONSE_H

#include "calibration/hdr_opencv.h"
#include "calibration/photos.h"

struct response {
    int codes;        // 256 or 65536
    double *exposure; // [codes], owned: relative, 1 at the last code, rising
    double *slope;    // [codes], owned: change of exposure per code, > 0
    int least, most;  // codes outside are too dark or clipped
};

void response_fini(struct response *r); // accepts a zeroed one

// Counts proportional to exposure, as raw pictures have them. bits 8 or 16.
bool response_linear(int bits, struct response *out, struct error *err);

// From the pictures themselves (8 bits, two exposures or more; error DATA
// otherwise): pixels that are even with their neighbours, as many dark as bright
// ones, through hdr_response; then smoothed by local parabolas in the logarithms
// of code and exposure, and made to rise.
bool response_find(enum hdr_method method, const struct photos *photos, int channel,
                   struct response *out, struct error *err);

// A table "code, exposure" (CSV, one row a code from 0, exposure rising) and
// back. Error DATA for another number of rows than 2^bits.
bool response_load(const char *path, int bits, struct response *out, struct error *err);
bool response_save(const char *path, const struct response *r, struct error *err);

// Rms relative difference between two responses of equal codes, each made to
// agree in the mean, from 10 to 95 % of the codes.
double response_difference(const struct response *a, const struct response *b);

#endif
