// SPDX-License-Identifier: Apache-2.0
// From any spectroradiometer aimed at the screen to spectral radiance.
#ifndef DRIVERS_RADIOMETER_H
#define DRIVERS_RADIOMETER_H

#include "colorimetry/colour.h"
#include "drivers/spectrometer.h"

struct radiance_sample {
    struct interval taken;
    struct xyz xyz;           // as the instrument computed it, 1931 2 degrees, cd/m2
    double first_nm, step_nm; // of raw
    int count;                // 0..401; 0 from a colorimeter, then radiance is 0
    double raw[401];          // W m-2 sr-1 nm-1 as sent
    struct spectrum radiance; // on the inner grid
};

enum { RADIOMETER_AVERAGE_MOST = 99 };

// Whether spectra are asked for: where the instrument has them, always (without
// them it does not open), never. The names are in the same order.
enum radiometer_spectral {
    RADIOMETER_SPECTRAL_AUTO,
    RADIOMETER_SPECTRAL_YES,
    RADIOMETER_SPECTRAL_NO,
};
extern const char *const radiometer_spectral_names[]; // "auto", "yes", "no", NULL

struct radiometer_options {
    char port[128]; // serial line, "" = none
    int average;    // readings per sample, 1..RADIOMETER_AVERAGE_MOST
    // spotread only:
    char program[128];   // name or path
    char arguments[256]; // more options, separated by blanks
    bool calibrate;      // the instrument lies on its calibration position when opened
    int spectral;        // enum radiometer_spectral
};

extern const struct setting radiometer_settings[];

struct radiometer;

struct radiometer_driver {
    const char *name; // "pr655", "spotread"
    struct radiometer *(*open)(const struct radiometer_options *options, int64_t deadline_ns,
                               struct error *err);
    // RETRY for weak or unstable light and time-outs; RANGE for overload; the
    // text gives the instrument's own status number.
    bool (*read)(struct radiometer *device, int64_t deadline_ns, struct radiance_sample *out,
                 struct error *err);
    void (*identify)(const struct radiometer *device, struct instrument_identity *out);
    void (*close)(struct radiometer *device);
    bool portless; // it needs no options->port
};

extern const struct radiometer_driver *const radiometer_drivers[];

// Whether the readings (Y, cd/m2) that make one sample may be of one light: each
// within 3 % of their mean, or 0.02 cd/m2 where that is more, far above what
// such instruments repeat to. Else RETRY: light that flickers, a misreading.
bool radiometer_agree(const double *luminance, int count, struct error *err);

#endif
