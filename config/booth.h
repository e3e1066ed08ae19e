// SPDX-License-Identifier: Apache-2.0
// boothd.conf: every setting of a booth, its rows gathered from the folders
// that use them, and its bearing on them.
#ifndef CONFIG_BOOTH_H
#define CONFIG_BOOTH_H

#include "base/settings.h"
#include "drivers/accelerometer.h"
#include "drivers/radiometer.h"
#include "drivers/spectrometer.h"
#include "drivers/tracker.h"
#include "render/lights.h"
#include "render/material.h"
#include "render/stand.h"

enum booth_output {
    OUTPUT_AUTO,      // a window where there is a display server, else off screen
    OUTPUT_WINDOW,    // a window, or no start
    OUTPUT_OFFSCREEN, // never a window
};

// How the place of the eye is smoothed.
enum eye_filter { EYE_FILTER_NONE, EYE_FILTER_ONE_EURO, EYE_FILTER_KALMAN };

// What becomes of a calibration past its time.
enum expired_rule { EXPIRED_REFUSE, EXPIRED_WARN };

// The settings that the store of calibrations provides where nobody gives them.
#define BOOTH_STORED(X)                                                                            \
    X(MODEL, "display", "model")                                                                   \
    X(VIEW, "display", "view")                                                                     \
    X(LAMPS, "lamps", "folder")                                                                    \
    X(HINGE, "stand", "hinge_m") /* from here on of geometry.ini */                                \
    X(CENTRE, "stand", "centre_from_hinge_m")                                                      \
    X(TURNED, "accelerometer", "turned_deg")                                                       \
    X(PLACE, "tracker", "place_m")                                                                 \
    X(PITCH, "tracker", "pitch_deg")                                                               \
    X(YAW, "tracker", "yaw_deg")                                                                   \
    X(ROLL, "tracker", "roll_deg")

enum booth_stored {
#define X(name, section, key) STORED_##name,
    BOOTH_STORED(X)
#undef X
        STORED_COUNT
};

// "stand.hinge_m".
const char *booth_stored_name(enum booth_stored row);

// "stand.hinge_m, tracker.place_m" of a mask of 1 << row; "" of none.
void booth_stored_list(unsigned rows, char *text, size_t size);

// How long what an instrument said is believed when it says nothing more.
struct state_settings {
    double lamp_hold_s;      // 0..3600: lamp and level
    double tilt_hold_s;      // 0..3600
    double eye_hold_s;       // 0..3600
    double level_s;          // 0..60: time constant of the lamp's level
    double tilt_s;           // 0..10: time constant of the tilt
    int eye_filter;          // enum eye_filter
    double eye_s;            // 0..10: time constant of the resting eye, one-euro
    double eye_noise_m;      // 0.0001..0.1: of one place seen, across the line of sight, kalman
    double eye_depth_noise_m; // 0.0001..0.1: along it
    double eye_acceleration; // 0.01..100 m/s2: of a head, kalman
    double eye_ahead_s;      // 0..0.05: from a frame's start to its light; 0 = the eye as last seen
    double dark_lux;         // 0..1000: below it no lamp is on
    double lamp_distance;    // 0.001..1: greatest shape distance of a known lamp
    int confirmations;       // 1..20: equal readings before another lamp is believed
};

