// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/bands.h"

#include <math.h>
#include <string.h>

#include "colorimetry/tables/bands.h"

bool band_set_make(int count, const double *centre_nm, const double *width_nm, struct band_set *out,
                   struct error *err)
{
    struct band_set set = {.count = count};
    if (count < BANDS_LEAST || count > BANDS_MOST)
        return fail(err, ERROR_RANGE, "%d bands; allowed: %d..%d", count, BANDS_LEAST, BANDS_MOST);
    for (int j = 0; j < count; j++) {
        if (!(centre_nm[j] >= SPECTRUM_FIRST_NM && centre_nm[j] <= SPECTRUM_LAST_NM))
            return fail(err, ERROR_RANGE, "centre of band %d: %g is outside %d..%d nm", j + 1,
                        centre_nm[j], SPECTRUM_FIRST_NM, SPECTRUM_LAST_NM);
        if (!(width_nm[j] >= 1 && width_nm[j] <= 200))
            return fail(err, ERROR_RANGE, "width of band %d: %g is outside 1..200 nm", j + 1,
                        width_nm[j]);
        set.centre_nm[j] = centre_nm[j];
        set.width_nm[j] = width_nm[j];
        for (int i = 0; i < SPECTRUM_COUNT; i++) {
            double off = (SPECTRUM_FIRST_NM + i - centre_nm[j]) / width_nm[j];
            set.sensitivity[j].v[i] = exp(-off * off / 2);
        }
        spectrum_scale(&set.sensitivity[j], 1 / spectrum_sum(&set.sensitivity[j]));
    }
    *out = set;
    return true;
}

bool band_set_shipped(int count, struct band_set *out, struct error *err)
{
    if (count < BANDS_LEAST || count > BANDS_MOST)
        return fail(err, ERROR_RANGE, "%d bands; allowed: %d..%d", count, BANDS_LEAST, BANDS_MOST);
    const struct band_shapes *shipped = &BAND_SHAPES[count - BANDS_LEAST];
    return band_set_make(count, shipped->centre_nm, shipped->width_nm, out, err);
}

struct bands bands_of(const struct band_set *set, const struct spectrum *reflectance)
{
    struct bands c = {{0}};
    for (int j = 0; j < set->count; j++)
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            c.v[j] += set->sensitivity[j].v[i] * reflectance->v[i];
    return c;
}

struct xyz band_xyz(const struct band_matrix *matrix, const struct bands *c)
{
    double t[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < matrix->count; j++)
            t[i] += matrix->m[i][j] * c->v[j];
    return (struct xyz){t[0], t[1], t[2]};
}
