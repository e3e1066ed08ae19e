// SPDX-License-Identifier: Apache-2.0
#include "calibration/cholesky.h"

#include <math.h>

bool cholesky(double *matrix, int n)
{
    for (int i = 0; i < n; i++) {
        double *row = matrix + (long)i * n;
        for (int j = 0; j <= i; j++) {
            const double *other = matrix + (long)j * n;
            double left = row[j];
            for (int k = 0; k < j; k++)
                left -= row[k] * other[k];
            if (j < i)
                row[j] = left / other[j];
            else if (left > 0)
                row[i] = sqrt(left);
            else
                return false;
        }
        for (int j = i + 1; j < n; j++)
            row[j] = 0;
    }
    return true;
}

static int largest_left(const double *matrix, int n, int rank, const double *factor, double *most)
{
    int found = 0;
    *most = -INFINITY;
    for (int i = 0; i < n; i++) {
        double left = matrix[(long)i * n + i];
        for (int k = 0; k < rank; k++)
            left -= factor[(long)i * rank + k] * factor[(long)i * rank + k];
        if (left > *most) {
            *most = left;
            found = i;
        }
    }
    return found;
}

int cholesky_pivoted(const double *matrix, int n, int rank, double tolerance, double *factor)
{
    for (long i = 0; i < (long)n * rank; i++)
        factor[i] = 0;
    for (int column = 0; column < rank; column++) {
        double most;
        int pivot = largest_left(matrix, n, rank, factor, &most);
        if (!(most > tolerance))
            return column;
        const double *pivot_row = factor + (long)pivot * rank;
        for (int i = 0; i < n; i++) {
            double *row = factor + (long)i * rank;
            double left = matrix[(long)i * n + pivot];
            for (int k = 0; k < column; k++)
                left -= row[k] * pivot_row[k];
            row[column] = i == pivot ? sqrt(most) : left / sqrt(most);
        }
    }
    return rank;
}
