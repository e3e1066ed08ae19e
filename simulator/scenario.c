// SPDX-License-Identifier: Apache-2.0
#include "simulator/scenario.h"

#include <ctype.h>
#include <string.h>

#include "files/ini.h"
#include "simulator/model_ooi_kind.h"
#include "simulator/model_witmotion.h"
#include "simulator/sensor.h"
#include "simulator/spotread_meter.h"

#define DOUBLE(f, lo, hi, unit, preset, help)                                                      \
    {                                                                                              \
#f, SETTING_DOUBLE, offsetof(struct OWNER, f), 0, lo, hi, unit, NULL, preset, help         \
    }
#define INT(f, lo, hi, unit, preset, help)                                                         \
    {                                                                                              \
#f, SETTING_INT, offsetof(struct OWNER, f), 0, lo, hi, unit, NULL, preset, help            \
    }
#define BOOL(f, preset, help)                                                                      \
    {                                                                                              \
#f, SETTING_BOOL, offsetof(struct OWNER, f), 0, 0, 0, "", NULL, preset, help               \
    }
#define TEXT(f, preset, help)                                                                      \
    {                                                                                              \
#f, SETTING_TEXT, offsetof(struct OWNER, f), SETTING_SIZE(struct OWNER, f), 0, 0, "",      \
            NULL, preset, help                                                                     \
    }
#define VECTOR(f, n, lo, hi, unit, preset, help)                                                   \
    {                                                                                              \
#f, SETTING_VECTOR, offsetof(struct OWNER, f), n, lo, hi, unit, NULL, preset, help         \
    }

// A pair of whole numbers: settings vectors are of doubles, so two rows.
#define PIXELS(name, f, i, preset, help)                                                           \
    {                                                                                              \
        name, SETTING_INT, offsetof(struct OWNER, f) + (i) * sizeof(int), 0, 16, 4096, "px", NULL, \
            preset, help                                                                           \
    }

