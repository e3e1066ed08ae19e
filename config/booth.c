// SPDX-License-Identifier: Apache-2.0
#include "config/booth.h"

#include <stddef.h>

#define AT(field) offsetof(struct booth_settings, field)
#define ROOM(field) SETTING_SIZE(struct booth_settings, field)

static const char *const output_names[] = {"auto", "window", "offscreen", NULL};
static const char *const spectral_names[] = {"auto", "bands", "product", "full", NULL};
static const char *const cut_names[] = {"variance", "energy", NULL};
static const char *const expired_names[] = {"refuse", "warn", NULL};
static const char *const eye_filter_names[] = {"none", "one-euro", "kalman", NULL};
static const char *const bits_names[] = {"8", "10", NULL};
static const char *const observer_names[] = {
#define X(name, text) text,
    OBSERVERS(X)
#undef X
        NULL};

static const struct setting booth_rows[] = {
    {"name", SETTING_TEXT, AT(booth.name), ROOM(booth.name), 0, 0, "", NULL, "booth",
     "Name of this booth in status and reports."},
    {"emulated", SETTING_BOOL, AT(booth.emulated), 0, 0, 0, "", NULL, "no",
     "The booth is emulated: everything measured in it is labelled so."},
    {0}};

static const struct setting screen_rows[] = {
    {"width_m", SETTING_DOUBLE, AT(screen.width_m), 0, 0.05, 5, "m", NULL, NULL,
     "Width of the screen's active area."},
    {"height_m", SETTING_DOUBLE, AT(screen.height_m), 0, 0.05, 5, "m", NULL, NULL,
     "Height of the screen's active area."},
    {"width_px", SETTING_INT, AT(screen.width_px), 0, 16, 16384, "px", NULL, NULL,
     "Pixels across the screen."},
    {"height_px", SETTING_INT, AT(screen.height_px), 0, 16, 16384, "px", NULL, NULL,
     "Pixels down the screen."},
    {0}};

static const struct setting stand_rows[] = {
    {"hinge_m", SETTING_VECTOR, AT(stand.stand.hinge_m), 3, -10, 10, "m", NULL, "0 0 0",
     "A point of the hinge line (x right, y up, z towards the observer)."},
    {"centre_from_hinge_m", SETTING_VECTOR, AT(stand.stand.centre_from_hinge_m), 3, -10, 10, "m",
     NULL, NULL, "Centre of the screen from the hinge, in the screen's axes (right, up, out), unless a "
     "calibration of the store gives it."},
    {"default_tilt_deg", SETTING_DOUBLE, AT(stand.default_tilt_deg), 0, -180, 180, "deg", NULL,
     "30", "Tilt believed until the accelerometer has spoken; 0 lies flat, 90 stands upright."},
    {0}};

static const struct setting ceiling_rows[] = {
    {"centre_m", SETTING_VECTOR, AT(ceiling.centre_m), 3, -20, 20, "m", NULL, NULL,
     "Centre of the luminous ceiling in the booth."},
    {"width_m", SETTING_DOUBLE, AT(ceiling.width_m), 0, 0.01, 20, "m", NULL, NULL,
     "Width of the ceiling, left to right."},
    {"depth_m", SETTING_DOUBLE, AT(ceiling.depth_m), 0, 0.01, 20, "m", NULL, NULL,
     "Depth of the ceiling, front to back."},
    {0}};

static const struct setting accelerometer_rows[] = {
    {"turned_deg", SETTING_VECTOR, AT(accelerometer.turned_deg), 3, -80, 80, "deg", NULL, "0 0 0",
     "How the sensor is turned on the screen: about the screen's right, then its own up, then its "
     "own out (boothcal tilt finds it)."},
    {0}};

