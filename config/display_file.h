// SPDX-License-Identifier: Apache-2.0
// The fitted display model on disk (INI): boothcal writes it, boothd loads it.
// [display] model says which it is; only the sections that it uses are written
// ([interaction] or [residual]). A file without that key is plain Day, as
// files were before the others.
#ifndef CONFIG_DISPLAY_FILE_H
#define CONFIG_DISPLAY_FILE_H

#include "colorimetry/display.h"

// What the fit was made from: stays with the model.
struct display_origin {
    char instrument[128], date[32], software[64], source[512]; // source: the .ti3
    int patches;
    double fit_mean_de00, fit_max_de00; // over the fitted patches
};

bool display_save(const char *path, const struct display_model *model,
                  const struct display_origin *origin, struct error *err);

// Loads and prepares. Refuses what display_model_prepare refuses, with file,
// line and section. origin may be NULL.
bool display_load(const char *path, struct display_model *model, struct display_origin *origin,
                  struct error *err);

#endif
