// SPDX-License-Identifier: Apache-2.0
#include "config/lamps.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/settings.h"
#include "colorimetry/colour.h"
#include "config/paths.h"
#include "config/spectra.h"
#include "files/cgats.h"
#include "files/ini.h"

#define AT(field) offsetof(struct lamp_file, field)
#define ROOM(field) SETTING_SIZE(struct lamp_file, field)

// A spectrum and the lux beside it come from one reading; more than rounding
// apart, one of the two files is from another teaching.
static const double LUX_AGREES = 0.01;

const struct setting lamp_file_settings[] = {
    {"name", SETTING_TEXT, AT(name), ROOM(name), 0, 0, "", NULL, NULL, "Name of the lamp."},
    {"spectrum", SETTING_TEXT, AT(spectrum), ROOM(spectrum), 0, 0, "", NULL, NULL,
     "File of the taught spectral irradiance."},
    {"spread", SETTING_DOUBLE, AT(spread), 0, 0, 1, "", NULL, "0",
     "Relative rms of the readings it was taught from."},
    {"map", SETTING_TEXT, AT(map), ROOM(map), 0, 0, "", NULL, "",
     "Luminance map of the ceiling (EXR, cd/m2); empty: none yet."},
    {"map_scale", SETTING_DOUBLE, AT(map_scale), 0, 0.01, 100, "", NULL, "1",
     "Spot reading over the map's own reading there."},
    {"taught_lux", SETTING_DOUBLE, AT(taught_lux), 0, 0, 1e6, "lx", NULL, NULL,
     "Illuminance at the spectrometer when taught."},
    {"taught_at", SETTING_TEXT, AT(taught_at), ROOM(taught_at), 0, 0, "", NULL, "",
     "When it was taught (UTC)."},
    {"readings", SETTING_INT, AT(readings), 0, 1, 10000, "", NULL, "1",
     "Number of readings averaged."},
    {"instrument", SETTING_TEXT, AT(instrument), ROOM(instrument), 0, 0, "", NULL, "",
     "Spectrometer it was taught with."},
    {0}};

void lamps_fini(struct lamps *lamps)
{
    free(lamps->lamps);
    *lamps = (struct lamps){0};
}

bool lamp_name_fits(const char *name, struct error *err)
{
    static const char fine[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_";
    size_t length = strspn(name, fine);
    if (!length || name[length] || length > 63 || *name == '.')
        return fail(err, ERROR_RANGE,
                    "lamp name \"%.80s\": 1 to 63 letters, digits, '.', '-' or '_' are allowed, "
                    "not beginning with '.'",
                    name);
    return true;
}

static bool lamp_file_load(const char *path, struct lamp_file *file, struct error *err)
{
    const struct settings_section sections[] = {{"lamp", lamp_file_settings, file}, {0}};
    if (!ini_load(path, sections, err))
        return false;
    if (!lamp_name_fits(file->name, err) ||
        !path_beside(path, file->spectrum, file->spectrum, sizeof file->spectrum, err) ||
        !path_beside(path, file->map, file->map, sizeof file->map, err))
        return while_doing(err, "%s", path);
    return true;
}

static bool first_spectrum(const char *path, struct spectrum *out, struct error *err)
{
    struct spectra all = {0};
    if (!spectra_load(path, false, &all, err))
        return false;
    if (all.count == 1)
        *out = all.spectra[0];
    int count = all.count;
    spectra_fini(&all);
    return count == 1 || fail(err, ERROR_CONFIG, "%s: %d spectra where one is wanted", path, count);
}

bool lamp_load(const char *path, struct lamp *lamp, struct error *err)
{
    struct lamp loaded = {0};
    if (!lamp_file_load(path, &loaded.file, err) ||
        !first_spectrum(loaded.file.spectrum, &loaded.irradiance, err))
        return false;
    double lux = xyz_absolute(&loaded.irradiance, OBSERVER_1931_2).Y;
    double said = loaded.file.taught_lux;
    if (!(lux > 0))
        return fail(err, ERROR_CONFIG, "%s: the spectrum %s holds no light", path,
                    loaded.file.spectrum);
    if (fabs(lux - said) > LUX_AGREES * lux)
        return fail(err, ERROR_CONFIG,
                    "%s: taught_lux: %.6g contradicts the %.6g lx of %s by more than %g %%", path,
                    said, lux, loaded.file.spectrum, LUX_AGREES * 100);
    *lamp = loaded;
    return true;
}

static bool add(const char *folder, const char *file, struct lamps *lamps, struct error *err)
{
    char path[PATH_MAX];
    struct lamp *lamp = &lamps->lamps[lamps->count];
    if (snprintf(path, sizeof path, "%s/%s", folder, file) >= (int)sizeof path)
        return fail(err, ERROR_CONFIG, "%.200s: the path of %s is too long", folder, file);
    if (!lamp_load(path, lamp, err))
        return false;
    if (strncmp(lamp->file.name, file, strlen(file) - 4) ||
        strlen(lamp->file.name) != strlen(file) - 4)
        return fail(err, ERROR_CONFIG, "%s: name: \"%s\" is not the file's own name \"%.*s\"", path,
                    lamp->file.name, (int)strlen(file) - 4, file);
    lamps->count++;
    return true;
}

bool lamps_load(const char *folder, struct lamps *lamps, struct error *err)
{
    struct dirent **entries = NULL;
    struct lamps loaded = {0};
    int count = scandir(folder, &entries, path_is_ini, alphasort);
    if (count < 0)
        return fail(err, ERROR_CONFIG, "the lamp folder %s: %s", folder, strerror(errno));
    bool fine = true;
    if (count > CLASSIFIER_LAMPS_MOST)
        fine = fail(err, ERROR_CONFIG, "%s: %d lamps; at most %d are allowed", folder, count,
                    CLASSIFIER_LAMPS_MOST);
    loaded.lamps = calloc(CLASSIFIER_LAMPS_MOST, sizeof *loaded.lamps);
    if (!loaded.lamps)
        fine = fail(err, ERROR_SYSTEM, "no memory for the lamps");
    for (int i = 0; i < count; i++) {
        fine = fine && add(folder, entries[i]->d_name, &loaded, err);
        free(entries[i]);
    }
    free(entries);
    if (!fine) {
        lamps_fini(&loaded);
        return false;
    }
    *lamps = loaded;
    return true;
}

static void label(struct cgats_keyword *keyword, const char *name, const char *value)
{
    keyword->name = (char *)name;
    keyword->value = (char *)value;
}

static bool spectrum_save(const char *path, const struct lamp *lamp, struct error *err)
{
    enum { KEYWORDS = 7 };
    struct cgats_keyword keywords[KEYWORDS] = {0};
    char names[SPECTRUM_COUNT][16], bands[16], first[16], last[16];
    char *pointers[SPECTRUM_COUNT];
    int line = 0;
    snprintf(bands, sizeof bands, "%d", SPECTRUM_COUNT);
    snprintf(first, sizeof first, "%d", SPECTRUM_FIRST_NM);
    snprintf(last, sizeof last, "%d", SPECTRUM_LAST_NM);
    label(&keywords[0], "DESCRIPTOR", "Spectral irradiance of a lamp, W m-2 nm-1");
    label(&keywords[1], "ORIGINATOR", "boothd");
    label(&keywords[2], "CREATED", lamp->file.taught_at);
    label(&keywords[3], "SPECTRAL_BANDS", bands);
    label(&keywords[4], "SPECTRAL_START_NM", first);
    label(&keywords[5], "SPECTRAL_END_NM", last);
    label(&keywords[6], "SPECTRAL_NORM", "1.0");
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        snprintf(names[i], sizeof names[i], "SPEC_%d", SPECTRUM_FIRST_NM + i);
        pointers[i] = names[i];
    }
    struct cgats file = {.identifier = "SPECT", .keyword_count = KEYWORDS, .keywords = keywords};
    file.table = (struct table){.columns = SPECTRUM_COUNT,
                                .rows = 1,
                                .names = pointers,
                                .values = (double *)lamp->irradiance.v,
                                .lines = &line};
    return cgats_save(path, &file, err);
}

