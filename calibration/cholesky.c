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