static const struct setting tracker_rows[] = {
    {"place_m", SETTING_VECTOR, AT(tracker.place_m), 3, -20, 20, "m", NULL, "0 0 0",
     "Place of the camera in the booth."},
    {"pitch_deg", SETTING_DOUBLE, AT(tracker.pitch_deg), 0, -180, 180, "deg", NULL, "0",
     "Elevation of the camera's axis above the direction to the observer."},
    {"yaw_deg", SETTING_DOUBLE, AT(tracker.yaw_deg), 0, -180, 180, "deg", NULL, "0",
     "Turn of the camera's axis to the observer's right."},
    {"roll_deg", SETTING_DOUBLE, AT(tracker.roll_deg), 0, -180, 180, "deg", NULL, "0",
     "Roll of the camera about its own axis."},
    {"default_eye_m", SETTING_VECTOR, AT(tracker.default_eye_m), 3, -20, 20, "m", NULL,
     "0 0.55 0.65", "Place of the eye believed until the tracker has spoken."},
    {0}};

static const struct setting display_rows[] = {
    {"serial", SETTING_TEXT, AT(display.serial), ROOM(display.serial), 0, 0, "", NULL, "",
     "Panel and serial number of the proof screen, by which its calibrations are kept."},
    {"model", SETTING_TEXT, AT(display.model), ROOM(display.model), 0, 0, "", NULL, "",
     "File of the fitted display model (boothcal display fit); empty: the store's, or none yet."},
    {"view", SETTING_TEXT, AT(display.view), ROOM(display.view), 0, 0, "", NULL, "",
     "File of the display's fitted dependence on direction and place (boothcal display view); "
     "empty: the store's, or none: colours hold along the normal of the screen's centre."},
    {"bits", SETTING_ENUM, AT(display.bits_choice), 0, 0, 0, "", bits_names, "8",
     "Bits per channel that the display takes."},
    {"dither", SETTING_BOOL, AT(display.dither), 0, 0, 0, "", NULL, "yes",
     "Dither between codes when a material is shown."},
    {"reflectance", SETTING_DOUBLE, AT(display.reflectance), 0, 0, 0.2, "", NULL, "0.002",
     "Diffuse reflectance of the screen's own surface."},
    {"output", SETTING_ENUM, AT(display.output), 0, 0, 0, "", output_names, "auto",
     "Where to draw: a window where there is a display server (auto), always, or never."},
    {"monitor", SETTING_TEXT, AT(display.monitor), ROOM(display.monitor), 0, 0, "", NULL, "",
     "Name of the proof screen's monitor, such as DP-2; empty: the first one."},
    {"fullscreen", SETTING_BOOL, AT(display.fullscreen), 0, 0, 0, "", NULL, "yes",
     "Fill the monitor; else an undecorated window at its top left."},
    {0}};

static const struct setting lamps_rows[] = {
    {"folder", SETTING_TEXT, AT(lamps.folder), ROOM(lamps.folder), 0, 0, "", NULL, "",
     "Folder of the taught lamps (NAME.ini, NAME.sp, luminance map); empty: the store's, or "
     "'lamps' where there is no store."},
    {"declared", SETTING_TEXT, AT(lamps.declared), ROOM(lamps.declared), 0, 0, "", NULL, "",
     "Lamp taken for granted in a booth without a spectrometer; empty: none."},
    {0}};

static const struct setting materials_rows[] = {
    {"folder", SETTING_TEXT, AT(materials.folder), ROOM(materials.folder), 0, 0, "", NULL, "",
     "Folder of the materials (NAME.ini); empty: the shipped ones."},
    {"show", SETTING_TEXT, AT(materials.show), ROOM(materials.show), 0, 0, "", NULL, "",
     "Material shown at the start: a name or the path of its file; empty: none."},
    {0}};

static const struct setting quality_rows[] = {
    {"observer", SETTING_ENUM, AT(quality.observer), 0, 0, 0, "", observer_names, "1931-2",
     "Colour-matching functions; only 1931-2, which display model and luminance stand on."},
    {"spectral", SETTING_ENUM, AT(quality.spectral), 0, 0, 0, "", spectral_names, "auto",
     "How surface meets lamp: full spectra where known (auto), bands, product, full."},
    {"bands", SETTING_TEXT, AT(quality.bands), ROOM(quality.bands), 0, 0, "", NULL, "6",
     "Spectral bands: how many, 3..16, or a file of 'boothcal bands optimise'."},
    {"lights", SETTING_INT, AT(quality.lights), 0, 1, 4096, "", NULL, "128",
     "Light points that stand for the ceiling."},
    {"cut", SETTING_ENUM, AT(quality.cut), 0, 0, 0, "", cut_names, "variance",
     "How the ceiling is cut into light points."},
    {0}};

