// SPDX-License-Identifier: Apache-2.0
// Small plots as inline SVG for the HTML report.
#ifndef CALIBRATION_SVG_H
#define CALIBRATION_SVG_H

#include <stdio.h>

#include "colorimetry/colour.h"

// What the plots expect of the style of the page they stand in.
#define SVG_STYLE                                                                                  \
    "svg .grid{stroke:#e7e5e4}svg .locus{fill:#f5f5f4;stroke:#a8a29e}"                             \
    "svg .small{font-size:8.5px}svg text{fill:#44403c}"

struct svg_series {
    const char *name, *colour; // colour: CSS
    int count;
    const double *x, *y;
};

// Lines over axes with ticks and a legend; y starts at 0. Ranges are rounded
// to steps of 1, 2 or 5.
void svg_lines(FILE *out, const char *x_label, const char *y_label, const struct svg_series *series,
               int count);

// Points over the CIE u', v' diagram with the spectral locus of the observer.
void svg_chromaticities(FILE *out, enum observer observer, const struct svg_series *series,
                        int count);

// One bar a name, in groups of `groups` values: values[i * groups + g].
void svg_bars(FILE *out, const char *y_label, const char *const *names, const double *values,
              int count, int groups, const char *const *colours, const char *const *legend);

// Text with <, > and & made safe for HTML and SVG.
void svg_escaped(FILE *out, const char *text);

#endif