#define OWNER scenario_world
static const struct setting world_rows[] = {
    INT(seed, 0, 1e9, "", "1", "Seed of every chance in this world."),
    DOUBLE(speed, 0.01, 1e5, "", "1", "World seconds per second, for script and warm-up."),
    BOOL(cold, "no", "Whether a lamp is cold each time it is switched on."),
    TEXT(script, "", "File of timed events; empty = none."),
    TEXT(lamp, "", "Lamp at the start; empty = the first, none = dark."),
    DOUBLE(level, 0, 1.2, "", "1", "Its level."),
    DOUBLE(enumeration_s, 0, 60, "s", "2",
           "How long a USB device or the camera takes to show once it is plugged in again."),
    DOUBLE(line_enumeration_s, 0, 60, "s", "0", "How long a serial line takes."),
    {0},
};
#undef OWNER
#define OWNER scenario_screen
static const struct setting screen_rows[] = {
    DOUBLE(width_m, 0.05, 5, "m", "0.520", "Width of the active area."),
    DOUBLE(height_m, 0.05, 5, "m", "0.325", "Height of the active area."),
    INT(width_px, 16, 16384, "px", "1280", "Pixels across."),
    INT(height_px, 16, 16384, "px", "800", "Pixels down."),
    {0},
};
#undef OWNER
#define OWNER scenario_stand
static const struct setting stand_rows[] = {
    VECTOR(hinge_m, 3, -5, 5, "m", "0 0 0", "A point of the hinge, booth frame."),
    VECTOR(centre_from_hinge_m, 3, -5, 5, "m", "0 0.20 0.03",
           "Screen centre from the hinge, in screen axes."),
    DOUBLE(tilt_deg, -90, 180, "deg", "30", "Tilt at the start; 0 lies flat, 90 stands."),
    {0},
};
#undef OWNER
#define OWNER scenario_ceiling
static const struct setting ceiling_rows[] = {
    VECTOR(centre_m, 3, -5, 5, "m", "0 0.75 0.05", "Centre, booth frame."),
    DOUBLE(width_m, 0.05, 20, "m", "0.90", "Extent along x."),
    DOUBLE(depth_m, 0.05, 20, "m", "0.60", "Extent along z."),
    PIXELS("true_width_px", true_px, 0, "512", "Columns of the true luminance image."),
    PIXELS("true_height_px", true_px, 1, "340", "Rows of the true luminance image."),
    PIXELS("map_width_px", map_px, 0, "256", "Columns of the camera's map."),
    PIXELS("map_height_px", map_px, 1, "170", "Rows of the camera's map."),
    DOUBLE(map_noise, 0, 0.5, "", "0.005", "Relative noise of a pixel of the map."),
    DOUBLE(map_read_noise_cdm2, 0, 1000, "cd/m2", "2", "Noise of a dark pixel of the map."),
    DOUBLE(map_scale_error, 0, 0.5, "", "0.04", "Greatest relative error of a map's scale."),
    {0},
};
#undef OWNER
#define OWNER scenario_head
static const char *const worn[] = {"clip", "cap", NULL};
static const struct setting head_rows[] = {
    VECTOR(eye_m, 3, -5, 5, "m", "0 0.55 0.65", "Midpoint of the eyes, booth frame."),
    VECTOR(clip_from_eye_m, 3, -1, 1, "m", "0 0.06 0.02",
           "Origin of the marker clip from there, when the head faces along -z."),
    DOUBLE(turn_most_deg, 0, 60, "deg", "10", "How far the head turns to face the screen."),
    {"markers", SETTING_ENUM, offsetof(struct OWNER, markers), 0, 0, 0, "", worn, "clip",
     "Which three markers the head wears."},
    BOOL(fourth, "no", "Whether it wears a fourth one."),
    VECTOR(fourth_m, 3, -1, 1, "m", "0.06 0.03 -0.02",
           "Its place from the origin of clip or cap: x to the right, y up, z into the head."),
    {0},
};
#undef OWNER
#define OWNER scenario_camera
static const struct setting camera_rows[] = {
    VECTOR(place_m, 3, -5, 5, "m", "0 0.35 -0.20", "Place of the lens, booth frame."),
    DOUBLE(pitch_deg, -90, 90, "deg", "10", "How far the optical axis points above +z."),
    DOUBLE(yaw_deg, -90, 90, "deg", "0", "How far the optical axis turns towards +x."),
    DOUBLE(roll_deg, -90, 90, "deg", "0", "How far the camera's right is turned up."),
    {0},
};
#undef OWNER
#define OWNER scenario_tools
static const struct setting tools_rows[] = {
    DOUBLE(protractor_deg, 0, 10, "deg", "0.05", "Standard deviation of a protractor's reading."),
    DOUBLE(tape_m, 0, 0.1, "m", "0.0005", "Standard deviation of a tape's, in x, y and z."),
    {0},
};
#undef OWNER
#define OWNER scenario_opentrack
static const struct setting opentrack_rows[] = {
    INT(port, 0, 65535, "", "0", "UDP port at 127.0.0.1 that opentrack sends to; 0 = none runs."),
    DOUBLE(rate_hz, 1, 1000, "Hz", "60", "How often it sends."),
    VECTOR(place_m, 3, -5, 5, "m", "0 0.35 -0.20", "Place of its camera, booth frame."),
    DOUBLE(pitch_deg, -90, 90, "deg", "10", "How far the camera's axis points above +z."),
    DOUBLE(yaw_deg, -90, 90, "deg", "0", "How far the camera's axis turns towards +x."),
    VECTOR(zero_m, 3, -5, 5, "m", "0 0 0",
           "Where it was centred: to the observer's right, up, away from the camera."),
    BOOL(mirrored, "yes", "Its picture is mirrored; else x, yaw and roll have the other sign."),
    {0},
};
#undef OWNER
#define OWNER scenario_ceiling_camera
static const char *const responses[] = {
#define X(name, text) text,
    SENSOR_RESPONSES(X)
#undef X
        NULL};
