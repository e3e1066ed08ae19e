// SPDX-License-Identifier: Apache-2.0
// What the emulated booth is made of, as a person writes it down: an INI file
// of facts, one struct a section. Places are in the booth frame: metres, x
// right and y up as the observer sees them, z towards the observer.
#ifndef SIMULATOR_SCENARIO_H
#define SIMULATOR_SCENARIO_H

#include <stdbool.h>
#include <stdio.h>

#include "base/error.h"

enum { SCENARIO_LAMPS_MOST = 6, SCENARIO_NAME_SIZE = 32, SCENARIO_PATH_SIZE = 512 };

struct scenario_world {
    int seed;
    double speed; // world seconds per second
    bool cold;    // lamps are cold each time they are switched on
    char script[SCENARIO_PATH_SIZE];
    char lamp[SCENARIO_NAME_SIZE]; // at the start; "" = the first, "none" = dark
    double level;
    double enumeration_s, line_enumeration_s;
};

struct scenario_screen {
    double width_m, height_m;
    int width_px, height_px;
};

struct scenario_stand {
    double hinge_m[3];
    double centre_from_hinge_m[3]; // in screen axes
    double tilt_deg;               // 0 lies flat face up, 90 stands upright
};

struct scenario_ceiling {
    double centre_m[3], width_m, depth_m;
    int true_px[2]; // of the true luminance image
    int map_px[2];  // of the camera's luminance map
    double map_noise;
    double map_read_noise_cdm2;
    double map_scale_error; // greatest; each lamp has its own
};

enum head_markers_worn { HEAD_CLIP, HEAD_CAP };

struct scenario_head {
    double eye_m[3];
    double clip_from_eye_m[3]; // when the head faces straight at the booth
    double turn_most_deg;
    int markers;        // enum head_markers_worn
    bool fourth;        // a fourth marker is worn
    double fourth_m[3]; // its place in the marker frame
};

struct scenario_camera {
    double place_m[3], pitch_deg, yaw_deg, roll_deg;
};

// Standard deviations of what a person measures by hand.
struct scenario_tools {
    double protractor_deg, tape_m;
};

// opentrack, which sends where the head is in datagrams.
struct scenario_opentrack {
    int port; // UDP at 127.0.0.1; 0 = it does not run
    double rate_hz;
    double place_m[3], pitch_deg, yaw_deg; // of its camera
    double zero_m[3];
    bool mirrored; // its picture
};

// The still camera that photographs the ceiling, see lens.h and sensor.h.
struct scenario_ceiling_camera {
    double place_m[3], pitch_deg, yaw_deg, roll_deg;
    int width_px, height_px;
    double focal_px, axis_px[2]; // where the optical axis falls from the middle
    double radial[3], decentred[2], vignetting;
    bool colour;
    int bits, response; // enum sensor_response
    double sensitivity, full_well_e, read_noise_e, dark_e_s, hot_share;
    double shortest_s, ratio;
    int exposures, darks, flats;
    double wall_reflectance;
};

struct scenario_panel {
    double white_cdm2, black_cdm2, reflectance;
    int bits;
    double interaction, dispersion, ripple, uniformity; // 1 = as designed, 0 = none
    double on_s, warmup_drop, warmup_s;
};

struct scenario_spectrometer {
    double place_m[3]; // of the cosine corrector, which looks straight up
    double collector_mm2;
    double calibration_error;
    int model; // enum ooi_name
    char serial[SCENARIO_NAME_SIZE];
};

// Beside the first, of the same collector. A serial of "" means that there is none.
struct scenario_spectrometer_2 {
    int model;
    char serial[SCENARIO_NAME_SIZE];
};

struct scenario_inclinometer {
    int model; // enum witmotion_map
    bool tcp;
    int port;             // 0 = any that is free
    double turned_deg[3]; // on the screen: about its right, then about the sensor's own up and out
    char serial[SCENARIO_NAME_SIZE];
};

struct scenario_radiometer {
    double screen_spot_m, ceiling_spot_m; // diameters
    double hurry;
    double drift; // of the faults drift and misread: see model_lapse.h
    int misread_every;
    char serial[SCENARIO_NAME_SIZE];
};

// The instrument of the emulated spotread; its times and lapses are the radiometer's.
struct scenario_spotread {
    int model; // enum spotread_kind
    char serial[SCENARIO_NAME_SIZE];
};

struct scenario_serial {
    char serial[SCENARIO_NAME_SIZE];
};

enum lamp_form { LAMP_TUBES, LAMP_SPOTS };

// A lamp that lights the ceiling. A name of "" means that there is none.
struct scenario_lamp {
    char name[SCENARIO_NAME_SIZE]; // letters, digits, '.', '_', '-'
    char spectrum[SCENARIO_PATH_SIZE];
    int form;           // enum lamp_form
    int count;          // tubes or spots
    double row_m[2];    // first and last: tubes along z, spots along x, from the ceiling's centre
    double offset_m;    // of the row on the other axis
    double diameter_m;  // of a tube or a spot
    double length_m;    // of a tube
    double haze;        // luminance of the ceiling between, over the lamp's greatest
    double lux;         // at the screen's centre at the starting tilt, level 1, warm
    double warmup_drop; // relative loss of light just after a cold start
    double warmup_s;    // time constant of the way up
};

struct scenario {
    struct scenario_world world;
    struct scenario_screen screen;
    struct scenario_stand stand;
    struct scenario_ceiling ceiling;
    struct scenario_head head;
    struct scenario_camera camera;
    struct scenario_opentrack opentrack;
    struct scenario_ceiling_camera ceiling_camera;
    struct scenario_tools tools;
    struct scenario_panel panel;
    struct scenario_spectrometer spectrometer;
    struct scenario_radiometer radiometer;
    struct scenario_spotread spotread;
    struct scenario_spectrometer_2 spectrometer_2;
    struct scenario_inclinometer inclinometer;
    struct scenario_serial tracker;
    struct scenario_lamp lamps[SCENARIO_LAMPS_MOST];
    char path[SCENARIO_PATH_SIZE]; // of the file; "" = made by hand
};

// Everything at its preset, without any lamp.
void scenario_preset(struct scenario *scenario);

// Reads a file. Paths in it are relative to its folder. Errors (CONFIG) name
// file, line, key, value and what is allowed. *scenario is undefined on failure.
bool scenario_load(const char *path, struct scenario *scenario, struct error *err);

// "NAME=SPECTRUM": gives the lamp of that name another spectrum, or adds a
// lamp of two tubes with it. SPECTRUM is a CIE name or a path relative to the
// current folder.
bool scenario_set_lamp(struct scenario *scenario, const char *text, struct error *err);

// What no single row can check: names, at least one lamp, the starting lamp,
// serials. scenario_load has done it already.
bool scenario_check(const struct scenario *scenario, struct error *err);

// Index of a lamp by name, or -1.
int scenario_lamp_index(const struct scenario *scenario, const char *name);

// A path that the scenario file gave, as seen from the current folder.
void scenario_beside(const struct scenario *scenario, const char *path,
                     char out[SCENARIO_PATH_SIZE * 2]);

// Prints every section with its settings.
void scenario_describe(FILE *out);

#endif