static const struct setting state_rows[] = {
    {"lamp_hold_s", SETTING_DOUBLE, AT(state.lamp_hold_s), 0, 0, 3600, "s", NULL, "10",
     "How long the last lamp is believed while the spectrometer is silent or the light unknown."},
    {"tilt_hold_s", SETTING_DOUBLE, AT(state.tilt_hold_s), 0, 0, 3600, "s", NULL, "2",
     "How long the last tilt is believed while the accelerometer is silent."},
    {"eye_hold_s", SETTING_DOUBLE, AT(state.eye_hold_s), 0, 0, 3600, "s", NULL, "0.25",
     "How long the last place of the eye is believed while the markers are not seen."},
    {"level_s", SETTING_DOUBLE, AT(state.level_s), 0, 0, 60, "s", NULL, "2",
     "Time constant over which the lamp's level is smoothed."},
    {"tilt_s", SETTING_DOUBLE, AT(state.tilt_s), 0, 0, 10, "s", NULL, "0.2",
     "Time constant over which a resting tilt is smoothed."},
    {"eye_s", SETTING_DOUBLE, AT(state.eye_s), 0, 0, 10, "s", NULL, "0.1",
     "Time constant over which the place of a resting eye is smoothed (one-euro)."},
    {"eye_filter", SETTING_ENUM, AT(state.eye_filter), 0, 0, 0, "", eye_filter_names, "kalman",
     "How the place of the eye is smoothed: nearest while it moves (kalman), or steadiest at rest "
     "(one-euro)."},
    {"eye_noise_m", SETTING_DOUBLE, AT(state.eye_noise_m), 0, 0.0001, 0.1, "m", NULL, "0.002",
     "Noise of one place as the tracker sees it, across its line of sight (kalman)."},
    {"eye_depth_noise_m", SETTING_DOUBLE, AT(state.eye_depth_noise_m), 0, 0.0001, 0.1, "m", NULL,
     "0.008", "Noise of one place along the tracker's line of sight (kalman)."},
    {"eye_acceleration", SETTING_DOUBLE, AT(state.eye_acceleration), 0, 0.01, 100, "m/s2", NULL,
     "8", "How hard a head accelerates, from one sample to the next (kalman)."},
    {"eye_ahead_s", SETTING_DOUBLE, AT(state.eye_ahead_s), 0, 0, 0.05, "s", NULL, "0.03",
     "From a frame's start to its light, over which the place of the eye is predicted; 0: not."},
    {"dark_lux", SETTING_DOUBLE, AT(state.dark_lux), 0, 0, 1000, "lx", NULL, "5",
     "Illuminance below which no lamp is on."},
    {"lamp_distance", SETTING_DOUBLE, AT(state.lamp_distance), 0, 0.001, 1, "", NULL, "0.01",
     "Greatest difference of spectral shape at which a lamp is still recognised."},
    {"confirmations", SETTING_INT, AT(state.confirmations), 0, 1, 20, "", NULL, "2",
     "Readings in a row that must agree before another lamp is believed."},
    {0}};

static const struct setting calibration_rows[] = {
    {"store", SETTING_TEXT, AT(calibration.store), ROOM(calibration.store), 0, 0, "", NULL, "",
     "Folder of the store of calibrations, which provides display model, lamps and geometry where "
     "nothing here names them; empty: none."},
    {"valid_days", SETTING_DOUBLE, AT(calibration.valid_days), 0, 0, 3650, "d", NULL, "30",
     "How long a new calibration of display and lamps is valid; 0: for ever."},
    {"expired", SETTING_ENUM, AT(calibration.expired), 0, 0, 0, "", expired_names, "refuse",
     "What becomes of a calibration past that time: nothing is shown (refuse), or it is said "
     "(warn)."},
    {0}};