// A map inside the folder is named from there, so that the folder can move.
static const char *from_folder(const char *folder, const char *map)
{
    size_t length = strlen(folder);
    bool inside = !strncmp(folder, map, length) && map[length] == '/';
    return inside ? map + length + 1 : map;
}

bool lamp_save(const char *folder, const struct lamp *lamp, struct error *err)
{
    char path[PATH_MAX];
    struct lamp_file file = lamp->file;
    if (!lamp_name_fits(file.name, err))
        return false;
    if (mkdir(folder, 0777) && errno != EEXIST)
        return fail_errno(err, "making the lamp folder %s", folder);
    snprintf(file.spectrum, sizeof file.spectrum, "%s.sp", file.name);
    memmove(file.map, from_folder(folder, lamp->file.map),
            strlen(from_folder(folder, lamp->file.map)) + 1);
    if (snprintf(path, sizeof path, "%s/%s.sp", folder, file.name) >= (int)sizeof path - 1)
        return fail(err, ERROR_CONFIG, "the path of the lamp folder %.200s is too long", folder);
    if (!spectrum_save(path, lamp, err))
        return false;
    strcpy(strrchr(path, '.'), ".ini");
    const struct settings_section sections[] = {{"lamp", lamp_file_settings, &file}, {0}};
    return ini_save(path, sections, err);
}

void lamps_teach(const struct lamps *lamps, struct classifier *classifier)
{
    *classifier = (struct classifier){.count = lamps->count};
    for (int i = 0; i < lamps->count; i++) {
        struct taught_lamp *taught = &classifier->lamps[i];
        memcpy(taught->name, lamps->lamps[i].file.name, sizeof taught->name);
        taught->irradiance = lamps->lamps[i].irradiance;
        taught->spread = lamps->lamps[i].file.spread;
    }
    classifier_reset(classifier);
}

bool lamp_lights(const struct lamp *lamp, const struct ceiling *ceiling, enum median_cut how,
                 int most, struct light_points *out, struct error *err)
{
    struct luminance_map map = {0};
    if (!*lamp->file.map)
        return fail(err, ERROR_CONFIG, "lamp %s has no luminance map", lamp->file.name);
    if (!luminance_map_load(lamp->file.map, ceiling, &map, err))
        return while_doing(err, "lamp %s", lamp->file.name);
    luminance_map_scale(&map, lamp->file.map_scale);
    bool fine = median_cut(&map, how, most, out, err);
    luminance_map_fini(&map);
    return fine || while_doing(err, "lamp %s", lamp->file.name);
}
