// SPDX-License-Identifier: Apache-2.0
// Materials on disk: NAME.ini in the materials' folder, or anywhere by path.
#ifndef CONFIG_MATERIALS_H
#define CONFIG_MATERIALS_H

#include "config/booth.h"

enum material_kind { MATERIAL_CHART, MATERIAL_FLAT, MATERIAL_BANDS };

// Section [material] of NAME.ini.
struct material_file {
    char name[64];
    int kind;                 // enum material_kind
    char source[512];         // chart, flat: table of spectra; bands: EXR; relative to the file
    double reflectance;       // flat without a source: the same at all wavelengths, 0..1
    int columns, rows;        // of a chart, 1..64
    double gap;               // of a chart, in widths of a patch, 0..0.5
    char background[64];      // of a chart: name of a spectrum of source, or a reflectance 0..1
    double width_m, height_m; // how it lies on the screen; 0 = fills it
};

extern const struct setting material_file_settings[];

// name_or_path: a text with a '/' is the path of an .ini file, else NAME.ini in
// the booth's materials folder, or among the shipped ones when it names none.
// Errors name file, line, key, value; an unknown name lists what there is.
// *out is to be freed with material_fini.
bool material_load(const struct booth_settings *booth, const char *name_or_path,
                   struct material *out, struct error *err);

// The patch of that name as one uniform surface. Error RANGE lists the first
// names there are.
bool material_patch(const struct material *chart, const char *patch, struct material *out,
                    struct error *err);

#endif