static const struct setting ceiling_camera_rows[] = {
    VECTOR(place_m, 3, -5, 5, "m", "0.02 0.05 0.08", "Place of the lens, booth frame."),
    DOUBLE(pitch_deg, -60, 60, "deg", "3", "Turn about its x axis; at 0 it looks straight up."),
    DOUBLE(yaw_deg, -60, 60, "deg", "-2", "Turn about its y axis."),
    DOUBLE(roll_deg, -180, 180, "deg", "1.5", "Turn about the optical axis."),
    INT(width_px, 16, 8192, "px", "1280", "Columns of a picture."),
    INT(height_px, 16, 8192, "px", "960", "Rows of a picture."),
    DOUBLE(focal_px, 10, 100000, "px", "820", "Focal length."),
    VECTOR(axis_px, 2, -4096, 4096, "px", "4.5 -3.2",
           "Where the optical axis falls, right of and below the middle."),
    VECTOR(radial, 3, -10, 10, "", "-0.12 0.03 -0.004", "Radial distortion K1, K2, K3."),
    VECTOR(decentred, 2, -1, 1, "", "0.0006 -0.0004", "Decentring distortion D1 (x), D2 (y)."),
    DOUBLE(vignetting, -1, 1, "", "-0.06",
           "Change of light with the squared tangent, beside the fourth power of the cosine."),
    BOOL(colour, "no", "Three colour channels instead of one."),
    INT(bits, 8, 16, "", "8", "Bits of a count: 8 or 16."),
    {"response", SETTING_ENUM, offsetof(struct OWNER, response), 0, 0, 0, "", responses, "film",
     "How counts follow light."},
    DOUBLE(sensitivity, 1e-3, 1e9, "e/(cd/m2 s)", "2000", "Electrons of a pixel on the axis."),
    DOUBLE(full_well_e, 100, 1e7, "e", "20000", "Electrons that a pixel holds."),
    DOUBLE(read_noise_e, 0, 1000, "e", "8", "Noise of reading a pixel."),
    DOUBLE(dark_e_s, 0, 1e5, "e/s", "12", "Dark current."),
    DOUBLE(hot_share, 0, 0.1, "", "0.0005", "Share of hot pixels."),
    DOUBLE(shortest_s, 1e-6, 60, "s", "0.000125", "Shortest exposure."),
    DOUBLE(ratio, 1.05, 16, "", "2.3", "Each exposure over the one before."),
    INT(exposures, 1, 32, "", "10", "How many exposures."),
    INT(darks, 0, 32, "", "3", "How many of the longest are taken with a capped lens too."),
    INT(flats, 0, 16, "", "4", "How many pictures of a field of equal luminance."),
    DOUBLE(wall_reflectance, 0, 1, "", "0.3", "Reflectance of the walls around the ceiling."),
    {0},
};
#undef OWNER
#define OWNER scenario_panel
static const struct setting panel_rows[] = {
    DOUBLE(white_cdm2, 1, 10000, "cd/m2", "900", "White at the centre, along the normal, warm."),
    DOUBLE(black_cdm2, 0, 100, "cd/m2", "0.3", "Light that leaks at zero drive."),
    DOUBLE(reflectance, 0, 0.2, "", "0.002", "Diffuse reflectance of the front surface."),
    INT(bits, 8, 10, "", "8", "Depth of the input: 8 or 10."),
    DOUBLE(interaction, 0, 4, "", "1", "Strength of the interaction of channels; 0 = none."),
    DOUBLE(dispersion, 0, 4, "", "1", "Strength of the colour shift with drive; 0 = none."),
    DOUBLE(ripple, 0, 4, "", "1", "Irregularity of the channel curves; 0 = none."),
    DOUBLE(uniformity, 0, 4, "", "1", "Strength of the non-uniformity; 0 = none."),
    DOUBLE(on_s, 0, 1e9, "s", "7200", "How long the panel has been on at the start."),
    DOUBLE(warmup_drop, 0, 0.5, "", "0.06", "Relative loss of light of the cold panel."),
    DOUBLE(warmup_s, 1, 1e6, "s", "900", "Time constant of its warm-up."),
    {0},
};
#undef OWNER
#define OWNER scenario_spectrometer
static const char *const spectrometers[] = {
#define X(name, text) text,
    OOI_KINDS(X)
#undef X
        NULL};
