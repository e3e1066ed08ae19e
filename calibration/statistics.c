// SPDX-License-Identifier: Apache-2.0
#include "calibration/statistics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int ascending_order(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double percentile(const double *ascending, int n, double p)
{
    double at = p / 100 * (n - 1);
    int below = (int)floor(at);
    if (below >= n - 1)
        return ascending[n - 1];
    double part = at - below;
    return ascending[below] + part * (ascending[below + 1] - ascending[below]);
}

struct summary summarise(const double *values, int n)
{
    struct summary s = {.n = n};
    double *sorted = n > 0 ? malloc((size_t)n * sizeof *sorted) : NULL;
    if (!sorted)
        return (struct summary){0};
    memcpy(sorted, values, (size_t)n * sizeof *sorted);
    qsort(sorted, (size_t)n, sizeof *sorted, ascending_order);
    double squares = 0;
    for (int i = 0; i < n; i++)
        s.mean += sorted[i] / n;
    for (int i = 0; i < n; i++)
        squares += (sorted[i] - s.mean) * (sorted[i] - s.mean);
    s.std = n > 1 ? sqrt(squares / (n - 1)) : 0;
    s.median = percentile(sorted, n, 50);
    s.p90 = percentile(sorted, n, 90);
    s.p95 = percentile(sorted, n, 95);
    s.p99 = percentile(sorted, n, 99);
    s.max = sorted[n - 1];
    free(sorted);
    return s;
}

struct line_fit line_through(const double *x, const double *y, int n)
{
    struct line_fit f = {0};
    double xx = 0, xy = 0, off = 0;
    for (int i = 0; i < n; i++) {
        f.mean_x += x[i] / n;
        f.at_mean += y[i] / n;
    }
    for (int i = 0; i < n; i++) {
        xx += (x[i] - f.mean_x) * (x[i] - f.mean_x);
        xy += (x[i] - f.mean_x) * (y[i] - f.at_mean);
    }
    if (n < 2 || !(xx > 0))
        return (struct line_fit){0};
    f.slope = xy / xx;
    for (int i = 0; i < n; i++)
        off += pow(y[i] - f.at_mean - f.slope * (x[i] - f.mean_x), 2);
    f.scatter = n > 2 ? sqrt(off / (n - 2)) : 0;
    f.slope_u = f.scatter / sqrt(xx);
    return f;
}
