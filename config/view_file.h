// SPDX-License-Identifier: Apache-2.0
// The fitted dependence of a display on direction and place, on disk (INI):
// boothcal writes it, boothd loads it.
#ifndef CONFIG_VIEW_FILE_H
#define CONFIG_VIEW_FILE_H

#include "colorimetry/display_view.h"

// What the fit was made from, and what it left over.
struct view_origin {
    char instrument[128], date[32], software[64];
    char model[512];                // display model whose primaries it stands on
    int directions, places;         // measured
    double before_de00, after_de00; // largest of white over the measured directions
};

bool view_save(const char *path, const struct display_view *view, const struct view_origin *origin,
               struct error *err);

// Loads and prepares. Refuses what display_view_prepare refuses, naming the
// file. origin may be NULL.
bool view_load(const char *path, struct display_view *view, struct view_origin *origin,
               struct error *err);

#endif
