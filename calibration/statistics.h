// SPDX-License-Identifier: Apache-2.0
// Summaries of a list of colour differences.
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

#endif