static const struct setting control_rows[] = {
    {"socket", SETTING_TEXT, AT(control.socket), ROOM(control.socket), 0, 0, "", NULL, "",
     "Control socket; empty: boothd/boothd.sock in the user's runtime folder."},
    {0}};

// "none" and the names of one registry, as the choices of a "driver" row.
#define NAMES_OF(kind)                                                                             \
    static const char *const *kind##_names(const char **names)                                     \
    {                                                                                              \
        size_t n = 0;                                                                              \
        for (names[n++] = "none"; kind##_drivers[n - 1] && n <= BOOTH_DRIVERS_MOST; n++)           \
            names[n] = kind##_drivers[n - 1]->name;                                                \
        names[n] = NULL;                                                                           \
        return names;                                                                              \
    }
NAMES_OF(spectrometer)
NAMES_OF(accelerometer)
NAMES_OF(tracker)
NAMES_OF(radiometer)

// Gathers the rows of one section after another into one growing table.
struct gathering {
    struct booth_tables *tables;
    struct booth_settings *booth;
    size_t rows, sections;
};

static void append(struct gathering *g, const struct setting *rows, size_t shift)
{
    for (; rows->name && g->rows < BOOTH_ROWS_MOST - 1; rows++) {
        g->tables->rows[g->rows] = *rows;
        g->tables->rows[g->rows++].offset += shift;
    }
}

static void begin(struct gathering *g, const char *name)
{
    g->tables->sections[g->sections++] =
        (struct settings_section){name, &g->tables->rows[g->rows], g->booth};
}

static void finish(struct gathering *g)
{
    g->tables->rows[g->rows++] = (struct setting){0};
}

static void section(struct gathering *g, const char *name, const struct setting *rows)
{
    begin(g, name);
    append(g, rows, 0);
    finish(g);
}

static void driver_section(struct gathering *g, const char *name, size_t driver_at,
                           const char *const *names, const struct setting *options,
                           size_t options_at, const struct setting *more)
{
    const struct setting driver[] = {{"driver", SETTING_ENUM, driver_at, 0, 0, 0, "", names,
                                      names[1] ? names[1] : "none",
                                      "Which kind of instrument it is."},
                                     {0}};
    begin(g, name);
    append(g, driver, 0);
    append(g, options, options_at);
    if (more)
        append(g, more, 0);
    finish(g);
}

void booth_tables_init(struct booth_tables *tables, struct booth_settings *booth)
{
    struct gathering g = {tables, booth, 0, 0};
    *tables = (struct booth_tables){0};
    section(&g, "booth", booth_rows);
    section(&g, "screen", screen_rows);
    section(&g, "stand", stand_rows);
    section(&g, "ceiling", ceiling_rows);
    driver_section(&g, "spectrometer", AT(spectrometer.driver),
                   spectrometer_names(tables->drivers[0]), spectrometer_settings,
                   AT(spectrometer.options), NULL);
    driver_section(&g, "accelerometer", AT(accelerometer.driver),
                   accelerometer_names(tables->drivers[1]), accelerometer_settings,
                   AT(accelerometer.options), accelerometer_rows);
    driver_section(&g, "tracker", AT(tracker.driver), tracker_names(tables->drivers[2]),
                   tracker_settings, AT(tracker.options), tracker_rows);
    driver_section(&g, "radiometer", AT(radiometer.driver), radiometer_names(tables->drivers[3]),
                   radiometer_settings, AT(radiometer.options), NULL);
    section(&g, "display", display_rows);
    section(&g, "lamps", lamps_rows);
    section(&g, "materials", materials_rows);
    section(&g, "quality", quality_rows);
    section(&g, "state", state_rows);
    section(&g, "calibration", calibration_rows);
    section(&g, "control", control_rows);
}
