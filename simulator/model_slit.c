// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_slit.h"

#include <math.h>

double slit_mean(const struct spectrum *light, double centre_nm, double bandpass_nm)
{
    double sum = 0, weights = 0;
    int last = (int)floor(centre_nm + bandpass_nm);
    for (int nm = (int)ceil(centre_nm - bandpass_nm); nm <= last; nm++) {
        double weight = bandpass_nm - fabs(nm - centre_nm);
        weights += weight;
        if (nm >= SPECTRUM_FIRST_NM && nm <= SPECTRUM_LAST_NM)
            sum += weight * light->v[nm - SPECTRUM_FIRST_NM];
    }
    return sum / weights;
}