static const struct setting spectrometer_rows[] = {
    VECTOR(place_m, 3, -5, 5, "m", "0.30 0.05 0.05",
           "Place of the cosine corrector, which looks straight up whatever the tilt."),
    DOUBLE(collector_mm2, 0.01, 1000, "mm2", "11.95", "Area of the cosine corrector."),
    DOUBLE(calibration_error, -0.5, 0.5, "", "0",
           "Relative slope error over 180 nm of the calibration handed over."),
    {"model", SETTING_ENUM, offsetof(struct OWNER, model), 0, 0, 0, "", spectrometers,
     "usb2000plus", "Which spectrometer it is."},
    TEXT(serial, "EMU2P0001", "Serial number."),
    {0},
};
#undef OWNER
#define OWNER scenario_spectrometer_2
static const struct setting spectrometer_2_rows[] = {
    {"model", SETTING_ENUM, offsetof(struct OWNER, model), 0, 0, 0, "", spectrometers,
     "usb2000plus", "Which spectrometer the second one is."},
    TEXT(serial, "", "Its serial number; empty = there is no second one."),
    {0},
};
#undef OWNER
#define OWNER scenario_radiometer
static const struct setting radiometer_rows[] = {
    DOUBLE(screen_spot_m, 0.0005, 0.5, "m", "0.020", "Diameter of the spot on the screen."),
    DOUBLE(ceiling_spot_m, 0.0005, 0.5, "m", "0.010", "Diameter of the spot on the ceiling."),
    DOUBLE(hurry, 1, 1000, "", "20", "Divides the exposure times."),
    DOUBLE(drift, 0, 1, "", "0.01",
           "Fault drift: how much each reading is above the one before, relative."),
    INT(misread_every, 1, 1000, "", "3", "Fault misread: one reading of so many is false."),
    TEXT(serial, "EMU65501", "Serial number."),
    {0},
};
#undef OWNER
#define OWNER scenario_spotread
static const char *const spotreads[] = {
#define X(name, text) text,
    SPOTREAD_KINDS(X)
#undef X
        NULL};
static const struct setting spotread_rows[] = {
    {"model", SETTING_ENUM, offsetof(struct OWNER, model), 0, 0, 0, "", spotreads, "specbos",
     "Which instrument the emulated spotread drives."},
    TEXT(serial, "EMUSPOT1", "Its serial number."),
    {0},
};
#undef OWNER
#define OWNER scenario_inclinometer
static const char *const inclinometers[] = {
#define X(name, text) text,
    WITMOTION_MAPS(X)
#undef X
        NULL};
static const struct setting inclinometer_rows[] = {
    {"model", SETTING_ENUM, offsetof(struct OWNER, model), 0, 0, 0, "", inclinometers, "wt901c",
     "Which inclinometer it is: angles of 16 bits, or of 32."},
    BOOL(tcp, "no", "Modbus TCP at 127.0.0.1 instead of RTU on a line."),
    INT(port, 0, 65535, "", "0", "Its TCP port; 0 = any, told in the file inclinometer.port."),
    VECTOR(turned_deg, 3, -80, 80, "deg", "0 0 0",
           "How it is turned on the screen: about its right, then the sensor's own up and out."),
    TEXT(serial, "EMUWT901", "Serial number."),
    {0},
};
#undef OWNER
#define OWNER scenario_serial
static const struct setting tracker_rows[] = {
    TEXT(serial, "EMUWIIMOTE", "Serial number."),
    {0},
};
#undef OWNER
#define OWNER scenario_lamp
static const char *const forms[] = {"tubes", "spots", NULL};
static const struct setting lamp_rows[] = {
    TEXT(name, "", "Name: letters, digits, '.', '_', '-'; empty = no lamp here."),
    TEXT(spectrum, "D65", "CIE name, or a file: CSV (nm, power) or .sp."),
    {"form", SETTING_ENUM, offsetof(struct OWNER, form), 0, 0, 0, "", forms, "tubes",
     "Tubes along x, or round hot spots."},
    INT(count, 1, 16, "", "2", "Number of tubes or spots."),
    VECTOR(row_m, 2, -10, 10, "m", "-0.12 0.12",
           "First and last of the row from the ceiling's centre: tubes along z, spots along x."),
    DOUBLE(offset_m, -10, 10, "m", "0", "Offset of the row along the other axis."),
    DOUBLE(diameter_m, 0.002, 1, "m", "0.026", "Diameter of a tube or a spot."),
    DOUBLE(length_m, 0.01, 10, "m", "0.80", "Length of a tube."),
    DOUBLE(haze, 0, 1, "", "0.01", "Luminance of the ceiling between, over the greatest."),
    DOUBLE(lux, 1, 100000, "lx", "1500", "Illuminance at the screen's centre at the start."),
    DOUBLE(warmup_drop, 0, 0.9, "", "0.08", "Relative loss of light just after a cold start."),
    DOUBLE(warmup_s, 0.1, 1e6, "s", "240", "Time constant of the warm-up."),
    {0},
};
#undef OWNER

