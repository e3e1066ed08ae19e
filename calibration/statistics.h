// SPDX-License-Identifier: Apache-2.0
// Summaries of a list of numbers, and the line through them.
#ifndef CALIBRATION_STATISTICS_H
#define CALIBRATION_STATISTICS_H

struct summary {
    int n;
    double mean, std; // std: sample standard deviation, 0 with fewer than two
    double median, p90, p95, p99, max;
};

// All zero for n = 0. values is not changed; n <= 100 000.
struct summary summarise(const double *values, int n);

// Percentile p (0..100) by linear interpolation between order statistics of an
// ascending list (Hyndman and Fan 1996, type 7). n >= 1.
double percentile(const double *ascending, int n, double p);

// A straight line through points by least squares. Its uncertainties are those
// of unweighted points that scatter about it alike (k = 1), from the residuals.
struct line_fit {
    double slope, at_mean, mean_x; // y = at_mean + slope (x - mean_x)
    double slope_u;                // standard uncertainty of slope, 0 with two points
    double scatter;                // residual standard deviation, n - 2 degrees of freedom
};

// n >= 2 with at least two different x; else all zero.
// Source: Gauss; see JCGM 100:2008, H.3.
struct line_fit line_through(const double *x, const double *y, int n);

#endif
