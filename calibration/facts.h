// SPDX-License-Identifier: Apache-2.0
// Everything a session found out, as plain facts. session.c fills them,
// proof.c judges them, the report_*.c files only write them down.
#ifndef CALIBRATION_FACTS_H
#define CALIBRATION_FACTS_H

#include <jansson.h>
#include <stdbool.h>

#include "calibration/spots.h"
#include "calibration/statistics.h"
#include "colorimetry/colour.h"

enum { FACTS_PATCHES = 64, FACTS_LAMPS = 8, FACTS_POSES = 32 };

// One patch under one lamp. Tristimulus values are absolute, cd/m2, 1931 2
// degrees, unless a name says otherwise.
struct patch_report {
    char name[64];
    struct xyz reference; // what a physical sample sends from that place
    struct xyz measured;  // what the radiometer read from the screen
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
};

struct display_report {
    char measurements[512], model[512]; // files
    int patches, verified;
    struct summary fit, verification; // dE00
    double condition;
    struct xyz white, black;
    double white_drift_percent; // largest change of repeated white readings
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

struct session_facts {
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