enum { SECTIONS = 16, SECTIONS_ALL = SECTIONS + SCENARIO_LAMPS_MOST + 1 };

static const char *const lamp_sections[SCENARIO_LAMPS_MOST] = {"lamp1", "lamp2", "lamp3",
                                                               "lamp4", "lamp5", "lamp6"};

static void sections_of(struct scenario *s, struct settings_section out[SECTIONS_ALL])
{
    const struct settings_section fixed[SECTIONS] = {
        {"world", world_rows, &s->world},
        {"screen", screen_rows, &s->screen},
        {"stand", stand_rows, &s->stand},
        {"ceiling", ceiling_rows, &s->ceiling},
        {"head", head_rows, &s->head},
        {"camera", camera_rows, &s->camera},
        {"opentrack", opentrack_rows, &s->opentrack},
        {"ceiling_camera", ceiling_camera_rows, &s->ceiling_camera},
        {"tools", tools_rows, &s->tools},
        {"panel", panel_rows, &s->panel},
        {"spectrometer", spectrometer_rows, &s->spectrometer},
        {"spectrometer2", spectrometer_2_rows, &s->spectrometer_2},
        {"radiometer", radiometer_rows, &s->radiometer},
        {"spotread", spotread_rows, &s->spotread},
        {"inclinometer", inclinometer_rows, &s->inclinometer},
        {"tracker", tracker_rows, &s->tracker},
    };
    memcpy(out, fixed, sizeof fixed);
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++)
        out[SECTIONS + i] = (struct settings_section){lamp_sections[i], lamp_rows, &s->lamps[i]};
    out[SECTIONS_ALL - 1] = (struct settings_section){0};
}

void scenario_preset(struct scenario *scenario)
{
    struct settings_section sections[SECTIONS_ALL];
    memset(scenario, 0, sizeof *scenario);
    sections_of(scenario, sections);
    for (int i = 0; sections[i].name; i++)
        settings_preset(sections[i].rows, sections[i].target);
}

int scenario_lamp_index(const struct scenario *scenario, const char *name)
{
    for (int i = 0; *name && i < SCENARIO_LAMPS_MOST; i++)
        if (!strcmp(scenario->lamps[i].name, name))
            return i;
    return -1;
}

static bool check_name(const struct scenario *s, int index, struct error *err)
{
    const char *name = s->lamps[index].name;
    for (const char *c = name; *c; c++)
        if (!isalnum((unsigned char)*c) && !strchr("._-", *c))
            return fail(err, ERROR_CONFIG,
                        "[lamp%d] name: \"%s\" holds more than letters, digits, '.', '_', '-'",
                        index + 1, name);
    if (!strcmp(name, "none"))
        return fail(err, ERROR_CONFIG, "[lamp%d] name: \"none\" means darkness", index + 1);
    int first = scenario_lamp_index(s, name);
    if (*name && first != index)
        return fail(err, ERROR_CONFIG, "[lamp%d] name: \"%s\" is already [lamp%d]", index + 1, name,
                    first + 1);
    return true;
}

static bool check_serial(const char *section, const char *serial, struct error *err)
{
    if (strncmp(serial, "EMU", 3))
        return fail(err, ERROR_CONFIG, "[%s] serial: \"%s\" does not begin with EMU", section,
                    serial);
    return true;
}

