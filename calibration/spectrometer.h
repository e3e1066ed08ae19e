// SPDX-License-Identifier: Apache-2.0
// boothcal spectrometer: calibrating the spectrometer itself, through the
// running boothd. What is judged is judged here by pure functions.
#ifndef CALIBRATION_SPECTROMETER_H
#define CALIBRATION_SPECTROMETER_H

#include "calibration/bench.h"
#include "calibration/raw_counts.h"
#include "drivers/wavelength_refit.h"

// ---- stored darks ----------------------------------------------------------

// What a dark series looks like. Counts are raw.
struct dark_facts {
    double level;       // mean of the pixels that would see light
    double black;       // mean of the black pixels
    double noise;       // of one reading of one pixel
    double drift;       // level above black: second half of the readings less the first
    double drift_limit; // what is allowed
    double leak;        // highest less lowest of the medians of 16 parts of the detector
    double leak_limit;  // what is allowed
    double leak_nm;     // middle of the highest part
    double line;        // highest median of five neighbours above that of all
    double line_limit;  // what is allowed
    double line_nm;     // where
    bool saturated;     // a pixel reached saturation
    bool unsteady;      // drift beyond its limit
    bool illuminated;   // leak or line beyond its limit
};

// Dark current differs little over a detector, light of any lamp a lot: so a
// dark whose parts differ is lit, and so is one with lines, wider than any hot
// pixel. Limits: 0.05 % of saturation and six standard errors; for a leak also 10 %,
// for a line 25 % of the dark current (a real Maya2000Pro: 4 and 15 %).
void dark_judge(const struct raw_counts *dark, struct dark_facts *out);

// Writes what the setting `darks` reads: a row a pixel, a column an exposure,
// ascending. RANGE when they do not ascend or are of different detectors.
bool darks_save(const char *path, const struct raw_counts *darks, int count, struct error *err);

// ---- linearity -------------------------------------------------------------

enum { LINEARITY_MOST = 16 };

// Counts per time of one steady light at several exposures, relative to their
// mean, for each way of applying the unit's polynomial (enum bend).
struct linearity_facts {
    int count, pixels; // exposures; pixels that were used
    int integration_us[LINEARITY_MOST];
    double part[LINEARITY_MOST];   // mean counts above dark over saturation
    double off[3][LINEARITY_MOST]; // relative
    double rms[3];                 // over the exposures
    double noise;                  // rms that noise alone would leave
    int best;                      // enum bend of the least rms
};

// light[i] and dark[i] are of the same exposure, none saturated; count >= 3.
// Used: the pixels above half of the highest count. DATA when there are fewer than
// 10, a saturated one, or exposures that do not belong together.
bool linearity_judge(const struct raw_counts *light, const struct raw_counts *dark, int count,
                     struct linearity_facts *out, struct error *err);

// ---- at the bench ----------------------------------------------------------

// What the command line says; see spectrometer.c.
struct spectrometer_command {
    const char *config, *socket, *booth, *out, *lamp, *counts, *lines;
    int readings; // 0 = not said
    int exposures[LINEARITY_MOST], exposure_count;
    bool dark, json;
    struct booth_settings settings;
    struct bench bench;
};

// The exposure at which the light that is there comes nearest to 85 % of
// saturation, up to longest_us. DATA when it saturates at the shortest.
bool spectrometer_expose(struct spectrometer_command *c, int longest_us, int *us,
                         struct error *err);

// Each does its work at an open bench and prints what it found; *warning
// (PATH-sized) receives what is doubtful.
enum { WARNING_SIZE = 512 };
bool spectrometer_raw(struct spectrometer_command *c, char *warning, struct error *err);
bool spectrometer_dark(struct spectrometer_command *c, char *warning, struct error *err);
bool spectrometer_wavelength(struct spectrometer_command *c, char *warning, struct error *err);
bool spectrometer_linearity(struct spectrometer_command *c, char *warning, struct error *err);

#endif
