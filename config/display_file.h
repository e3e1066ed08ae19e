// SPDX-License-Identifier: Apache-2.0
// The fitted display model on disk (INI): boothcal writes it, boothd loads it.
// [display] model says which it is; only the sections that it uses are written
// ([interaction] or [residual], and [uncertainty] where there is one). A file
// without that key is plain Day, as files were before the others.
#ifndef CONFIG_DISPLAY_FILE_H
#define CONFIG_DISPLAY_FILE_H

#include "colorimetry/display.h"
#include "colorimetry/display_uncertainty.h"

// What the fit was made from, and how uncertain it is: stays with the model.
struct display_origin {
    char instrument[128], date[32], software[64], source[512]; // source: the .ti3
    int patches;
    double fit_mean_de00, fit_max_de00;     // over the fitted patches
    struct display_uncertainty uncertainty; // all 0 where the file says nothing of it
};

bool display_save(const char *path, const struct display_model *model,
                  const struct display_origin *origin, struct error *err);

// Loads and prepares. Refuses what display_model_prepare refuses, with file,
// line and section. origin may be NULL.
bool display_load(const char *path, struct display_model *model, struct display_origin *origin,
                  struct error *err);

#endif