static bool check(const struct scenario *s, struct error *err)
{
    int lamps = 0;
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++) {
        if (!check_name(s, i, err))
            return false;
        lamps += s->lamps[i].name[0] != 0;
    }
    if (!lamps)
        return fail(err, ERROR_CONFIG, "no lamp: at least one of [lamp1] .. [lamp%d] needs a name",
                    SCENARIO_LAMPS_MOST);
    const char *first = s->world.lamp;
    if (*first && strcmp(first, "none") && scenario_lamp_index(s, first) < 0)
        return fail(err, ERROR_CONFIG, "[world] lamp: \"%s\" is no lamp of this booth", first);
    if (s->panel.bits == 9)
        return fail(err, ERROR_CONFIG, "[panel] bits: 9 is neither 8 nor 10");
    if (s->ceiling_camera.bits != 8 && s->ceiling_camera.bits != 16)
        return fail(err, ERROR_CONFIG, "[ceiling_camera] bits: %d is neither 8 nor 16",
                    s->ceiling_camera.bits);
    if (s->panel.black_cdm2 >= s->panel.white_cdm2)
        return fail(err, ERROR_CONFIG, "[panel] black_cdm2: %g is not below white_cdm2 %g",
                    s->panel.black_cdm2, s->panel.white_cdm2);
    const char *second = s->spectrometer_2.serial;
    if (*second && !strcmp(second, s->spectrometer.serial))
        return fail(err, ERROR_CONFIG, "[spectrometer2] serial: \"%s\" is the first one's", second);
    return check_serial("spectrometer", s->spectrometer.serial, err) &&
           (!*second || check_serial("spectrometer2", second, err)) &&
           check_serial("radiometer", s->radiometer.serial, err) &&
           check_serial("spotread", s->spotread.serial, err) &&
           check_serial("inclinometer", s->inclinometer.serial, err) &&
           check_serial("tracker", s->tracker.serial, err);
}

bool scenario_check(const struct scenario *scenario, struct error *err)
{
    if (check(scenario, err))
        return true;
    return *scenario->path ? while_doing(err, "%s", scenario->path) : false;
}

bool scenario_load(const char *path, struct scenario *scenario, struct error *err)
{
    if (strlen(path) >= SCENARIO_PATH_SIZE)
        return fail(err, ERROR_CONFIG, "%.40s...: the path is too long", path);
    struct settings_section sections[SECTIONS_ALL];
    memset(scenario, 0, sizeof *scenario);
    sections_of(scenario, sections);
    if (!ini_load(path, sections, err))
        return false;
    strcpy(scenario->path, path);
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++) {
        char *spectrum = scenario->lamps[i].spectrum, beside[SCENARIO_PATH_SIZE * 2];
        if (!strchr(spectrum, '/') && !strstr(spectrum, ".csv") && !strstr(spectrum, ".sp"))
            continue;
        scenario_beside(scenario, spectrum, beside);
        if (strlen(beside) >= SCENARIO_PATH_SIZE)
            return fail(err, ERROR_CONFIG, "%s: [lamp%d] spectrum: the path is too long", path,
                        i + 1);
        strcpy(spectrum, beside);
    }
    return scenario_check(scenario, err);
}

bool scenario_set_lamp(struct scenario *scenario, const char *text, struct error *err)
{
    const char *equals = strchr(text, '=');
    if (!equals || equals == text || !equals[1])
        return fail(err, ERROR_CONFIG, "--lamp %s: is not NAME=SPECTRUM", text);
    size_t length = equals - text;
    if (length >= SCENARIO_NAME_SIZE || strlen(equals + 1) >= SCENARIO_PATH_SIZE)
        return fail(err, ERROR_CONFIG, "--lamp %s: is too long", text);
    char name[SCENARIO_NAME_SIZE] = "";
    memcpy(name, text, length);
    int at = scenario_lamp_index(scenario, name);
    for (int i = 0; at < 0 && i < SCENARIO_LAMPS_MOST; i++)
        if (!scenario->lamps[i].name[0])
            at = i;
    if (at < 0)
        return fail(err, ERROR_CONFIG, "--lamp %s: there are %d lamps already", text,
                    SCENARIO_LAMPS_MOST);
    strcpy(scenario->lamps[at].name, name);
    strcpy(scenario->lamps[at].spectrum, equals + 1);
    if (!scenario_check(scenario, err))
        return while_doing(err, "--lamp %s", text);
    return true;
}

void scenario_beside(const struct scenario *scenario, const char *path,
                     char out[SCENARIO_PATH_SIZE * 2])
{
    const char *slash = strrchr(scenario->path, '/');
    int folder = slash && *path != '/' ? (int)(slash - scenario->path + 1) : 0;
    snprintf(out, SCENARIO_PATH_SIZE * 2, "%.*s%s", folder, scenario->path, path);
}

void scenario_describe(FILE *out)
{
    struct scenario scenario;
    struct settings_section sections[SECTIONS_ALL];
    scenario_preset(&scenario);
    sections_of(&scenario, sections);
    for (int i = 0; i < SECTIONS + 1; i++)
        settings_describe(&sections[i], out);
}
