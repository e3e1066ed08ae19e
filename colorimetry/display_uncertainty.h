// SPDX-License-Identifier: Apache-2.0
// How far a fitted display model's predictions may lie from what the display
// emits: a Gaussian error of zero mean in three parts, each a function of the
// counts. What the instrument may be wrong by as a whole (calibration,
// wavelength) is not in it.
//
//   parameters  what readings of finite number and repeatability leave open in
//               the fit: principal modes of its covariance
//   smooth      what no such model says of this display and neighbouring colours
//               share: correlated by exp(-distance / length) over CIELAB
//   local       what neighbouring colours do not share: ripple of the curves,
//               and the noise of the readings themselves, so that it is an upper
//               bound of what is wrong with the model
//
// The latter two are estimated from patches that the fit did not see, and
// count in CIEDE2000 units (a colour by its local scale, colorimetry/metric.h).
// Sources: JCGM 102:2011 (joint covariance); Rasmussen, Williams 2006, 4.2.
#ifndef COLORIMETRY_DISPLAY_UNCERTAINTY_H
#define COLORIMETRY_DISPLAY_UNCERTAINTY_H

#include "colorimetry/display.h"

// Modes stand at a grid of counts 0, 1/3, 2/3, 1 a channel and are linear in
// between.
enum { UNCERTAINTY_MODES = 12, UNCERTAINTY_SIDE = 4, UNCERTAINTY_PLACES = 64 };

struct display_uncertainty {
    int modes; // 0..UNCERTAINTY_MODES
    // Shift of L*, a*, b* per standard deviation at (red * 4 + green) * 4 + blue.
    double mode[UNCERTAINTY_MODES][UNCERTAINTY_PLACES][3];
    double smooth_de00, length_lab; // standard deviation a CIEDE2000 axis; CIELAB units, > 0
    double local_de00;              // standard deviation a CIEDE2000 axis
    double neutral_de00;            // likewise, in addition, of colours near the grey axis: its
                                    // square times uncertainty_neutral
    double noise_de00; // of local: repeatability of one reading where counts were repeated, mostly
                       // at white; 0 unknown
};

// 1 on the grey axis, where CIEDE2000 sees most, falling to 1/e at a chroma of
// 20.
double uncertainty_neutral(struct lab at);

// Joint covariance of the errors of n predictions, 3n x 3n, row-major, L* a* b*
// of the first, of the second and so on; CIELAB about the model's white. Equal
// counts have equal errors. Symmetric, positive semi-definite.
void display_uncertainty_lab(const struct display_uncertainty *uncertainty,
                             const struct display_model *model, const struct counts *counts, int n,
                             double *covariance);

// Likewise of X, Y, Z in (cd/m2)^2.
void display_uncertainty_xyz(const struct display_uncertainty *uncertainty,
                             const struct display_model *model, const struct counts *counts, int n,
                             double *covariance);

// Root mean square CIEDE2000 between prediction and truth at given counts.
double display_uncertainty_de00(const struct display_uncertainty *uncertainty,
                                const struct display_model *model, struct counts counts);

#endif
