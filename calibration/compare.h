// SPDX-License-Identifier: Apache-2.0
// By how much two versions of a calibration differ.
#ifndef CALIBRATION_COMPARE_H
#define CALIBRATION_COMPARE_H

#include "calibration/statistics.h"
#include "colorimetry/display.h"
#include "config/booth.h"
#include "config/lamps.h"
#include "config/store.h"

enum file_change_kind { FILE_ADDED, FILE_REMOVED, FILE_CHANGED };

struct file_change {
    enum file_change_kind kind;
    char path[256];
};

// Of the display model; what `there` is false for is not in both versions.
struct display_change {
    bool there;
    struct summary
        de00; // CIEDE2000 of equal counts, a grid of 9x9x9 and 33 greys, white of the first
    double white_percent; // luminance of white, second over first
    double black_cdm2;    // second less first
};

struct lamp_change {
    char name[64];
    double lux_percent; // illuminance as taught
    double white_de00;  // colour of its light alone, at equal luminance
    double shape;       // lamp_distance
    bool maps;          // both have a luminance map
    double map_percent; // mean luminance
    double map_shift_m; // of the light's centre on the ceiling
};

struct geometry_change {
    bool there;      // either version holds a geometry.ini
    double screen_m; // farthest that a corner of the screen goes, at tilts of 0..90 degrees
    double eye_m;    // an eye at the settings' default, as the tracker places it
};

struct difference {
    int file_count, lamp_count;
    struct file_change *files; // owned, in the order of their paths
    struct display_change display;
    struct lamp_change lamps[CLASSIFIER_LAMPS_MOST]; // those in both whose files differ
    struct geometry_change geometry;
};

void difference_fini(struct difference *difference);

// From a to b. booth: the settings they are used with (ceiling, screen, and
// geometry where a version has none). Errors name the file.
bool compare_versions(const struct store_version *a, const struct store_version *b,
                      const struct booth_settings *booth, struct difference *out,
                      struct error *err);

// Its parts.
bool compare_displays(const struct display_model *a, const struct display_model *b,
                      struct display_change *out, struct error *err);
double compare_stands(const struct stand *a, const struct stand *b, const struct screen *screen);

#endif