struct booth_settings {
    struct {
        char name[64];
        bool emulated; // the whole booth is: everything measured in it is labelled
    } booth;
    struct screen screen;
    struct {
        struct stand stand;
        double default_tilt_deg; // until the accelerometer has spoken, -180..180
    } stand;
    struct ceiling ceiling;
    // driver: 0 = none, else 1 + index into the registry of its kind.
    struct {
        int driver;
        struct spectrometer_options options;
    } spectrometer;
    struct {
        int driver;
        struct accelerometer_options options;
        double turned_deg[3]; // see tilt_of_turned
    } accelerometer;
    struct {
        int driver;
        struct tracker_options options;
        double place_m[3];                   // of the camera, booth frame
        double pitch_deg, yaw_deg, roll_deg; // see booth_from_tracker
        double default_eye_m[3];             // until the tracker has spoken
    } tracker;
    struct {
        int driver;
        struct radiometer_options options;
    } radiometer;
    struct {
        char serial[128]; // panel and serial number, "" = not told
        char model[512];  // fitted display model, "" = none
        char view[512];   // fitted dependence on direction and place, "" = none
        int bits_choice;  // see booth_bits
        bool dither;
        double reflectance; // diffuse, of the screen's surface, 0..0.2
        int output;         // enum booth_output
        char monitor[128];
        bool fullscreen;
    } display;
    struct {
        char folder[512];  // "" = the store has none yet
        char declared[64]; // lamp taken for granted where there is no spectrometer, "" = none
    } lamps;
    struct {
        char folder[512];
        char show[512]; // material shown at the start, "" = none
    } materials;
    struct {
        int observer;    // enum observer; only OBSERVER_1931_2 is loaded
        int spectral;    // enum spectral_mode
        char bands[512]; // count or file, see booth_bands
        int lights;      // 1..4096
        int cut;         // enum median_cut
    } quality;
    struct state_settings state;
    struct {
        char store[512];   // folder of the store, "" = none
        double valid_days; // of a new calibration, 0 = for ever
        int expired;       // enum expired_rule
    } calibration;
    struct {
        char socket[108]; // "" = booth_socket_default
    } control;
    unsigned given; // 1 << enum booth_stored: by file or override, or by geometry.ini
};

enum { BOOTH_SECTIONS = 15, BOOTH_ROWS_MOST = 256, BOOTH_DRIVERS_MOST = 16 };

// The sections of boothd.conf over one booth_settings. Filled by
// booth_tables_init; must not be copied or moved, since it points into itself.
struct booth_tables {
    struct settings_section sections[BOOTH_SECTIONS + 1]; // ends with a name of NULL
    struct setting rows[BOOTH_ROWS_MOST];
    const char *drivers[4][BOOTH_DRIVERS_MOST + 2]; // "none", the registry's names, NULL
};

// booth may be NULL for a description only.
void booth_tables_init(struct booth_tables *tables, struct booth_settings *booth);

// Every setting at its preset; those without one are zero.
void booth_preset(struct booth_settings *booth);

// Loads a settings file, applies count overrides "section.key=value" in order,
// makes paths relative to the file (in overrides: to the working folder)
// whole, and checks what no single row can. Errors (CONFIG) name file, line,
// key, value and what is allowed; booth is untouched on failure. Where a store
// is named, what it provides may be missing: see booth_from_store.
bool booth_load(const char *path, const char *const *overrides, int count,
                struct booth_settings *booth, struct error *err);

// Writes the commented default: what config/boothd.conf is made of.
void booth_describe(FILE *out);

// Writes the same rows as a list for boothd.conf(5), in roff.
void booth_describe_man(FILE *out);

// NULL when the settings say "none" (or name no port for a driver that needs one).
const struct spectrometer_driver *booth_spectrometer(const struct booth_settings *booth);
const struct accelerometer_driver *booth_accelerometer(const struct booth_settings *booth);
const struct tracker_driver *booth_tracker(const struct booth_settings *booth);
const struct radiometer_driver *booth_radiometer(const struct booth_settings *booth);

// The bands that the settings name. Errors name file, key, value.
bool booth_bands(const struct booth_settings *booth, struct band_set *out, struct error *err);

// Bits per channel of the display's input: 8 or 10.
int booth_bits(const struct booth_settings *booth);

// Pose of the tracker's frame: p_booth = booth_from_tracker p_tracker. Rolled
// about its axis, then pitched (positive: the axis rises), then yawed
// (positive: the axis turns to the observer's right).
struct rigid booth_from_tracker(const struct booth_settings *booth);

// The socket when none is set: "<runtime_dir>/boothd/boothd.sock"; error
// CONFIG when runtime_dir (XDG_RUNTIME_DIR, handed in by the program) is NULL.
bool booth_socket_default(const char *runtime_dir, char *out, size_t size, struct error *err);

// Where the shipped materials lie: BOOTHD_DATADIR "/materials".
const char *booth_shipped_materials(void);

#endif
