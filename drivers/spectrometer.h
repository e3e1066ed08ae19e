// SPDX-License-Identifier: Apache-2.0
// From any spectrometer to one plain sample of spectral irradiance.
#ifndef DRIVERS_SPECTROMETER_H
#define DRIVERS_SPECTROMETER_H

#include "base/clock.h"
#include "base/settings.h"
#include "colorimetry/spectrum.h"
#include "drivers/detector.h"

#define SPECTROMETER_STATUSES(X)                                                                   \
    X(GOOD, "good")                                                                                \
    X(SATURATED, "saturated") /* a used pixel reached saturation on raw counts */                  \
    X(WEAK, "weak")           /* too few counts above dark for the longest exposure */             \
    X(SETTLING, "settling")   /* exposure is being found */

enum spectrometer_status {
#define X(name, text) SPECTROMETER_##name,
    SPECTROMETER_STATUSES(X)
#undef X
};

const char *spectrometer_status_name(enum spectrometer_status status);

struct spectrum_sample {
    struct interval taken; // the light fell on the detector within this interval
    enum spectrometer_status status;
    int integration_us; // of this reading
    int averaged;       // readings averaged, >= 1
    bool dark_missing;  // stored darks were asked for, but none covers this exposure
    double peak;        // largest raw count over saturation, 0..1
    // W m-2 nm-1 on the inner grid; 0 where the instrument does not reach.
    struct spectrum irradiance;
    // Standard uncertainty of it (shot, read, dark, calibration), same unit; all
    // 0 where none is known (replay of finished values).
    struct spectrum sigma;
};

// One exposure as the detector counted it, before any processing.
struct spectrum_counts {
    struct interval taken;
    int integration_us;
    struct detector detector;
    uint16_t raw[DETECTOR_PIXELS_MOST]; // detector.pixels of them
};

struct instrument_identity {
    char model[64], serial[64], firmware[64];
    bool emulated; // the instrument says of itself that it is emulated
};

// What the values of a replayed file are: the files do not tell.
enum file_unit { FILE_UW_CM2, FILE_MW_M2, FILE_W_M2 };

struct spectrometer_options {
    char serial[64];         // "" = the first one found
    char calibration[512];   // file of uJ/count per nm; required for absolute readings
    double collector_mm2;    // area of the cosine corrector, 0.01..10000
    double mains_hz;         // 50 or 60: exposures are multiples of half its period
    int integration_us;      // first exposure, 1000..65535000
    int longest_us;          // longest exposure it chooses itself, 1000..65535000
    int average;             // readings per sample, 1..100
    int boxcar;              // half width in pixels, 0..100
    int nonlinearity;        // an enum bend (drivers/irradiance.h)
    char darks[512];         // file of stored dark spectra, "" = black pixels only
    double wavelength_nm[4]; // coefficients over the pixel in place of the unit's own; all 0: those
    char file[512];          // replay: the file
    int file_unit;           // replay: an enum file_unit
    char reference[512];     // replay: file of the light behind a Jaz file's reference column
};

extern const struct setting spectrometer_settings[];

struct spectrometer; // one open instrument

// One driver.
struct spectrometer_driver {
    const char *name; // "ocean"
    // Opens by options->serial. NULL with GONE (not there), SYSTEM (permission:
    // the text names the udev rule), DATA. Must return within deadline_ns.
    struct spectrometer *(*open)(const struct spectrometer_options *options, int64_t deadline_ns,
                                 struct error *err);
    // One sample. RETRY: nothing good this time, call again; GONE: close and
    // open again. Never blocks beyond deadline_ns (CLOCK_MONOTONIC).
    bool (*read)(struct spectrometer *device, int64_t deadline_ns, struct spectrum_sample *out,
                 struct error *err);
    void (*identify)(const struct spectrometer *device, struct instrument_identity *out);
    void (*close)(struct spectrometer *device); // accepts NULL
    // The counts of one exposure of about integration_us, rounded to what the
    // instrument can hold; 0: the exposure that read has come to. The next read goes
    // back to its own exposure. Errors as read. NULL: the driver has no counts.
    bool (*counts)(struct spectrometer *device, int integration_us, int64_t deadline_ns,
                   struct spectrum_counts *out, struct error *err);
};

// NULL-terminated.
extern const struct spectrometer_driver *const spectrometer_drivers[];

#endif
