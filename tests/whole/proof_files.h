// SPDX-License-Identifier: Apache-2.0
// Files a proof needs, written by hand so that the product's own writers are
// not tested against themselves.
#ifndef TESTS_WHOLE_PROOF_FILES_H
#define TESTS_WHOLE_PROOF_FILES_H

#include <math.h>
#include <stdio.h>

#include "colorimetry/spectrum.h"

// A CGATS .sp of 1 nm from 360 to 830 nm.
static inline void write_spectrum(const char *path, const struct spectrum *s)
{
    FILE *out = fopen(path, "w");
    fprintf(out, "SPECT\n\nSPECTRAL_BANDS \"471\"\nSPECTRAL_START_NM \"360\"\n"
                 "SPECTRAL_END_NM \"830\"\nSPECTRAL_NORM \"1\"\nNUMBER_OF_FIELDS 471\n"
                 "BEGIN_DATA_FORMAT\n");
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        fprintf(out, "SPEC_%d ", SPECTRUM_FIRST_NM + i);
    fprintf(out, "\nEND_DATA_FORMAT\nNUMBER_OF_SETS 1\nBEGIN_DATA\n");
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        fprintf(out, "%.9g ", s->v[i]);
    fprintf(out, "\nEND_DATA\n");
    fclose(out);
}

// sRGB primaries, white_cdm2 at full code, each channel code^2.2.
static inline void write_display(const char *path, double white_cdm2)
{
    static const double primaries[3][3] = {
        {0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
    FILE *out = fopen(path, "w");
    fprintf(out, "[display]\nname = test panel\n[matrix]\n");
    for (int i = 0; i < 3; i++)
        fprintf(out, "%c = %.9g %.9g %.9g 0\n", "XYZ"[i], white_cdm2 * primaries[i][0],
                white_cdm2 * primaries[i][1], white_cdm2 * primaries[i][2]);
    fprintf(out, "[curves]\n");
    for (int k = 0; k < 1021; k++) {
        double v = pow(k / 1020.0, 2.2);
        fprintf(out, "node_%04d = %.17g %.17g %.17g\n", k, v, v, v);
    }
    fclose(out);
}

#endif
