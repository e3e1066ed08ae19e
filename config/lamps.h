// SPDX-License-Identifier: Apache-2.0
// The lamp folder: what was taught of each lamp. boothcal writes it, boothd
// loads it. Per lamp NAME.ini (facts), NAME.sp (spectral irradiance, CGATS)
// and the luminance map that NAME.ini names.
#ifndef CONFIG_LAMPS_H
#define CONFIG_LAMPS_H

#include "base/settings.h"
#include "colorimetry/classifier.h"
#include "render/lights.h"

// Section [lamp] of NAME.ini. Paths are relative to NAME.ini.
struct lamp_file {
    char name[64];      // letters, digits, '.', '-', '_'; equal to the file's
    char spectrum[512]; // .sp of the taught irradiance, W m-2 nm-1
    double spread;      // relative rms of the teaching readings, 0..1
    char map[512];      // EXR luminance map of the ceiling, "" = none yet
    double map_scale;   // spot reading over map reading, 0.01..100
    double taught_lux;  // at the spectrometer, 0..1e6
    char taught_at[32]; // UTC
    int readings;       // averaged when teaching, 1..10000
    char instrument[128];
};

extern const struct setting lamp_file_settings[];

struct lamp {
    struct lamp_file file; // paths whole, ready to open
    struct spectrum irradiance;
};

// Ordered by name.
struct lamps {
    int count; // 0..CLASSIFIER_LAMPS_MOST
    struct lamp *lamps;
};

void lamps_fini(struct lamps *lamps);

// One lamp from its NAME.ini. Errors name file, line, key, value. Refuses a
// spectrum without light and a taught_lux that contradicts it by more than 1 %.
bool lamp_load(const char *path, struct lamp *lamp, struct error *err);

// Every NAME.ini of a folder. An empty folder gives none; a folder that is not
// there is an error (CONFIG), one bad lamp refuses all.
bool lamps_load(const char *folder, struct lamps *lamps, struct error *err);

// Writes NAME.sp and then NAME.ini into folder (made when missing, its parents
// not). file.spectrum is set by this function; file.map is written relative
// to folder when it lies inside it.
bool lamp_save(const char *folder, const struct lamp *lamp, struct error *err);

// The lamps as the classifier wants them, its limits at their defaults.
void lamps_teach(const struct lamps *lamps, struct classifier *classifier);

// Light points of a lamp as taught (level 1): its map in cd/m2 times map_scale,
// cut into at most `most` points. Error CONFIG when the lamp has no map.
bool lamp_lights(const struct lamp *lamp, const struct ceiling *ceiling, enum median_cut how,
                 int most, struct light_points *out, struct error *err);

// Name fit for a file: 1..63 letters, digits, '.', '-', '_', not beginning
// with '.'.
bool lamp_name_fits(const char *name, struct error *err);

#endif
