// SPDX-License-Identifier: Apache-2.0
// Everything a session found out, as plain facts. session.c fills them,
// proof.c judges them, the report_*.c files only write them down.
#ifndef CALIBRATION_FACTS_H
#define CALIBRATION_FACTS_H

#include <jansson.h>
#include <stdbool.h>

#include "calibration/spots.h"
#include "calibration/statistics.h"
#include "colorimetry/display.h"
#include "render/stand.h"

enum { FACTS_PATCHES = 64, FACTS_LAMPS = 8, FACTS_POSES = 32 };

// One patch under one lamp. Tristimulus values are absolute, cd/m2, 1931 2
// degrees, unless a name says otherwise.
struct patch_report {
    char name[64];
    struct xyz reference; // what a physical sample sends from that place
    struct xyz measured;  // what the radiometer read from the screen
    struct xyz expected;  // what such a sample sends by the taught spectrum and the luminance map
    struct xyz aimed;     // what boothd wanted to reach the eye
    struct xyz predicted; // what its models say that reached the eye
    struct counts counts; // before rounding, 0..1
    struct xyz full;      // relative, Y = 100: full spectrum under the taught lamp
    struct xyz bands;     // relative, Y = 100: band coefficients under the taught lamp
    bool in_gamut;        // the display model reaches it
    int reading;          // index into session_facts.readings
    double de_simulation; // bands against full, as published
    double de_published;  // measured against reference, each divided by its own white patch
    double de_absolute;   // measured against reference, cd/m2, no division
};

// The summaries that stand beside the published table.
struct proof_summary {
    struct summary simulation, published, published_in_gamut, absolute, absolute_in_gamut;
};

struct lamp_report {
    char name[64], asked[512]; // asked: the spectrum named for an emulated lamp, else ""
    struct spectrum irradiance; // as taught, W m-2 nm-1
    double lux, spread;         // at the spectrometer; relative spread of the readings
    int teach_readings;
    struct xy chromaticity;
    struct cct cct;
    double map_scale; // median of the spot readings over the map, at the taught level
    int spots;
    double spot_ratios[SPOTS_MOST];
    struct xyz white_taught;                    // perfect diffuser under the taught spectrum, Y = 100
    struct xyz white_reference, white_measured; // perfect diffuser at the screen's centre, cd/m2
    double white_error_percent;                 // of luminance
    int patch_count;
    struct patch_report patches[FACTS_PATCHES];
    int white_patch; // index of the patch that the published method divides by
    struct proof_summary proof;
    bool reached;      // every target of proof.h
    char picture[512]; // PNG of what the screen showed
    char map[512];     // luminance map, as photographed: times map_scale it is absolute
    double spot_x_m[SPOTS_MOST], spot_z_m[SPOTS_MOST];
    double proof_lux;       // on the screen's centre, by the daemon, when the chart was shown
    double gains[4];        // of the display towards the eye: red, green, blue, black
    struct xyz black_shown; // black under the lamp, as read: the display's own and its reflection
    int repeats;            // readings of the perfect diffuser, one after the other
    double repeat_level;    // their relative standard deviation of Y
    double repeat_colour;   // and of X / Y and Z / Y, rms
    double chart_drift_percent; // of the perfect diffuser over the chart's readings
};

struct display_report {
    char measurements[512], model[512]; // files
    int patches, verified;
    struct summary fit, verification; // dE00
    double condition;
    struct xyz white, black;
    double white_drift_percent; // largest change of repeated white readings
    double warm_up_s, warm_up_percent_h; // waited for white to stand still; its slope then
    double settle_s;                     // waited after each patch
    struct vec3 residual;                // over the patches kept apart; see budget_residual
};

// How the display's light depends on direction and place; see view_fit.h.
struct view_report {
    bool measured;
    int directions, places;
    double before_de00, after_de00, before_percent, after_percent, place_de00, place_percent;
};

// White shown after moving the screen or the head.
struct pose_report {
    double tilt_deg, tilt_seen_deg;
    struct vec3 eye, eye_seen; // booth frame, m
    bool moved_screen;         // white was measured again
    bool off_axis;             // and the eye lies off_normal_deg off the screen's normal
    double off_normal_deg;
    struct xyz reference, measured;
    double error_percent;
};

// Where everything stood while the chart was proofed.
struct place_report {
    struct screen screen;
    struct stand stand;
    double tilt_deg;
    struct vec3 eye;          // booth frame, m
    double centre_m[3], width_m, depth_m; // of the ceiling
    double reflectance;       // of the screen's surface
    int bits;
    bool dither;
};

// A patch of the chart as the material's file has it.
struct chart_report {
    char name[64];
    struct spectrum reflectance;
};

struct session_facts {
    char environment[256]; // what was noted of it, "" = nothing
    char config[512], material[512];
    struct place_report place;
    int chart_count;
    struct chart_report chart[FACTS_PATCHES];
    char booth[128], started[32], finished[32], software[64], observer[16];
    bool emulated;
    bool truth_emulated; // reference comes from the emulated booth, else from the taught spectrum
    int lamp_count, pose_count;
    struct lamp_report lamps[FACTS_LAMPS];
    struct display_report display;
    struct view_report view;
    struct pose_report poses[FACTS_POSES];
    json_t *settings; // of the daemon: its whole status at the end
    json_t *readings; // array: every reply of the radiometer and every taught spectrum, as it came
    double seconds;
};

#endif
