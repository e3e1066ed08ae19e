// SPDX-License-Identifier: Apache-2.0
#include "calibration/reflectances.h"

#include <math.h>
#include <matio.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// full: the reading of the perfect diffuser. from_nm: Koivisto's first sample
// is noise.
static const struct set {
    const char *name;
    double weight, full, from_nm;
} SETS[] = {
    {"nickerson", 1, 1, 0},
    {"vrhel", 0.6, 1, 0},
    {"krinov", 0.6, 1, 0},
    {"koivisto", 0.3, 4096, 405},
};

enum { SETS_COUNT = sizeof SETS / sizeof *SETS, SAMPLES_MOST = 512 };

// One variable as doubles, rows (wavelengths) by columns (spectra).
struct matrix {
    size_t rows, columns;
    double *v; // column by column, as the file has it
};

static double element(const matvar_t *var, size_t i)
{
    switch ((int)var->class_type) {
    case MAT_C_DOUBLE:
        return ((const double *)var->data)[i];
    case MAT_C_SINGLE:
        return ((const float *)var->data)[i];
    case MAT_C_UINT8:
        return ((const uint8_t *)var->data)[i];
    case MAT_C_INT16:
        return ((const int16_t *)var->data)[i];
    case MAT_C_UINT16:
        return ((const uint16_t *)var->data)[i];
    }
    return NAN;
}

static bool read_matrix(mat_t *file, const char *path, const char *name, struct matrix *out,
                        struct error *err)
{
    matvar_t *var = Mat_VarRead(file, name);
    if (!var || var->rank != 2 || !var->data || var->isComplex) {
        Mat_VarFree(var);
        return fail(err, ERROR_DATA, "%s: %s is no matrix", path, name);
    }
    *out = (struct matrix){var->dims[0], var->dims[1], NULL};
    out->v = malloc(out->rows * out->columns * sizeof *out->v);
    bool finite = out->v;
    for (size_t i = 0; finite && i < out->rows * out->columns; i++)
        finite = isfinite(out->v[i] = element(var, i));
    Mat_VarFree(var);
    return finite || fail(err, ERROR_DATA, "%s: %s holds what is no finite number", path, name);
}

// Whether every spectrum is 0 at row, or equals its neighbour.
static bool is_padding(const struct matrix *m, size_t row, size_t neighbour)
{
    bool zero = true;
    bool same = true;
    for (size_t c = 0; c < m->columns; c++) {
        const double *spectrum = m->v + c * m->rows;
        zero &= spectrum[row] == 0;
        same &= spectrum[row] == spectrum[neighbour];
    }
    return zero || same;
}

static bool take(const struct set *set, const char *path, const struct matrix *grid,
                 const struct matrix *m, struct reflectances *out, struct error *err)
{
    double nm[SAMPLES_MOST], values[SAMPLES_MOST];
    if (grid->rows * grid->columns != 3 || m->rows > SAMPLES_MOST || grid->v[2] != m->rows)
        return fail(err, ERROR_DATA, "%s: S_%s does not describe sur_%s", path, set->name,
                    set->name);
    size_t first = 0;
    size_t last = m->rows - 1;
    while (first < last &&
           (grid->v[0] + grid->v[1] * first < set->from_nm || is_padding(m, first, first + 1)))
        first++;
    while (last > first && is_padding(m, last, last - 1))
        last--;
    for (size_t c = 0; c < m->columns; c++) {
        for (size_t r = first; r <= last; r++) {
            nm[r - first] = grid->v[0] + grid->v[1] * r;
            values[r - first] = m->v[c * m->rows + r] / set->full;
        }
        out->weights[out->count] = set->weight;
        if (!spectrum_from_samples(nm, values, last - first + 1, true, &out->spectra[out->count++],
                                   err))
            return while_doing(err, "%s: sur_%s, spectrum %zu", path, set->name, c + 1);
    }
    return true;
}

static bool grow(struct reflectances *out, size_t more, struct error *err)
{
    size_t count = (size_t)out->count + more;
    struct spectrum *spectra = realloc(out->spectra, count * sizeof *spectra);
    out->spectra = spectra ? spectra : out->spectra;
    double *weights = realloc(out->weights, count * sizeof *weights);
    out->weights = weights ? weights : out->weights;
    return (spectra && weights) || fail(err, ERROR_SYSTEM, "out of memory for %zu spectra", count);
}

static bool load(const char *folder, const struct set *set, struct reflectances *out,
                 struct error *err)
{
    char path[1024], grid_name[32], name[32];
    struct matrix grid = {0}, m = {0};
    snprintf(path, sizeof path, "%s/sur_%s.mat", folder, set->name);
    snprintf(grid_name, sizeof grid_name, "S_%s", set->name);
    snprintf(name, sizeof name, "sur_%s", set->name);
    mat_t *file = Mat_Open(path, MAT_ACC_RDONLY);
    if (!file)
        return fail(err, ERROR_CONFIG, "%s: no such MAT file (Debian: psychtoolbox-3-common)",
                    path);
    bool ok = read_matrix(file, path, grid_name, &grid, err) &&
              read_matrix(file, path, name, &m, err) && grow(out, m.columns, err) &&
              take(set, path, &grid, &m, out, err);
    free(grid.v);
    free(m.v);
    Mat_Close(file);
    return ok;
}

void reflectances_fini(struct reflectances *r)
{
    free(r->spectra);
    free(r->weights);
    *r = (struct reflectances){0};
}

bool reflectances_load(const char *folder, struct reflectances *out, struct error *err)
{
    struct reflectances r = {0};
    for (int i = 0; i < SETS_COUNT; i++)
        if (!load(folder, &SETS[i], &r, err)) {
            reflectances_fini(&r);
            return false;
        }
    *out = r;
    return true;
}
